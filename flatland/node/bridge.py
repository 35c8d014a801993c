"""Connects a world to ROS: outputs to publishers, commands to subscribers, time and transforms."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import Any

from flatland.errors import PLUGIN_FAULTS
from flatland.node.clock import NodeClock
from flatland.node.plugin_ros import PluginRos
from flatland.node.transport import Connection, Publisher, Transport
from flatland.node.values import Transforms
from flatland.plugin_api.plugin import FlatlandPlugin
from flatland.plugin_api.ports import Command, Output
from flatland.runtime.observer import WorldObserver
from flatland.values import Transform
from flatland.world import World

_LOG = logging.getLogger("flatland")

TF_QUEUE_SIZE = 100  # messages, one per step; a dropped one is a gap in its transforms


class Bridge(WorldObserver):
    """Connects one world to ROS; passed to `World.from_yaml` as an observer.

    In each step, `/clock` is published first, then `/tf`,
    then the values that were emitted in the step, in their order: no stamp is in the future, and
    the transforms of a stamp precede the messages with that stamp.
    """

    def __init__(self, transport: Transport, clock: NodeClock) -> None:
        """Advertises the transforms.

        Args:
            transport: Publishes and subscribes.
            clock: Notified of the simulated time.
        """
        self._transport = transport
        self._clock = clock
        self._world: World | None = None
        self._closed = False
        self._outputs: dict[Output[Any], _OutputTopic] = {}
        self._commands: dict[Command[Any], Connection] = {}
        self._tf, self._convert_transforms = transport.values(
            "/tf", Transforms, queue_size=TF_QUEUE_SIZE
        )
        self._in_step = False
        # Messages that wait for the end of the step, with the functions that publish them.
        self._held: list[tuple[Callable[[Any], object], Any]] = []

    def close(self) -> None:
        """Stops closing single topics, because the transport is about to close all of them."""
        self._closed = True

    def attached(self, world: World) -> None:
        """Stores the world, which runs the requests and commands from ROS."""
        self._world = world

    # -- one step --------------------------------------------------------------------------

    def step_started(self) -> None:
        """Holds all messages of outputs until the end of the step."""
        self._in_step = True
        if self._world is not None:
            self._clock.step_started(self._world.timekeeper.sim_time_ns)

    def time_advanced(self, time_ns: int) -> None:
        """Notifies the clock."""
        self._clock.time_advanced(time_ns)

    @property
    def watches_steps(self) -> bool:
        """Whether the clock needs each step."""
        return self._clock.watches_steps

    @property
    def watches_time(self) -> bool:
        """Whether the clock publishes from a thread of its own."""
        return self._clock.watches_time

    @property
    def wants_transforms(self) -> bool:
        """Whether `/tf` has subscribers."""
        return self._tf.connected

    def transforms_sent(self, transforms: Sequence[Transform]) -> None:
        """Publishes all transforms of a step in one `/tf` message."""
        self._tf.publish(self._convert_transforms(Transforms(transforms)))

    def step_finished(self) -> None:
        """Publishes the messages of the step."""
        self._in_step = False
        if self._held:
            self._publish_held()

    def _publish_held(self) -> None:
        held, self._held = self._held, []
        for publish, message in held:
            publish(message)

    def _send(self, publish: Callable[[Any], object], message: Any) -> None:
        """Publishes a message of an output: at the end of the step, or at once between two steps.

        Args:
            publish: Publishes the message; does not raise if the world handles exceptions.
            message: The message.
        """
        if not self._in_step or self._world is None:
            publish(message)
            return
        costs = self._world.plugin_host.costs
        self._held.append((publish if costs is None else costs.later(publish), message))

    # -- ports -----------------------------------------------------------------------------

    def output_opened(self, output: Output[Any]) -> None:
        """Advertises the topic of an output."""
        adapter = self._transport.find_adapter(output.value_type)
        if adapter is None or adapter.publishable is None:
            self._warn_of_missing_adapter("output", output)
            return
        publisher = self._transport.advertise(
            output.name,
            adapter.message_type,
            on_connection=lambda connected: (output.want if connected else output.unwant)(self),
            owner=output.owners[0],
        )
        convert = adapter.publishable
        self._outputs[output] = _OutputTopic(output, publisher, convert, self._send)

    def output_closed(self, output: Output[Any]) -> None:
        """Closes the topic of an output."""
        topic = self._outputs.pop(output, None)
        if topic is not None:
            topic.unsubscribe()
            # A model whose pose is invalid is removed within a step.
            self._publish_held()
            if not self._closed:
                topic.publisher.close()

    def subscribed(self, output: Output[Any]) -> bool:
        """Returns whether the topic of an output has subscribers."""
        topic = self._outputs.get(output)
        return topic is not None and topic.publisher.connected

    def command_opened(self, command: Command[Any]) -> None:
        """Subscribes to the topic of a command."""
        adapter = self._transport.find_adapter(command.value_type)
        if adapter is None or adapter.from_message is None:
            self._warn_of_missing_adapter("command", command)
            return
        from_message = adapter.from_message

        def receive(message: Any) -> None:
            self.command_received(command, from_message(message))

        self._commands[command] = self._transport.subscribe(
            command.name, adapter.message_type, receive, owner=command.owner
        )

    def command_received(self, command: Command[Any], value: Any) -> None:
        """Sets a command between two steps; called in any thread."""
        self._post(lambda: _set_command(command, value))

    def command_closed(self, command: Command[Any]) -> None:
        """Closes the subscription of a command."""
        subscriber = self._commands.pop(command, None)
        if subscriber is not None and not self._closed:
            subscriber.close()

    def _warn_of_missing_adapter(self, kind: str, port: Output[Any] | Command[Any]) -> None:
        _LOG.warning(
            '%s "%s" is not connected to ROS: no adapter for %s is registered (%s)',
            kind,
            port.topic,
            port.value_type.__name__,
            self._transport.REGISTER_ADAPTER,
        )

    # -- plugins ---------------------------------------------------------------------------

    def plugin_ros(self, plugin: FlatlandPlugin) -> PluginRos:
        """Returns access to ROS for one plugin."""
        if self._world is None:
            raise RuntimeError("the bridge is not attached to a world")
        return PluginRos(
            plugin, self._transport, self._world.requests, self._post, lambda: self._closed
        )

    def _post(self, action: Callable[[], object]) -> Future[Any]:
        """Runs an action between two steps, in order of arrival."""
        if self._world is None:
            raise RuntimeError("the bridge is not attached to a world")
        return self._world.post(action)


def _set_command(command: Command[Any], value: Any) -> None:
    """Sets a command; the function `accept` of its plugin may raise."""
    if not command.closed:
        try:
            command.set(value)
        except PLUGIN_FAULTS:
            _LOG.exception('%s: command "%s" raised', command.owner, command.topic)


class _OutputTopic:
    """Publishes the values of an output.

    Attributes:
        publisher: Publisher of the topic.
        unsubscribe: Ends the subscription of the output.
    """

    def __init__(
        self,
        output: Output[Any],
        publisher: Publisher,
        convert: Callable[[Any], Any],
        send: Callable[[Callable[[Any], None], Any], None],
    ) -> None:
        self.publisher = publisher
        self._output = output
        self._send = send
        self._convert = convert
        # The subscribers of the topic decide whether the output is wanted, see `on_connection`.
        self.unsubscribe = output.subscribe(self, wants=False)

    def __call__(self, value: Any) -> None:
        if self.publisher.connected:
            # Converted now, because the value may change until the end of the step.
            self._send(self._publish, self._convert(value))

    def _publish(self, message: Any) -> None:
        try:
            self.publisher.publish(message)
        except PLUGIN_FAULTS as error:
            self._output.report_fault(self, error)

    def __repr__(self) -> str:
        """Returns the name of the subscriber in the log."""
        adapter = getattr(self._convert, "__qualname__", repr(self._convert))
        module = getattr(self._convert, "__module__", "")
        return f'ROS topic "{self.publisher.topic}" (adapter {module}.{adapter})'
