"""The registered environments."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any, Final, Literal, NoReturn, overload

import gymnasium
from gymnasium.envs.registration import VectorizeMode
from gymnasium.error import NameNotFound, UnsupportedMode

from flatland.extras import require
from flatland.gym.buildings import RandomBuildings
from flatland.gym.settings import DEFAULT_STEPS

if TYPE_CHECKING:
    from flatland.gym.fleet import FleetEnv
    from flatland.gym.fleet_vector import FleetVectorEnv
    from flatland.gym.vector import FlatlandVectorEnv

_BUILDINGS: Final = 16

SINGLE: Final[dict[str, dict[str, Any]]] = {
    "flatland/Navigate-v0": {"world": "navigate"},
    "flatland/Corridor-v0": {"world": "corridor"},
    "flatland/Crowd-v0": {"world": "crowd"},
    "flatland/Maze-v0": {"world": RandomBuildings("maze", _BUILDINGS)},
    "flatland/Warehouse-v0": {"world": RandomBuildings("warehouse", _BUILDINGS)},
}
"""Arguments of the environments with one robot."""
STEPS: Final = {"flatland/Corridor-v0": 200}
"""Limits of episodes that differ from `DEFAULT_STEPS` [steps]."""
PARALLEL: Final[dict[str, dict[str, Any]]] = {"flatland/Fleet-v0": {"world": "fleet"}}
"""Arguments of the environments with several robots."""


def register_all() -> None:
    """Registers all environments with Gymnasium."""
    for name, arguments in SINGLE.items():
        gymnasium.register(
            name,
            entry_point="flatland.gym.env:FlatlandEnv",
            vector_entry_point="flatland.gym.vector:FlatlandVectorEnv",
            # The limit of Gymnasium, so that its argument `max_episode_steps` replaces it.
            max_episode_steps=STEPS.get(name, DEFAULT_STEPS),
            kwargs={**arguments, "max_steps": None},
        )
    for name in PARALLEL:
        # Gymnasium has no environments with several agents, apart from vectors of their robots: the
        # entry point raises an error.
        gymnasium.register(
            name,
            entry_point=functools.partial(_refuse, name),
            vector_entry_point="flatland.gym.fleet_vector:FleetVectorEnv",
            max_episode_steps=DEFAULT_STEPS,
            kwargs={**PARALLEL[name], "max_steps": None},
        )


@overload
def make_vec(
    name: Literal["flatland/Fleet-v0"], num_envs: int = 1, **arguments: Any
) -> FleetVectorEnv: ...


@overload
def make_vec(name: str, num_envs: int = 1, **arguments: Any) -> FlatlandVectorEnv: ...


def make_vec(name: str, num_envs: int = 1, **arguments: Any) -> FlatlandVectorEnv | FleetVectorEnv:
    """Returns many environments that are stepped together, in the core and over all cores.

    Args:
        name: A registered name, such as `flatland/Navigate-v0`.
        num_envs: Number of environments; of worlds for environments with several robots, each of
            which is an environment of the vector.
        **arguments: See `FlatlandVectorEnv`, `FleetVectorEnv` and `Settings`. Either of `max_steps`
            and `max_episode_steps` replaces the limit of the registered environment.

    Raises:
        gymnasium.error.Error: The name is unknown.
        FlatlandError: A file is missing or invalid, or the model cannot be an agent.
        TypeError: An argument is unknown or has the wrong type.
        ValueError: An argument is out of range.
    """
    if name not in SINGLE and name not in PARALLEL:
        known = ", ".join([*SINGLE, *PARALLEL])
        raise NameNotFound(f'environment "{name}" does not exist; known: {known}')
    if arguments.get("max_steps") is not None:
        arguments.setdefault("max_episode_steps", arguments["max_steps"])
    envs: Any = gymnasium.make_vec(
        name, num_envs, vectorization_mode=VectorizeMode.VECTOR_ENTRY_POINT, **arguments
    )
    vector: FlatlandVectorEnv | FleetVectorEnv = envs
    return vector


def make_parallel(name: str = "flatland/Fleet-v0", **arguments: Any) -> FleetEnv:
    """Returns an environment with several robots, with the parallel API of PettingZoo.

    Args:
        name: A registered name.
        **arguments: See `FleetEnv` and `Settings`.

    Raises:
        ImportError: PettingZoo is not installed.
        gymnasium.error.Error: The name is unknown.
        FlatlandError: A file is missing or invalid, or the model cannot be an agent.
        TypeError: An argument is unknown or has the wrong type.
        ValueError: An argument is out of range.
    """
    if name not in PARALLEL:
        raise NameNotFound(f'environment "{name}" does not exist; known: {", ".join(PARALLEL)}')
    require("pettingzoo", "environments with several robots require")
    from flatland.gym.fleet import FleetEnv

    return FleetEnv(**{**PARALLEL[name], **arguments})


def _refuse(name: str, **_arguments: Any) -> NoReturn:
    raise UnsupportedMode(
        f'{name} has several robots and the API of PettingZoo: flatland.gym.make_parallel("{name}")'
    )
