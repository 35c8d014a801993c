"""Ports: where plugins hand over values and take commands, without knowing who listens.

A plugin declares an `Output` or a `Command`. Whoever connects a world to the outside (the ROS
bridge, a test, a notebook) finds them by their resolved topic in the world's `PortRegistry`.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Callable, Hashable
from typing import Any, Generic, Protocol, TypeVar

from flatland.errors import PLUGIN_FAULTS, FlatlandError, WorldError

T = TypeVar("T")
SubscriberFault = Callable[["Output[Any]", Callable[[Any], None], BaseException], None]

# ROS graph names as its clients check them, less the private ~ which a model has no use for.
_LEGAL_NAME = re.compile(r"(/|[A-Za-z])(\w|(?<!/)/)*(?<!/)", re.ASCII)


def is_legal_namespace(namespace: str) -> bool:
    """Tells whether a namespace is empty or a legal ROS graph name; a `/` at its end is allowed."""
    bare = namespace.removesuffix("/")
    return not bare or _LEGAL_NAME.fullmatch(bare) is not None


def resolve_topic(topic: str, namespace: str = "") -> str:
    """Puts a topic under a namespace.

    Args:
        topic: As written; a leading `/` makes it global.
        namespace: Of the model, may be empty.

    Returns:
        `/topic` when the topic is global, else `namespace/topic`, which starts with a slash only
        if the namespace does, so that a layer above may put a namespace of its own in front.

    Raises:
        ValueError: The topic is no legal ROS name.
    """
    if _LEGAL_NAME.fullmatch(topic) is None:
        raise ValueError(
            f'"{topic}" is not a legal topic name: it must start with a letter or "/" and hold '
            'only letters, digits, "_" and "/"'
        )
    if topic.startswith("/"):
        return topic
    namespace = namespace.removesuffix("/")
    return f"{namespace}/{topic}" if namespace else topic


class Output(Generic[T]):
    """A stream of values that a plugin emits.

    Attributes:
        name: Topic under the model's namespace, with a leading `/` only if it is global.
        topic: The same with a leading `/`: the key in the registry.
        value_type: Type of the values.
        latest: The last value emitted, None before the first.
    """

    __slots__ = (
        "_lock",
        "_on_fault",
        "_subscribers",
        "_wanters",
        "closed",
        "latest",
        "name",
        "topic",
        "value_type",
    )

    def __init__(
        self, name: str, value_type: type[T], on_fault: SubscriberFault | None = None
    ) -> None:
        """Creates an output without listeners.

        Args:
            name: Topic under the namespace of the model, with a leading `/` only if it is global.
            value_type: Type of the values.
            on_fault: Called with what a subscriber raises, while it is handled, so that the error
                does not reach the plugin that emits; None lets it.
        """
        self.name = name
        self.topic = "/" + name.lstrip("/")
        self.value_type = value_type
        self.latest: T | None = None
        self.closed = False
        self._on_fault = on_fault
        # Both are replaced, never changed, so that other threads may read them at any time; the
        # lock keeps two replacements apart.
        self._lock = threading.Lock()
        self._subscribers: tuple[tuple[object, Callable[[T], None]], ...] = ()
        self._wanters: frozenset[Hashable] = frozenset()

    @property
    def wanted(self) -> bool:
        """Whether anybody listens, so that computing a value is worth it."""
        return bool(self._wanters)

    def want(self, who: Hashable) -> None:
        """Marks the output as wanted on behalf of `who`; safe from any thread."""
        with self._lock:
            self._wanters = self._wanters | {who}

    def unwant(self, who: Hashable) -> None:
        """Reverts `want` for `who`; safe from any thread."""
        with self._lock:
            self._wanters = self._wanters - {who}

    def emit(self, value: T) -> None:
        """Stores a value as `latest` and passes it to all subscribers."""
        self.latest = value
        for _, callback in self._subscribers:
            try:
                callback(value)
            except PLUGIN_FAULTS as error:
                if self._on_fault is None:
                    raise
                self._on_fault(self, callback, error)

    def subscribe(self, callback: Callable[[T], None], *, wants: bool = True) -> Callable[[], None]:
        """Subscribes a function to all further values; safe from any thread.

        Args:
            callback: Called with each value, in the thread that steps the world. An exception does
                not affect the plugin that emits; `World` documents where it is raised or logged.
            wants: Whether the subscription makes the output wanted; False for a subscriber that
                calls `want` and `unwant` itself.

        Returns:
            A function that ends this subscription; a second call has no effect.
        """
        token = object()
        with self._lock:
            self._subscribers = (*self._subscribers, (token, callback))
            if wants:
                self._wanters = self._wanters | {token}

        def unsubscribe() -> None:
            with self._lock:
                self._subscribers = tuple(s for s in self._subscribers if s[0] is not token)
                self._wanters = self._wanters - {token}

        return unsubscribe


class Command(Generic[T]):
    """A value that comes from outside and that a plugin reads when it likes; the last one wins.

    Attributes:
        name: Topic under the model's namespace, with a leading `/` only if it is global.
        topic: The same with a leading `/`.
        value_type: Type of the values.
        value: The last one set, or the default.
        received: How many were set.
    """

    __slots__ = ("accept", "closed", "name", "received", "topic", "value", "value_type")

    def __init__(
        self,
        name: str,
        value_type: type[T],
        default: T,
        accept: Callable[[T], bool] | None = None,
    ) -> None:
        """Makes a command that holds its default.

        Args:
            name: Resolved topic.
            value_type: Type of the values.
            default: Value before the first comes.
            accept: Asked with each value; one that it refuses leaves the last good one.
        """
        self.name = name
        self.topic = "/" + name.lstrip("/")
        self.value_type = value_type
        self.value = default
        self.received = 0
        self.closed = False
        self.accept = accept

    def set(self, value: T) -> None:
        """Takes a new value, unless the plugin's check refuses it.

        Raises:
            TypeError: The value is not of the command's type.
        """
        if not isinstance(value, self.value_type):
            raise TypeError(f"command {self.topic} takes {self.value_type.__name__}, got {value!r}")
        if self.accept is None or self.accept(value):
            self.value = value
            self.received += 1


class CommandTopic(Generic[T]):
    """All commands of one topic, set together as subscribers of one ROS topic are."""

    def __init__(self, commands: list[Command[T]]) -> None:
        """Looks at the live list of the commands of one topic."""
        self._commands = commands
        self.topic = commands[0].topic
        self.value_type = commands[0].value_type

    @property
    def value(self) -> T:
        """The value that the topic's first command holds."""
        if not self._commands:
            raise WorldError(f"command {self.topic} is gone with its model")
        return self._commands[0].value

    def set(self, value: T) -> None:
        """Sets all commands of the topic.

        Raises:
            TypeError: The value is not of the topic's type.
            WorldError: No model takes the command any more.
        """
        if not self._commands:
            raise WorldError(f"command {self.topic} is gone with its model")
        for command in self._commands:
            command.set(value)


