"""The registered environments."""

from __future__ import annotations

import functools
import threading
import weakref
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, Literal, NoReturn, overload

import gymnasium
from gymnasium.envs.registration import EnvSpec, VectorizeMode
from gymnasium.error import NameNotFound, UnsupportedMode

from flatland.extras import require
from flatland.gym.buildings import RandomBuildings
from flatland.gym.env import FlatlandEnv
from flatland.gym.settings import DEFAULT_STEPS
from flatland.gym.staged_vector import RegisteredLimit

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


class _Spec(EnvSpec):
    """A registered environment, for which `max_steps` and `max_episode_steps` are one limit.

    `gymnasium.make` limits an environment to `max_episode_steps` of its registration unless that is
    an argument. It reads the attribute twice after it has created the environment, in the same
    thread: `made` provides these values, until the environment is reset.
    """

    made = threading.local()

    @property
    def max_episode_steps(self) -> int:
        """The argument `max_steps` of the environment that is being made, or the registered one."""
        env, reads = vars(self.made).get("env", lambda: None)(), vars(self.made).get("reads", 0)
        if env is None or env._np_random is not None or not reads:
            return self._steps
        self.made.reads = reads - 1
        steps: int | None = env.episodes.settings.max_steps
        return self._steps if steps is None else steps

    @max_episode_steps.setter
    def max_episode_steps(self, steps: int) -> None:
        self._steps = RegisteredLimit(steps)


def make_single(**arguments: Any) -> FlatlandEnv:
    """Creates an environment for `gymnasium.make`; see `FlatlandEnv`."""
    env = FlatlandEnv(**arguments)
    _Spec.made.env, _Spec.made.reads = weakref.ref(env), 2
    return env


make_single.metadata = FlatlandEnv.metadata  # type: ignore[attr-defined]  # read by Gymnasium


def register_all() -> None:
    """Registers all environments with Gymnasium."""
    for name, arguments in SINGLE.items():
        _register(
            name, "flatland.gym.registration:make_single", "vector:FlatlandVectorEnv", arguments
        )
    for name, arguments in PARALLEL.items():
        # Gymnasium has no environments with several agents, apart from vectors of their robots: the
        # entry point raises an error.
        refuse = functools.partial(_refuse, name)
        _register(name, refuse, "fleet_vector:FleetVectorEnv", arguments)


def _register(
    name: str, entry_point: str | Callable[..., Any], vector: str, arguments: dict[str, Any]
) -> None:
    gymnasium.registry[name] = _Spec(
        name,
        entry_point,
        vector_entry_point=f"flatland.gym.{vector}",
        max_episode_steps=STEPS.get(name, DEFAULT_STEPS),
        kwargs={**arguments, "max_steps": None},
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
