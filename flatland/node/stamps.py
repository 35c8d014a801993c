"""The stamps of all messages of the process: simulated time, or wall time."""

from __future__ import annotations

from collections.abc import Callable

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
