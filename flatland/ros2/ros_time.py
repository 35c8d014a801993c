"""The ROS time of the node: simulated time, or wall time."""

from __future__ import annotations

import time

_now_ns: int | None = None


def set_now(time_ns: int | None) -> None:
    """Sets the current time [ns]; None for wall time."""
    global _now_ns
    _now_ns = time_ns


def now() -> int:
    """Returns the current time [ns]."""
    return time.time_ns() if _now_ns is None else _now_ns
