"""Recording of the outputs and transforms of a world as serialized messages."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from typing import Any

from flatland.node.stamps import clock_time
from flatland.node.transport import Adapter
from flatland.node.values import Transforms
from flatland.plugin_api.ports import Output
from flatland.runtime.observer import WorldObserver
from flatland.values import Transform
from flatland.world import World

_LOG = logging.getLogger("flatland")

Write = Callable[[str, type[Any], bytes, int, int], None]
"""Writes a message, given its topic, its class, its bytes, its time on `/clock` [ns], and its
number on the topic, from 0; messages of transforms have the number 0."""


class MessageRecorder(WorldObserver):
    """Writes all outputs and transforms of a world to a file.

    Passed to `World.from_yaml` as an observer, or to a loaded world by `observe`. `/clock` is not
    recorded; players publish it from the times of the messages.

    Attributes:
        messages: Number of messages written.
        topics: Topics with at least one message.
        error: Why the recording has ended before its end; empty if it has not.
    """

    def __init__(
        self,
        find_adapter: Callable[[type[Any]], Adapter | None],
        serialize: Callable[[Any], bytes],
        write: Write,
        finish: Callable[[], object],
        *,
        ends_on_error: bool = False,
    ) -> None:
        """Creates a recorder.

        Args:
            find_adapter: Returns the adapter of a type of values.
            serialize: Returns the bytes of a message.
            write: Writes a message to the file.
            finish: Completes and closes the file.
            ends_on_error: Whether an error of the file, such as a full disk, ends the recording
                with a logged error; otherwise, it is raised.
        """
        self._find_adapter, self._serialize = find_adapter, serialize
        self._write_message, self._finish = write, finish
        self._ends_on_error = ends_on_error
        self._is_closed = False
        self._world: World | None = None
        self._unsubscribe: dict[Output[Any], Callable[[], None]] = {}
        self._write_transforms: Callable[[Any, int], None] | None = None
        self.messages = 0
        self.topics: set[str] = set()
        self.error = ""

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
        adapter = self._find_adapter(output.value_type)
        pack = None if adapter is None else self._serializer(adapter)
        if adapter is None or pack is None:
            _LOG.warning(
                'output "%s" is not recorded: no adapter for %s is registered',
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
            adapter = self._find_adapter(Transforms)
            pack = None if adapter is None else self._serializer(adapter)
            if adapter is None or pack is None:
                raise LookupError("no adapter publishes transforms")
            self._write_transforms = self._writer("/tf", adapter.message_type, pack, numbered=False)
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
        count = 0

        def write(value: Any, time_ns: int) -> None:
            nonlocal count
            data = pack(value)
            if not self.error:
                number = count
                self._attempt(
                    lambda: self._write_message(
                        topic, message_type, data, clock_time(time_ns), number
                    )
                )
                self.messages += not self.error
                self.topics.add(topic)
            count += numbered

        return write

    def _serializer(self, adapter: Adapter) -> Callable[[Any], bytes] | None:
        """Returns the function that serializes values, None if they are only received."""
        to_message = adapter.to_message
        if adapter.serialize is not None or to_message is None:
            return adapter.serialize
        return lambda value: self._serialize(to_message(value))

    def _attempt(self, action: Callable[[], object]) -> None:
        try:
            action()
        except OSError as error:
            if not self._ends_on_error:
                raise
            if not self.error:
                self.error = error.strerror or str(error)
                _LOG.error("the recording of messages ends: %s", error)
