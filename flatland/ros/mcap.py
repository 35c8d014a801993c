"""Recording of a world into an MCAP file with ROS 1 messages."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from mcap_ros1.writer import Writer

from flatland.ros.message_recorder import MessageRecorder

_CHUNK_SIZE = 256 * 1024  # bytes; what is lost if the process is killed


class McapRecorder(MessageRecorder):
    """Writes all outputs and transforms of a world to an MCAP file, with simulated times."""

    def __init__(self, path: str | os.PathLike[str], ends_on_error: bool = False) -> None:
        """Creates the file, overwriting an existing one.

        Args:
            path: The file.
            ends_on_error: See `MessageRecorder`.

        Raises:
            OSError: The file cannot be written.
        """
        super().__init__(ends_on_error)
        self._file = Path(path).open("wb")  # noqa: SIM115 - closed by `finish`
        self._writer = Writer(self._file, chunk_size=_CHUNK_SIZE)

    def write_message(self, topic: str, message: Any, time_ns: int, sequence: int) -> None:
        """Writes a message."""
        self._writer.write_message(topic, message, time_ns, time_ns, sequence)

    def finish(self) -> None:
        """Writes the index and closes the file."""
        if not self._file.closed:
            with self._file:
                self._writer.finish()