class PortObserver(Protocol):
    """Receives notifications of ports; `flatland.runtime.observer` implements it."""

    def output_opened(self, output: Output[Any]) -> None:
        """Called before an output is added; raising refuses it."""

    def output_closed(self, output: Output[Any]) -> None:
        """Called after an output has been removed."""

    def command_opened(self, command: Command[Any]) -> None:
        """Called before a command is added; raising refuses it."""

    def command_closed(self, command: Command[Any]) -> None:
        """Called after a command has been removed."""


class PortRegistry:
    """All ports of a world by resolved topic."""

    def __init__(self, observer: PortObserver, on_fault: SubscriberFault | None = None) -> None:
        """Creates an empty registry.

        Args:
            observer: Notified when ports open and close.
            on_fault: See `Output`.
        """
        self._observer = observer
        self._on_fault = on_fault
        self._outputs: dict[str, Output[Any]] = {}
        self._owners: dict[str, int] = {}
        self._commands: dict[str, list[Command[Any]]] = {}

    @property
    def outputs(self) -> dict[str, Output[Any]]:
        """All open outputs by resolved topic."""
        return dict(self._outputs)

    @property
    def commands(self) -> dict[str, list[Command[Any]]]:
        """All open commands by resolved topic."""
        return {topic: list(commands) for topic, commands in self._commands.items()}

    def open_output(self, name: str, value_type: type[T]) -> Output[T]:
        """Opens an output; plugins that name the same topic share it.

        Raises:
            FlatlandError: The topic carries values of another type already.
        """
        topic = "/" + name.lstrip("/")
        output = self._outputs.get(topic)
        if output is not None:
            self._check_type(topic, output.value_type, value_type)
            self._owners[topic] += 1
            return output
        output = Output(name, value_type, self._on_fault)
        self._observer.output_opened(output)
        self._outputs[topic] = output
        self._owners[topic] = 1
        return output

    def close_output(self, output: Output[Any]) -> None:
        """Lets go of an output; it ends with its last owner."""
        if output.closed:
            return
        self._owners[output.topic] -= 1
        if self._owners[output.topic]:
            return
        del self._owners[output.topic], self._outputs[output.topic]
        output.closed = True
        self._observer.output_closed(output)

    def open_command(
        self,
        name: str,
        value_type: type[T],
        default: T,
        accept: Callable[[T], bool] | None = None,
    ) -> Command[T]:
        """Opens a command of its own for a plugin, also where others share the topic.

        Raises:
            FlatlandError: The topic carries values of another type already.
        """
        command = Command(name, value_type, default, accept)
        others = self._commands.get(command.topic)
        if others:
            self._check_type(command.topic, others[0].value_type, value_type)
        self._observer.command_opened(command)
        self._commands.setdefault(command.topic, []).append(command)
        return command

    def close_command(self, command: Command[Any]) -> None:
        """Ends a command."""
        if command.closed:
            return
        command.closed = True
        commands = self._commands[command.topic]
        commands[:] = [other for other in commands if other is not command]
        if not commands:
            del self._commands[command.topic]
        self._observer.command_closed(command)

    def find_output(self, topic: str) -> Output[Any]:
        """Returns the output of a resolved topic.

        Raises:
            WorldError: There is none; names those that there are.
        """
        try:
            return self._outputs["/" + topic.lstrip("/")]
        except KeyError:
            raise WorldError(
                f'no output "{topic}", there are: {", ".join(sorted(self._outputs)) or "none"}'
            ) from None

    def find_command(self, topic: str) -> CommandTopic[Any]:
        """Returns all commands of a resolved topic as one.

        Raises:
            WorldError: There is none; names those that there are.
        """
        try:
            return CommandTopic(self._commands["/" + topic.lstrip("/")])
        except KeyError:
            raise WorldError(
                f'no command "{topic}", there are: {", ".join(sorted(self._commands)) or "none"}'
            ) from None

    @staticmethod
    def _check_type(topic: str, has: type[Any], wanted: type[Any]) -> None:
        if has is not wanted:
            raise FlatlandError(
                f'topic "{topic}" carries {has.__name__} already, not {wanted.__name__}'
            )
