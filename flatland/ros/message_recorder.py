"""Recording of the outputs and transforms of a world as ROS messages, without a ROS master."""

from __future__ import annotations

import logging
import os
import warnings
from abc import abstractmethod
from collections.abc import Callable, Sequence
from typing import Any

from tf2_msgs.msg import TFMessage

from flatland.errors import FlatlandError
from flatland.plugin_api.ports import Output
from flatland.ros.adapters import find_adapter, transform
from flatland.runtime.observer import WorldObserver
from flatland.values import Transform
from flatland.world import World

_LOG = logging.getLogger("flatland")


class MessageRecorder(WorldObserver):
    """Writes all outputs and transforms of a world to a file.

    Passed to `World.from_yaml` as an observer, or to a loaded world by `observe`. `/clock` is not
    recorded; players publish it from the times of the messages.

    Attributes:
        messages: Number of messages written.
        topics: Topics with at least one message.
    """

    def __init__(self, ends_on_error: bool = False) -> None:
        """Creates a recorder.

        Args:
            ends_on_error: Whether an error of the file, such as a full disk, ends the recording
                with a logged error; otherwise, it is raised.
        """
        self._ends_on_error = ends_on_error
        self._has_failed = False
        self._world: World | None = None
        self._unsubscribe: dict[Output[Any], Callable[[], None]] = {}
        self.messages = 0
        self.topics: set[str] = set()

    @abstractmethod
    def write_message(self, topic: str, message: Any, time_ns: int, sequence: int) -> None:
        """Writes a message.

        Args:
            topic: The topic.
            message: The ROS message.
            time_ns: Simulated time [ns].
            sequence: Number of the message on its topic, from 0.

        Raises:
            OSError: The file cannot be written.
        """

    @abstractmethod
    def finish(self) -> None:
        """Completes and closes the file; further calls have no effect.

        Raises:
            OSError: The file cannot be written.
        """

    def close(self) -> None:
        """Ends the recording; further calls have no effect."""
        for unsubscribe in self._unsubscribe.values():
            unsubscribe()
        self._unsubscribe.clear()
        self._attempt(self.finish)

    def observe(self, world: World) -> None:
        """Records a world that is already loaded, from now on."""
        world.add_observer(self)
        for output in world.ports.outputs.values():
            self.output_opened(output)

    def attached(self, world: World) -> None:
        """Stores the world, whose time is that of the messages."""
        self._world = world

    def output_opened(self, output: Output[Any]) -> None:
        """Records the values of an output."""
        adapter = find_adapter(output.value_type)
        if adapter is None or adapter.to_message is None:
            _LOG.warning(
                'output "%s" is not recorded: no adapter for %s is registered '
                "(flatland.ros.adapters.register_adapter)",
                output.topic,
                output.value_type.__name__,
            )
            return
        to_message, count = adapter.to_message, 0

        def write(value: Any) -> None:
            nonlocal count
            message = to_message(value)
            if hasattr(message, "header"):
                message.header.seq = count
            self._write(output.topic, message, None, count)
            count += 1

        self._unsubscribe[output] = output.subscribe(write)

    def output_closed(self, output: Output[Any]) -> None:
        """Ends the recording of an output."""
        unsubscribe = self._unsubscribe.pop(output, None)
        if unsubscribe is not None:
            unsubscribe()

    def transforms_sent(self, transforms: Sequence[Transform]) -> None:
        """Records the transforms of a step in one message, at the time of their stamps."""
        message = TFMessage([transform.to_message(each) for each in transforms])
        self._write("/tf", message, max(each.stamp for each in transforms), 0)

    def _write(self, topic: str, message: Any, time_ns: int | None, sequence: int) -> None:
        if time_ns is None:
            time_ns = self._world.timekeeper.sim_time_ns if self._world is not None else 0
        if self._has_failed:
            return
        with warnings.catch_warnings():
            # genpy serializes arrays with a deprecated method of numpy.
            warnings.simplefilter("ignore", DeprecationWarning)
            self._attempt(lambda: self.write_message(topic, message, time_ns, sequence))
        self.messages += 1
        self.topics.add(topic)

    def _attempt(self, action: Callable[[], None]) -> None:
        try:
            action()
        except OSError as error:
            if not self._ends_on_error:
                raise
            if not self._has_failed:
                self._has_failed = True
                _LOG.error("the recording of messages ends: %s", error)


def create_mcap_recorder(
    path: str | os.PathLike[str], ends_on_error: bool = False
) -> MessageRecorder:
    """Creates a recorder that writes an MCAP file with ROS 1 messages.

    Args:
        path: The file; an existing one is overwritten.
        ends_on_error: See `MessageRecorder`.

    Raises:
        FlatlandError: A required package is not installed.
        OSError: The file cannot be created.
    """
    try:
        from flatland.ros.mcap import McapRecorder
    except ImportError as error:
        raise FlatlandError(
            f"MCAP files need packages of PyPI ({error}): pip install mcap mcap-ros1-support"
        ) from error
    return McapRecorder(path, ends_on_error)
