"""The stamps of all messages of the process: simulated time, or wall time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

FIRST_TIME: Final = 1
"""Time on `/clock` and in recordings of messages instead of 0 [ns].

ROS takes the time 0 for "no time": `rosbag record` ends when `/clock` returns to it, players ignore
messages of it, and nodes wait as if there were no clock.
"""

_stamps: Callable[[int], int] | None = None


def set_stamps(stamps: Callable[[int], int] | None) -> None:
    """Sets the stamps of all messages of this process.

    Args:
        stamps: Returns the stamp [ns] of a simulated time [ns]; called in any thread. None if
            stamps are simulated times.
    """
    global _stamps
    _stamps = stamps


def stamp(nanoseconds: int) -> int:
    """Returns the stamp [ns] of a simulated time [ns]: that time, or wall time."""
    return nanoseconds if _stamps is None else _stamps(nanoseconds)


def clock_time(time_ns: int) -> int:
    """Returns the time of `/clock`, or of a recorded message, for a time [ns]."""
    return max(time_ns, FIRST_TIME)
