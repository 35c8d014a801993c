"""The cells of a sweep and the settings that they have in common."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Final

MAX_CELLS: Final = 5_000_000
_MAX_SEED: Final = 2**63 - 1  # of a column of the table

Row = dict[str, Any]
"""The values of one row of the table by column; see `columns.py`."""


class SweepError(Exception):
    """The arguments of a sweep or the contents of its folder are invalid, or it cannot be run."""


@dataclass(frozen=True, slots=True)
class Cell:
    """One episode of a sweep.

    Attributes:
        world: World file, as given.
        controller: Name of an included controller, `FILE.py:CLASS` or `MODULE:CLASS`.
        seed: Seed of the world, of the start and the goal, and of the controller.
    """

    world: str
    controller: str
    seed: int


@dataclass(frozen=True, slots=True)
class Settings:
    """What all cells of a sweep have in common.

    Attributes:
        robot: Name of the model to be driven; empty for the first model with a laser.
        laser: Name of its laser; empty for the first one.
        cmd_vel: Topic of its velocity command, in the namespace of the model.
        params: Values of `param()` in YAML files.
        period: Time between two commands [s].
        time_limit: Simulated time after which an episode ends [s].
        tolerance: Distance to the goal at which it is reached [m].
        min_distance: Minimum distance between start and goal, in a straight line [m].
        max_distance: Maximum distance between start and goal [m]; None for any.
        clearance: Minimum distance of starts and goals to obstacles [m].
        max_speed: Limit of the commanded speed [m/s].
        max_turn: Limit of the commanded yaw rate [rad/s].
        max_collisions: Number of collisions after which the next one ends an episode.
    """

    robot: str = ""
    laser: str = ""
    cmd_vel: str = "cmd_vel"
    params: Mapping[str, object] = field(default_factory=dict)
    period: float = 0.1
    time_limit: float = 60.0
    tolerance: float = 0.3
    min_distance: float = 2.0
    max_distance: float | None = None
    clearance: float = 0.1
    max_speed: float = 0.8
    max_turn: float = 1.5
    max_collisions: int = 0

    def __post_init__(self) -> None:
        """Checks the numbers.

        Raises:
            SweepError: One is out of range.
        """
        for name in ("period", "time_limit", "tolerance", "max_speed", "max_turn"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise SweepError(f"{name} must be a finite number above 0, got {value}")
        for name in ("min_distance", "clearance", "max_collisions"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise SweepError(f"{name} must be a finite number of at least 0, got {value}")
        if self.max_distance is not None and not self.max_distance > self.min_distance:
            raise SweepError(
                f"max_distance must be greater than min_distance, {self.min_distance:g} m, "
                f"got {self.max_distance}"
            )
        if self.tolerance >= self.min_distance:
            raise SweepError(
                f"min_distance must be greater than tolerance, {self.tolerance:g} m: other goals "
                f"are reached at the start; got {self.min_distance:g}"
            )

    def as_dict(self) -> dict[str, Any]:
        """Returns all values by name, for a file."""
        return {one.name: getattr(self, one.name) for one in fields(self)}


def parse_seeds(text: str) -> list[int]:
    """Returns the seeds of a list of numbers and ranges, each seed once.

    Args:
        text: Numbers and ranges FIRST:END or FIRST:END:STEP without END, separated by commas, as
            in `0:100` or `1,2,10:20`.

    Raises:
        SweepError: The text is invalid, or there are no seeds or too many.
    """
    seeds: dict[int, None] = {}
    for part in text.split(","):
        if not re.fullmatch(r"\s*[0-9]+(:[0-9]+(:[0-9]+)?)?\s*", part):
            raise SweepError(
                f"seeds must be numbers and ranges, as in 0:100 or 1,2,10:20, got {text!r}"
            )
        numbers = [int(number) for number in part.split(":")]
        if len(numbers) == 3 and numbers[2] == 0:
            raise SweepError(f"the step of a range of seeds must be at least 1, got {text!r}")
        if max(numbers) > _MAX_SEED:
            raise SweepError(f"seeds must be at most {_MAX_SEED}, got {text!r}")
        found = range(numbers[0], numbers[0] + 1) if len(numbers) == 1 else range(*numbers)
        if len(found) > MAX_CELLS:
            raise SweepError(f"a sweep must have at most {MAX_CELLS} seeds, got {text!r}")
        seeds.update(dict.fromkeys(found))
    if not seeds:
        raise SweepError(f"there are no seeds in {text!r}; the end of a range is excluded")
    return list(seeds)


def table_of_cells(
    worlds: Sequence[str], controllers: Sequence[str], seeds: Sequence[int]
) -> list[Cell]:
    """Returns all combinations, each once.

    The seed varies slowest: after a part of the time, all controllers have been run for the same
    seeds.

    Raises:
        SweepError: There are none or too many.
    """
    lists: dict[str, list[Any]] = {
        "worlds": _unique(worlds),
        "controllers": _unique(controllers),
        "seeds": _unique(seeds),
    }
    for name, values in lists.items():
        if not values:
            raise SweepError(f"a sweep needs {name}")
    count = math.prod(map(len, lists.values()))
    if count > MAX_CELLS:
        raise SweepError(f"a sweep must have at most {MAX_CELLS} cells, got {count}")
    return [
        Cell(world, controller, seed)
        for seed in lists["seeds"]
        for world in lists["worlds"]
        for controller in lists["controllers"]
    ]


def _unique(values: Iterable[Any]) -> list[Any]:
    return list(dict.fromkeys(values))
