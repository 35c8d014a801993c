"""MCAP files with the messages of a world, as rosbag2 writes and reads them."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from typing import Any, Final

from rclpy.serialization import serialize_message

from flatland.errors import FlatlandError
from flatland.extras import require
from flatland.node.message_recorder import MessageRecorder
from flatland.ros2.adapters import find_adapter
from flatland.ros2.message_types import message_class, type_name

_CHUNK_SIZE: Final = 256 * 1024  # bytes of a file; what is lost if the process is killed
_SEPARATOR: Final = "=" * 80
_TYPE: Final = re.compile(r"[a-z][a-z0-9_]*/[A-Za-z0-9]+")


def record_mcap(path: str | os.PathLike[str], *, ends_on_error: bool = False) -> MessageRecorder:
    """Creates a recorder of an MCAP file with ROS 2 messages; an existing file is overwritten.

    Args:
        path: The file.
        ends_on_error: See `MessageRecorder`.

    Raises:
        FlatlandError: A required package is not installed.
        OSError: The file cannot be created.
    """
    writer_module = require("mcap.writer", "MCAP files need")
    file = Path(path).open("wb")  # noqa: SIM115 - closed by `finish`
    writer = writer_module.Writer(file, chunk_size=_CHUNK_SIZE)
    writer.start(profile="ros2", library="flatland")
    schemas: dict[type[Any], int] = {}
    channels: dict[str, int] = {}

    def write(topic: str, kind: type[Any], data: bytes, time_ns: int, number: int) -> None:
        if kind not in schemas:
            text = definition(kind).encode()
            schemas[kind] = writer.register_schema(type_name(kind), "ros2msg", text)
        if topic not in channels:
            channels[topic] = writer.register_channel(topic, "cdr", schemas[kind])
        writer.add_message(channels[topic], time_ns, data, time_ns, number)

    def finish() -> None:
        with file:
            writer.finish()

    return MessageRecorder(
        find_adapter, serialize_message, write, finish, ends_on_error=ends_on_error
    )


def definition(message_type: type[Any]) -> str:
    """Returns the definition of a message, followed by those of all messages in its fields.

    Raises:
        FlatlandError: A definition is not installed.
    """
    texts: dict[str, str] = {}

    def add(found: type[Any]) -> None:
        package, _, name = type_name(found).split("/")
        if f"{package}/{name}" in texts:
            return
        texts[f"{package}/{name}"] = _file_of(package, name).read_text()
        for field_type in found.get_fields_and_field_types().values():
            for inner in _TYPE.findall(field_type):
                add(message_class(inner))

    add(message_type)
    first, *others = texts.items()
    return "\n".join((first[1], *(f"{_SEPARATOR}\nMSG: {name}\n{text}" for name, text in others)))


def _file_of(package: str, name: str) -> Path:
    """Returns the file of a definition, in one of the prefixes of ROS."""
    prefixes = [*os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep), sys.prefix]
    for prefix in filter(None, prefixes):
        file = Path(prefix, "share", package, "msg", f"{name}.msg")
        if file.is_file():
            return file
    raise FlatlandError(f"the definition of the message {package}/{name} is not installed")
