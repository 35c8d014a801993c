"""Recording of a world into a bag, without a ROS master."""

from __future__ import annotations

import logging
import os
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import rosbag
from genpy import Time
from tf2_msgs.msg import TFMessage

from flatland.plugin_api.ports import Output
from flatland.ros.adapters import convert, find_adapter, transform
from flatland.runtime.observer import WorldObserver
from flatland.values import Transform
from flatland.world import World

_LOG = logging.getLogger("flatland")

_FIRST_TIME = 1  # ns; rosbag play ignores messages at time 0


class BagRecorder(WorldObserver):
    """Writes all outputs and transforms of a world to a bag, with simulated stamps.

    Passed to `World.from_yaml` as an observer. `/clock` is not recorded: `rosbag play --clock`
    publishes it from the times of the messages.

    Attributes:
        messages: Number of messages written.
        topics: Topics with at least one message.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """Creates the bag, overwriting an existing file.

        Raises:
            OSError: The file cannot be written.
        """
        self._bag = rosbag.Bag(os.fspath(path), "w")
        self._world: World | None = None
        self._unsubscribe: dict[Output[Any], Callable[[], None]] = {}
        self.messages = 0
        self.topics: set[str] = set()

    def close(self) -> None:
        """Writes the index and closes the file; further calls have no effect."""
        for unsubscribe in self._unsubscribe.values():
            unsubscribe()
        self._unsubscribe.clear()
        self._bag.close()

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
            count += 1
            self._write(output.topic, message)

        self._unsubscribe[output] = output.subscribe(write)

    def output_closed(self, output: Output[Any]) -> None:
        """Ends the recording of an output."""
        unsubscribe = self._unsubscribe.pop(output, None)
        if unsubscribe is not None:
            unsubscribe()

    def transforms_sent(self, transforms: Sequence[Transform]) -> None:
        """Records the transforms of a step in one message, at the time of their stamps."""
        message = TFMessage([transform.to_message(each) for each in transforms])
        self._write("/tf", message, max(each.stamp for each in transforms))

    def _write(self, topic: str, message: Any, time_ns: int | None = None) -> None:
        if time_ns is None:
            time_ns = self._world.timekeeper.sim_time_ns if self._world is not None else 0
        with warnings.catch_warnings():
            # genpy serializes arrays with a deprecated method of numpy.
            warnings.simplefilter("ignore", DeprecationWarning)
            self._bag.write(topic, message, convert.time(max(time_ns, _FIRST_TIME), Time))
        self.messages += 1
        self.topics.add(topic)
