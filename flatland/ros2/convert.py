"""Conversion of message parts, also for the adapters of other packages."""

from __future__ import annotations

from builtin_interfaces.msg import Time
from std_msgs.msg import Header

from flatland.node.stamps import stamp
from flatland.timekeeper import NANOSECONDS


def time(nanoseconds: int) -> Time:
    """Converts simulated nanoseconds to a stamp without rounding."""
    seconds, nanoseconds = divmod(stamp(nanoseconds), NANOSECONDS)
    return Time(sec=seconds, nanosec=nanoseconds)


def header(nanoseconds: int, frame_id: str) -> Header:
    """Creates a header with the stamp of simulated nanoseconds."""
    return Header(stamp=time(nanoseconds), frame_id=frame_id)
