"""Which runs are evidence: equal runs of a scenario, which differ in nothing but the seed, are one.

A seed is a sample only if something in the scenario is random. The tests and intervals of
`flatland.scenarios.statistics` require independent samples; a repetition of a run is none (S. H.
Hurlbert, "Pseudoreplication and the Design of Ecological Field Experiments", Ecological Monographs
54, 1984).
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from dataclasses import dataclass
from typing import Final

from flatland.scenarios.columns import COLUMNS, Row

# The hash of the state contains the random numbers, used or not.
_COMPARED: Final = tuple(
    name
    for name, column in COLUMNS.items()
    if not column.is_timing and name not in ("seed", "state_hash")
)


def identity(row: Row) -> Hashable:
    """Returns what is equal for equal runs: scenario, controller, trajectory and all measures."""
    return tuple(row[name] for name in _COMPARED)


def distinct(rows: Iterable[Row]) -> list[Row]:
    """Returns the first row of each group of equal runs."""
    first: dict[Hashable, Row] = {}
    for row in rows:
        first.setdefault(identity(row), row)
    return list(first.values())


@dataclass(frozen=True, slots=True)
class Repetition:
    """The runs of a scenario with a controller, some of which are equal.

    Attributes:
        scenario: Title of the scenario.
        controller: The controller.
        seeds: Number of runs.
        distinct: Number of runs of which no two are equal.
    """

    scenario: str
    controller: str
    seeds: int
    distinct: int

    def __str__(self) -> str:
        trajectories = "trajectory" if self.distinct == 1 else "trajectories"
        return (
            f"{self.scenario} with {self.controller}: {self.seeds} seeds, "
            f"{self.distinct} distinct {trajectories}"
        )


def repetitions(rows: Iterable[Row]) -> list[Repetition]:
    """Returns the scenarios and controllers with equal runs, in the order of the rows."""
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        groups.setdefault((row["scenario"], row["controller"]), []).append(row)
    found = [
        Repetition(scenario, controller, len(group), len(distinct(group)))
        for (scenario, controller), group in groups.items()
    ]
    return [one for one in found if one.distinct < one.seeds]
