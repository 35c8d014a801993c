"""The columns of the table of results."""

from __future__ import annotations

from typing import Any, Final

from flatland_sweep.cells import Cell, Row

KEY: Final = ("world", "controller", "seed")
"""The columns that identify a row."""

TIMING: Final = ("wall_time", "worker")
"""The columns that differ between two runs of the same cell."""

COLUMNS: Final[dict[str, type]] = {
    "world": str,
    "controller": str,
    "seed": int,
    "outcome": str,  # reached, collision, timeout or error
    "success": bool,  # the outcome is reached
    "time": float,  # simulated time at the end [s]
    "path_length": float,  # [m]
    "collisions": int,
    "min_clearance": float,  # [m]
    "distance": float,  # from start to goal, in a straight line [m]
    "start_x": float,  # world frame [m]
    "start_y": float,
    "goal_x": float,
    "goal_y": float,
    "final_distance": float,  # to the goal at the end [m]
    "steps": int,
    "state_hash": str,  # of the world at the end
    "inputs_hash": str,  # of all files that the world was loaded from
    "error": str,  # what failed; missing unless the outcome is error
    "wall_time": float,  # [s]
    "worker": str,  # host and process
}
"""The type of each column. All but the key, `outcome` and `success` may be missing."""


def row_of(cell: Cell, **values: Any) -> Row:
    """Returns a row with all columns; those without a value are missing."""
    row: Row = dict.fromkeys(COLUMNS)
    row.update(world=cell.world, controller=cell.controller, seed=cell.seed)
    row.update(values)
    row["success"] = row["outcome"] == "reached"
    return row
