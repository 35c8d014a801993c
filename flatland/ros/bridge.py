"""Connects a world to ROS: outputs to publishers, commands to subscribers, time and transforms."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import Any

import rospy
from rosgraph_msgs.msg import Clock
from rospy import rostime
from tf2_msgs.msg import TFMessage

from flatland.plugin_api.plugin import FlatlandPlugin
from flatland.plugin_api.ports import Command, Output
from flatland.ros.adapters import convert, find_adapter, transform
from flatland.ros.plugin_ros import PluginRos
from flatland.ros.publisher import Publisher
from flatland.ros.registrar import Registrar
from flatland.ros.transport.subscriber import Subscriber
from flatland.runtime.observer import WorldObserver
from flatland.values import Transform
from flatland.world import World

_LOG = logging.getLogger("flatland")

TF_QUEUE_SIZE = 100  # messages; a step sends one, and a lost one is a gap in a transform


class Bridge(WorldObserver):
    """Shows one world on ROS; give it to `World.from_yaml` as an observer.

    Made after `rospy.init_node`. The node's own ROS time is set from here at each step: it does
    not subscribe to the clock that it publishes.
    """

    def __init__(self, registrar: Registrar) -> None:
        """Advertises the clock and the transforms, at time 0.

        Args:
            registrar: Talks to the ROS master.
        """
        self._registrar = registrar
        self._world: World | None = None
        self._closed = False
        self._outputs: dict[Output[Any], tuple[Publisher, Callable[[], None]]] = {}
        self._commands: dict[Command[Any], Subscriber] = {}
        self._clock = Publisher(registrar, "/clock", Clock)
        self._clock_message = Clock()
        self._tf = Publisher(registrar, "/tf", TFMessage, queue_size=TF_QUEUE_SIZE)
        _set_ros_time(rospy.Time(0))

    def close(self) -> None:
        """Leaves topics alone from now on: rospy ends all of them at once at shutdown."""
        self._closed = True

    def attached(self, world: World) -> None:
        """Stores the world, which carries out what arrives from ROS."""
        self._world = world

    # -- time and transforms ---------------------------------------------------------------

    def time_advanced(self, time_ns: int) -> None:
        """Publishes `/clock`."""
        time = convert.time(time_ns, rospy.Time)
        _set_ros_time(time)
        if self._clock.connected:
            self._clock_message.clock = time
            self._clock.publish(self._clock_message)

    @property
    def wants_transforms(self) -> bool:
        """Whether anybody subscribes to `/tf`."""
        return self._tf.connected

    def transforms_sent(self, transforms: Sequence[Transform]) -> None:
        """Publishes all transforms of a step in one `/tf` message."""
        self._tf.publish(TFMessage([transform.to_message(each) for each in transforms]))

    # -- ports -----------------------------------------------------------------------------

    def output_opened(self, output: Output[Any]) -> None:
        """Advertises the topic of an output."""
        adapter = find_adapter(output.value_type)
        if adapter is None or adapter.to_message is None:
            self._warn_of_missing_adapter("output", output)
            return
        publisher = Publisher(
            self._registrar,
            output.name,
            adapter.message_type,
            on_connection=lambda connected: (output.want if connected else output.unwant)(self),
            owner=output.owners[0],
        )
        to_message = adapter.to_message

        def publish(value: Any) -> None:
            if publisher.connected:
                publisher.publish(to_message(value))

        self._outputs[output] = publisher, output.subscribe(publish, wants=False)

    def output_closed(self, output: Output[Any]) -> None:
        """Ends the topic of an output."""
        publisher, unsubscribe = self._outputs.pop(output, (None, None))
        if publisher is not None and unsubscribe is not None:
            unsubscribe()
            if not self._closed:
                publisher.close()

    def command_opened(self, command: Command[Any]) -> None:
        """Subscribes to the topic of a command."""
        adapter = find_adapter(command.value_type)
        if adapter is None or adapter.from_message is None:
            self._warn_of_missing_adapter("command", command)
            return
        from_message = adapter.from_message

        def receive(message: Any) -> None:
            value = from_message(message)
            self._post(lambda: None if command.closed else command.set(value))

        self._commands[command] = Subscriber(
            self._registrar, command.name, adapter.message_type, receive, owner=command.owner
        )

    def command_closed(self, command: Command[Any]) -> None:
        """Ends the subscription of a command."""
        subscriber = self._commands.pop(command, None)
        if subscriber is not None and not self._closed:
            subscriber.close()

    def _warn_of_missing_adapter(self, kind: str, port: Output[Any] | Command[Any]) -> None:
        _LOG.warning(
            '%s "%s" is not connected to ROS: no adapter for %s is registered '
            "(flatland.ros.adapters.register_adapter)",
            kind,
            port.topic,
            port.value_type.__name__,
        )

    # -- plugins ---------------------------------------------------------------------------

    def plugin_ros(self, plugin: FlatlandPlugin) -> PluginRos:
        """Returns access to ROS for one plugin."""
        return PluginRos(plugin, self._registrar, self._post, lambda: self._closed)

    def _post(self, action: Callable[[], object]) -> Future[Any]:
        """Runs an action between two steps, in order of arrival."""
        if self._world is None:
            raise RuntimeError("the bridge is not attached to a world")
        return self._world.post(action)


def _set_ros_time(time: rospy.Time) -> None:
    """Sets what `rospy.get_rostime` returns, and wakes who waits for it.

    As rospy does it when a `/clock` arrives, but without a copy and a deprecation warning that
    nobody sees: both cost more than a step of the physics.
    """
    rostime._rostime_current = time
    changed = rostime.get_rostime_cond()
    with changed:
        changed.notify_all()
