"""What the programs of this folder have in common: the buildings of training and evaluation."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from flatland import worldgen
from flatland.gym import (
    Buildings,
    FlatlandVectorEnv,
    Outcomes,
    RandomBuildings,
    evaluate,
    included_robot,
    make_vec,
)
from flatland.world import World

if TYPE_CHECKING:
    from flatland.config.inputs import Params

NAME: Final = "flatland/Navigate-v0"
EVALUATION_SEED: Final = 1_000_000  # of the first episode
SIZE: Final = (20.0, 14.0)  # m, of the random buildings
_TRAINING_KINDS: Final = ("office", "office", "maze", "office", "office with people")
_PEOPLE: Final = """
plugins:
  - name: people
    type: Pedestrians
    groups:
      - {name: person, count: 12}
"""

TASKS: Final[dict[str, tuple[Callable[[int], FlatlandVectorEnv], int]]] = {
    "unseen offices": (
        lambda n: FlatlandVectorEnv(
            n,
            RandomBuildings("office", 64, first_seed=1000, size=SIZE),
            autoreset_mode="SameStep",
        ),
        1,
    ),
    NAME: (lambda n: make_vec(NAME, n, autoreset_mode="SameStep"), 1),
    "flatland/Crowd-v0": (
        lambda n: make_vec("flatland/Crowd-v0", n, autoreset_mode="SameStep"),
        4,
    ),
}
"""What policies are evaluated on, by name: how a number of environments is made, and a divisor of
the number of episodes. No training takes place there."""


class TrainingBuildings(Buildings):
    """Random offices and mazes of successive seeds; in some offices, there are people.

    Attributes:
        first_seed: Seed of the first building.
    """

    def __init__(self, count: int = 60, first_seed: int = 0) -> None:
        """Creates the collection; the worlds are generated when an environment is created.

        Args:
            count: Number of buildings.
            first_seed: Seed of the first building; that of others is greater by their index.
        """
        super().__init__(f"building_{number}" for number in range(count))
        self.first_seed = first_seed

    def load(self, number: int, params: Params, step_size: float) -> World:
        """Generates and loads a building."""
        kind, _, people = _TRAINING_KINDS[number % len(_TRAINING_KINDS)].partition(" with ")
        generated = worldgen.generate(kind, self.first_seed + number, SIZE)
        with tempfile.TemporaryDirectory() as folder:
            path = generated.write(Path(folder) / self.worlds[number], robot=included_robot())
            if people:
                with path.open("a") as file:
                    file.write(_PEOPLE)
            return World.from_yaml(path, seed=number, params=params, step_size=step_size)


def evaluate_on(
    task: str, make: Callable[[FlatlandVectorEnv], Callable[[Any], Any]], episodes: int
) -> Outcomes:
    """Runs the episodes of the evaluation.

    Args:
        task: A key of `TASKS`.
        make: Returns a controller or a policy for environments.
        episodes: Number of episodes, before the division in `TASKS`.
    """
    make_envs, divisor = TASKS[task]
    count = max(1, episodes // divisor)
    envs = make_envs(min(count, 64))
    try:
        return evaluate(make(envs), envs, count, EVALUATION_SEED)
    finally:
        envs.close()


def rates(outcomes: Outcomes) -> str:
    """Returns the rates of reached goals, collisions and time limits, and the mean steps."""
    return (
        f"{outcomes.success_rate:6.1%} {outcomes.collision_rate:6.1%} {outcomes.rest_rate:6.1%} "
        f"{outcomes.mean_steps:5.0f}"
    )
