"""Recording of a world into a bag, without a ROS master."""

from __future__ import annotations

import os
from typing import Any

import rosbag
from genpy import Time

from flatland.ros.adapters import convert
from flatland.ros.message_recorder import MessageRecorder

_FIRST_TIME = 1  # ns; rosbag play ignores messages at time 0


class BagRecorder(MessageRecorder):
    """Writes all outputs and transforms of a world to a bag, with simulated stamps."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """Creates the bag, overwriting an existing file.

        Raises:
            OSError: The file cannot be written.
        """
        super().__init__()
        self._bag = rosbag.Bag(os.fspath(path), "w")

    def write_message(self, topic: str, message: Any, time_ns: int, sequence: int) -> None:
        """Writes a message."""
        del sequence
        self._bag.write(topic, message, convert.time(max(time_ns, _FIRST_TIME), Time))

    def finish(self) -> None:
        """Writes the index and closes the file."""
        self._bag.close()
