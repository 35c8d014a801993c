"""Files with the messages of a world, without a ROS master: bags and MCAP files."""

from __future__ import annotations

import os
import struct
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any, Final

from flatland.extras import require
from flatland.node.message_recorder import MessageRecorder
from flatland.ros.adapters import convert, find_adapter

_SEQUENCE: Final = struct.Struct("<I")
_CHUNK_SIZE: Final = 256 * 1024  # bytes of an MCAP file; what is lost if the process is killed


def _recorded_class(message_type: type[Any]) -> type[Any]:
    """Returns the class of messages of a type that are serialized already."""

    class Recorded(message_type):  # type: ignore[misc]
        """A message that is serialized already."""

        def __init__(self, data: bytes) -> None:
            self._data = data

        def serialize(self, buff: BytesIO) -> None:
            buff.write(self._data)

    return Recorded


def _numbered(message_type: type[Any], data: bytes, number: int) -> bytes:
    """Returns a serialized message with a sequence number, if it has a header."""
    return _SEQUENCE.pack(number) + data[_SEQUENCE.size :] if message_type._has_header else data


def _serialized(message: Any) -> bytes:
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def _recorder(
    write: Callable[[str, Any, int, int], None],
    finish: Callable[[], object],
    *,
    ends_on_error: bool = False,
) -> MessageRecorder:
    """Creates a recorder.

    Args:
        write: Writes a message, given its topic, the message, its time [ns], and its number on
            the topic.
        finish: Completes and closes the file.
        ends_on_error: See `MessageRecorder`.
    """
    classes: dict[type[Any], type[Any]] = {}

    def write_bytes(topic: str, kind: type[Any], data: bytes, time_ns: int, number: int) -> None:
        if kind not in classes:
            classes[kind] = _recorded_class(kind)
        write(topic, classes[kind](_numbered(kind, data, number)), time_ns, number)

    return MessageRecorder(
        find_adapter, _serialized, write_bytes, finish, ends_on_error=ends_on_error
    )


def record_bag(path: str | os.PathLike[str]) -> MessageRecorder:
    """Creates a recorder of a bag with simulated stamps; an existing file is overwritten.

    Raises:
        FlatlandError: A required package is not installed.
        OSError: The file cannot be created.
    """
    require("tf2_msgs.msg", "bags need")  # Transforms are recorded in any case.
    bag_class = require("rosbag", "bags need").Bag
    # Not opened by `Bag`, which leaves it open if the index cannot be written.
    file = Path(path).open("w+b")  # noqa: SIM115 - closed by `finish`
    bag = bag_class(file, "w")

    def write(topic: str, message: Any, time_ns: int, _sequence: int) -> None:
        bag.write(topic, message, convert.time(time_ns))

    def finish() -> None:
        with file:
            bag.close()

    return _recorder(write, finish)


def record_mcap(path: str | os.PathLike[str], *, ends_on_error: bool = False) -> MessageRecorder:
    """Creates a recorder of an MCAP file with ROS 1 messages; an existing file is overwritten.

    Args:
        path: The file.
        ends_on_error: See `MessageRecorder`.

    Raises:
        FlatlandError: A required package is not installed.
        OSError: The file cannot be created.
    """
    require("tf2_msgs.msg", "MCAP files need")  # Transforms are recorded in any case.
    writer_module = require("mcap_ros1.writer", "MCAP files need")
    file = Path(path).open("wb")  # noqa: SIM115 - closed by `finish`
    writer = writer_module.Writer(file, chunk_size=_CHUNK_SIZE)

    def write(topic: str, message: Any, time_ns: int, sequence: int) -> None:
        writer.write_message(topic, message, time_ns, time_ns, sequence)

    def finish() -> None:
        with file:
            writer.finish()

    return _recorder(write, finish, ends_on_error=ends_on_error)
