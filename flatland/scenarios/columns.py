"""The columns of the table of runs: every measure with its formula and source.

`docs/scenarios.md` contains the same table; a test compares them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, Literal

from flatland.foreign_texts import clean_text

Row = dict[str, Any]
"""The values of one run by column; None for a missing value."""


@dataclass(frozen=True, slots=True)
class Column:
    """A column of the table.

    Attributes:
        name: Name of the column.
        type: `str`, `int`, `float` or `bool`.
        unit: Unit, empty for numbers without a unit.
        better: Whether larger or smaller values are better; empty if neither is.
        far: Whether a missing value stands for an infinite distance.
        is_timing: Whether it differs between two runs of the same scenario, seed and controller.
    """

    name: str
    type: type
    unit: str = ""
    better: Literal["", "more", "less"] = ""
    far: bool = False
    is_timing: bool = False


FAULTS: Final = ("error", "invalid")
"""Outcomes of runs that say nothing about how the robot drives."""

KEY: Final = ("scenario", "controller", "seed")
"""The columns that identify a row."""

COLUMNS: Final = {
    column.name: column
    for column in (
        Column("scenario", str),
        Column("controller", str),
        Column("seed", int),
        Column("passed", bool, better="more"),
        Column("outcome", str),
        Column("success", bool, better="more"),
        Column("goals", int, better="more"),
        Column("time", float, "s", "less"),
        Column("path_length", float, "m", "less"),
        Column("shortest_path", float, "m"),
        Column("spl", float, "", "more"),
        Column("collisions", int, "", "less"),
        Column("collided_with", str),
        Column("impact_speed", float, "m/s", "less"),
        Column("clearance", float, "m", "more", far=True),
        Column("jerk", float, "m/s^3", "less"),
        Column("angular_jerk", float, "rad/s^3", "less"),
        Column("stuck_time", float, "s", "less"),
        Column("recoveries", int, "", "less"),
        Column("people_distance", float, "m", "more", far=True),
        Column("intrusions", int, "", "less"),
        Column("intrusion_time", float, "s", "less"),
        Column("energy", float, "J", "less"),
        Column("final_distance", float, "m", "less"),
        Column("localization_error", float, "m", "less"),
        Column("max_localization_error", float, "m", "less"),
        Column("start_x", float, "m"),
        Column("start_y", float, "m"),
        Column("goal_x", float, "m"),
        Column("goal_y", float, "m"),
        Column("steps", int),
        Column("trajectory", str),
        Column("state_hash", str),
        Column("failures", str),
        Column("error", str),
        Column("late_commands", int, is_timing=True),
        Column("command_time", float, "ms", is_timing=True),
        Column("max_command_time", float, "ms", is_timing=True),
        Column("real_time_factor", float, is_timing=True),
        Column("wall_time", float, "s", is_timing=True),
        Column("worker", str, is_timing=True),
    )
}
"""All columns by name. All but the key, `passed`, `outcome` and `success` may be missing."""

MEASURES: Final = {
    name: column
    for name, column in COLUMNS.items()
    if column.type in (int, float) and column.better
}
"""The columns that conditions and comparisons may refer to."""

TIMING: Final = tuple(name for name, column in COLUMNS.items() if column.is_timing)
"""The columns that differ between two runs of the same scenario, seed and controller."""


def empty_row(key: tuple[str, str, int]) -> Row:
    """Returns a row of a run without any measure."""
    row: Row = dict.fromkeys(COLUMNS)
    row.update(zip(KEY, key, strict=True))
    row.update(passed=False, outcome="error", success=False)
    return row


def error_row(key: tuple[str, str, int], reason: str) -> Row:
    """Returns the row of a run that failed for a reason."""
    return clean_row(empty_row(key) | {"error": reason, "failures": reason})


def clean_row(row: Row) -> Row:
    """Returns a row whose texts can be printed, encoded and stored in any format of results."""
    return {
        name: clean_text(value) if isinstance(value, str) else value for name, value in row.items()
    }
