"""Recording of the outputs and transforms of a world as ROS messages, without a ROS master."""

from __future__ import annotations

import logging
import os
import struct
from collections.abc import Callable, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, Final

from flatland.extras import require
from flatland.node.transport import Adapter
from flatland.node.values import Transforms
from flatland.plugin_api.ports import Output
from flatland.ros.adapters import convert, find_adapter
from flatland.runtime.observer import WorldObserver
from flatland.values import Transform
from flatland.world import World

_LOG = logging.getLogger("flatland")

_SEQUENCE: Final = struct.Struct("<I")
_FIRST_TIME: Final = 1  # ns; rosbag play ignores messages at time 0
_CHUNK_SIZE: Final = 256 * 1024  # bytes of an MCAP file; what is lost if the process is killed


Write = Callable[[str, Any, int, int], None]
"""Writes a message, given its topic, the ROS message, the simulated time [ns], and its number on
the topic, from 0."""


class MessageRecorder(WorldObserver):
    """Writes all outputs and transforms of a world to a file.

    Passed to `World.from_yaml` as an observer, or to a loaded world by `observe`. `/clock` is not
    recorded; players publish it from the times of the messages.

    Attributes:
        messages: Number of messages written.
        topics: Topics with at least one message.
    """

    def __init__(
        self, write: Write, finish: Callable[[], object], *, ends_on_error: bool = False
    ) -> None:
        """Creates a recorder.

        Args:
            write: Writes a message to the file.
            finish: Completes and closes the file.
            ends_on_error: Whether an error of the file, such as a full disk, ends the recording
                with a logged error; otherwise, it is raised.
        """
        self._write_message, self._finish = write, finish
        self._ends_on_error = ends_on_error
        self._is_closed = False
        self._has_failed = False
        self._world: World | None = None
        self._unsubscribe: dict[Output[Any], Callable[[], None]] = {}
        self._write_transforms: Callable[[Any, int], None] | None = None
        self.messages = 0
        self.topics: set[str] = set()

    def close(self) -> None:
        """Ends the recording; further calls have no effect."""
        for unsubscribe in self._unsubscribe.values():
            unsubscribe()
        self._unsubscribe.clear()
        if not self._is_closed:
            self._is_closed = True
            self._attempt(self._finish)

    def observe(self, world: World) -> None:
        """Records a world that is already loaded, from now on."""
        world.add_observer(self)
        for output in world.ports.outputs.values():
            self.output_opened(output)

    def attached(self, world: World) -> None:
        """Stores the world, whose time is recorded with the messages."""
        self._world = world

    def output_opened(self, output: Output[Any]) -> None:
        """Records the values of an output."""
        adapter = find_adapter(output.value_type)
        pack = None if adapter is None else _serializer(adapter)
        if adapter is None or pack is None:
            _LOG.warning(
                'output "%s" is not recorded: no adapter for %s is registered '
                "(flatland.ros.adapters.register_adapter)",
                output.topic,
                output.value_type.__name__,
            )
            return
        write = self._writer(output.topic, adapter.message_type, pack)
        self._unsubscribe[output] = output.subscribe(lambda value: write(value, self._now()))

    def output_closed(self, output: Output[Any]) -> None:
        """Ends the recording of an output."""
        unsubscribe = self._unsubscribe.pop(output, None)
        if unsubscribe is not None:
            unsubscribe()

    def transforms_sent(self, transforms: Sequence[Transform]) -> None:
        """Records the transforms of a step in one message, at the time of their stamps."""
        if self._write_transforms is None:
            adapter = find_adapter(Transforms)
            assert adapter is not None and adapter.serialize is not None  # an included one
            self._write_transforms = self._writer(
                "/tf", adapter.message_type, adapter.serialize, numbered=False
            )
        self._write_transforms(Transforms(transforms), max(each.stamp for each in transforms))

    def _now(self) -> int:
        return self._world.timekeeper.sim_time_ns if self._world is not None else 0

    def _writer(
        self,
        topic: str,
        message_type: type[Any],
        pack: Callable[[Any], bytes],
        *,
        numbered: bool = True,
    ) -> Callable[[Any, int], None]:
        """Returns the function that records values of a topic at simulated times [ns]."""
        has_header = bool(message_type._has_header)
        count = 0

        class Recorded(message_type):  # type: ignore[misc]
            """A message that is serialized already."""

            def __init__(self, data: bytes) -> None:
                self._data = data

            def serialize(self, buff: BytesIO) -> None:
                buff.write(self._data)

        def write(value: Any, time_ns: int) -> None:
            nonlocal count
            data = pack(value)
            if has_header:
                data = _SEQUENCE.pack(count) + data[_SEQUENCE.size :]
            if not self._has_failed:
                message, number = Recorded(data), count
                self._attempt(lambda: self._write_message(topic, message, time_ns, number))
                self.messages += 1
                self.topics.add(topic)
            count += numbered

        return write

    def _attempt(self, action: Callable[[], object]) -> None:
        try:
            action()
        except OSError as error:
            if not self._ends_on_error:
                raise
            if not self._has_failed:
                self._has_failed = True
                _LOG.error("the recording of messages ends: %s", error)


def _serializer(adapter: Adapter) -> Callable[[Any], bytes] | None:
    """Returns the function that serializes values, None if they are only received."""
    to_message = adapter.to_message
    if adapter.serialize is not None or to_message is None:
        return adapter.serialize

    def serialize(value: Any) -> bytes:
        buffer = BytesIO()
        to_message(value).serialize(buffer)
        return buffer.getvalue()

    return serialize


def record_bag(path: str | os.PathLike[str]) -> MessageRecorder:
    """Creates a recorder of a bag with simulated stamps; an existing file is overwritten.

    Raises:
        FlatlandError: rosbag is not installed.
        OSError: The file cannot be created.
    """
    bag = require("rosbag", "bags need").Bag(os.fspath(path), "w")

    def write(topic: str, message: Any, time_ns: int, _sequence: int) -> None:
        bag.write(topic, message, convert.time(max(time_ns, _FIRST_TIME)))

    return MessageRecorder(write, bag.close)


def record_mcap(path: str | os.PathLike[str], *, ends_on_error: bool = False) -> MessageRecorder:
    """Creates a recorder of an MCAP file with ROS 1 messages; an existing file is overwritten.

    Args:
        path: The file.
        ends_on_error: See `MessageRecorder`.

    Raises:
        FlatlandError: A required package is not installed.
        OSError: The file cannot be created.
    """
    writer_module = require("mcap_ros1.writer", "MCAP files need")
    file = Path(path).open("wb")  # noqa: SIM115 - closed by `finish`
    writer = writer_module.Writer(file, chunk_size=_CHUNK_SIZE)

    def write(topic: str, message: Any, time_ns: int, sequence: int) -> None:
        writer.write_message(topic, message, time_ns, time_ns, sequence)

    def finish() -> None:
        with file:
            writer.finish()

    return MessageRecorder(write, finish, ends_on_error=ends_on_error)
