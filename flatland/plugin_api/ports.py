"""Ports: where plugins hand over values and take commands, without knowing who listens.

A plugin declares an `Output` or a `Command`. Whoever connects a world to the outside (the ROS
bridge, a test, a notebook) finds them by their resolved topic in the world's `PortRegistry`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Hashable
from typing import Any, Generic, TypeVar

from flatland.errors import FlatlandError, WorldError

T = TypeVar("T")

# ROS graph names as roscpp checks them, less the private ~ which a model has no use for.
_LEGAL_NAME = re.compile(r"[A-Za-z/][\w/]*", re.ASCII)


def clean_name(name: str) -> str:
    """Returns a ROS name without repeated slashes and without one at the end, as roscpp does."""
    return re.sub("/+", "/", name).removesuffix("/")


def is_legal_namespace(namespace: str) -> bool:
    """Returns whether a namespace is empty or, once cleaned, a legal ROS graph name."""
    cleaned = clean_name(namespace)
    return not cleaned or _LEGAL_NAME.fullmatch(cleaned) is not None


def resolve_topic(topic: str, namespace: str = "") -> str:
    """Puts a topic under a namespace.

    Args:
        topic: As written; a leading `/` makes it global. Repeated slashes and one at the end are
            dropped.
        namespace: Of the model, may be empty; cleaned in the same way.

    Returns:
        `/topic` when the topic is global, else `namespace/topic`, which starts with a slash only
        if the namespace does, so that a layer above may put a namespace of its own in front.

    Raises:
        ValueError: The topic is no legal ROS name.
    """
    cleaned = clean_name(topic)
    if _LEGAL_NAME.fullmatch(cleaned) is None:
        raise ValueError(
            f'"{topic}" is not a legal topic name: it must start with a letter or "/" and hold '
            'only letters, digits, "_" and "/"'
        )
    namespace = clean_name(namespace)
    return cleaned if cleaned.startswith("/") or not namespace else f"{namespace}/{cleaned}"


def _key(name: str) -> str:
    """Returns the key of a topic in the registry: its cleaned name with a leading slash."""
    return "/" + clean_name(name).lstrip("/")


class Output(Generic[T]):
    """A stream of values that a plugin emits.

    Attributes:
        name: Topic under the model's namespace, with a leading `/` only if it is global.
        topic: The same with a leading `/`: the key in the registry.
        value_type: Type of the values.
        latest: The last value emitted, None before the first.
        owners: Names of the plugins that opened it, for messages.
    """

    __slots__ = (
        "_callbacks",
        "_wanters",
        "closed",
        "latest",
        "name",
        "owners",
        "topic",
        "value_type",
    )

    def __init__(self, name: str, value_type: type[T], owner: str = "") -> None:
        """Makes an output that nobody wants yet.

        Args:
            name: Resolved topic.
            value_type: Type of the values.
            owner: Name of the plugin, for messages.
        """
        self.name = name
        self.topic = _key(name)
        self.value_type = value_type
        self.latest: T | None = None
        self.owners = [owner]
        self.closed = False
        self._callbacks: tuple[Callable[[T], None], ...] = ()
        self._wanters: frozenset[Hashable] = frozenset()

    @property
    def wanted(self) -> bool:
        """Whether anybody listens, so that computing a value is worth it."""
        return bool(self._wanters)

    def want(self, who: Hashable) -> None:
        """Marks the output as wanted on behalf of `who`; safe from any thread."""
        self._wanters = self._wanters | {who}

    def unwant(self, who: Hashable) -> None:
        """Takes back what `want` said for `who`."""
        self._wanters = self._wanters - {who}

    def emit(self, value: T) -> None:
        """Hands a value to all who subscribed and keeps it as `latest`."""
        self.latest = value
        for callback in self._callbacks:
            callback(value)

    def subscribe(self, callback: Callable[[T], None], *, wants: bool = True) -> Callable[[], None]:
        """Calls `callback` with each value from now on.

        Args:
            callback: Called in the thread that steps the world.
            wants: Whether that makes the output wanted; False for who tells by `want` itself.

        Returns:
            A function that ends the subscription.
        """
        self._callbacks = (*self._callbacks, callback)
        token = object()
        if wants:
            self.want(token)

        def unsubscribe() -> None:
            self._callbacks = tuple(other for other in self._callbacks if other is not callback)
            self.unwant(token)

        return unsubscribe


class Command(Generic[T]):
    """A value that comes from outside and that a plugin reads when it likes; the last one wins.

    Attributes:
        name: Topic under the model's namespace, with a leading `/` only if it is global.
        topic: The same with a leading `/`.
        value_type: Type of the values.
        value: The last one set, or the default.
        received: How many were set.
        owner: Name of the plugin that opened it, for messages.
    """

    __slots__ = ("accept", "closed", "name", "owner", "received", "topic", "value", "value_type")

    def __init__(
        self,
        name: str,
        value_type: type[T],
        default: T,
        accept: Callable[[T], bool] | None = None,
        owner: str = "",
    ) -> None:
        """Makes a command that holds its default.

        Args:
            name: Resolved topic.
            value_type: Type of the values.
            default: Value before the first comes.
            accept: Asked with each value; one that it refuses leaves the last good one.
            owner: Name of the plugin, for messages.
        """
        self.name = name
        self.owner = owner
        self.topic = _key(name)
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


class PortRegistry:
    """All ports of a world by resolved topic, and who is told when they come and go."""

    def __init__(self) -> None:
        """Starts without ports."""
        self._outputs: dict[str, Output[Any]] = {}
        self._commands: dict[str, list[Command[Any]]] = {}
        self.output_opened: list[Callable[[Output[Any]], None]] = []
        self.output_closed: list[Callable[[Output[Any]], None]] = []
        self.command_opened: list[Callable[[Command[Any]], None]] = []
        self.command_closed: list[Callable[[Command[Any]], None]] = []

    @property
    def outputs(self) -> dict[str, Output[Any]]:
        """All open outputs by resolved topic."""
        return dict(self._outputs)

    @property
    def commands(self) -> dict[str, list[Command[Any]]]:
        """All open commands by resolved topic."""
        return {topic: list(commands) for topic, commands in self._commands.items()}

    def open_output(self, name: str, value_type: type[T], owner: str = "") -> Output[T]:
        """Opens an output; plugins that name the same topic share it.

        Args:
            name: Resolved topic.
            value_type: Type of the values.
            owner: Name of the plugin, for messages.

        Raises:
            FlatlandError: The topic carries values of another type already.
        """
        output = self._outputs.get(_key(name))
        if output is not None:
            self._check_type(output, output.owners[0], value_type)
            output.owners.append(owner)
            return output
        output = Output(name, value_type, owner)
        for notify in self.output_opened:
            notify(output)
        self._outputs[output.topic] = output
        return output

    def close_output(self, output: Output[Any], owner: str = "") -> None:
        """Takes one owner off an output, which ends with its last one."""
        if output.closed:
            return
        output.owners.remove(owner)
        if output.owners:
            return
        del self._outputs[output.topic]
        output.closed = True
        for notify in self.output_closed:
            notify(output)

    def open_command(
        self,
        name: str,
        value_type: type[T],
        default: T,
        accept: Callable[[T], bool] | None = None,
        owner: str = "",
    ) -> Command[T]:
        """Opens a command of its own for a plugin, also where others share the topic.

        Raises:
            FlatlandError: The topic carries values of another type already.
        """
        command = Command(name, value_type, default, accept, owner)
        others = self._commands.get(command.topic)
        if others:
            self._check_type(others[0], others[0].owner, value_type)
        for notify in self.command_opened:
            notify(command)
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
        for notify in self.command_closed:
            notify(command)

    def find_output(self, topic: str) -> Output[Any]:
        """Returns the output of a resolved topic.

        Raises:
            WorldError: There is none; names those that there are.
        """
        try:
            return self._outputs[_key(topic)]
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
            return CommandTopic(self._commands[_key(topic)])
        except KeyError:
            raise WorldError(
                f'no command "{topic}", there are: {", ".join(sorted(self._commands)) or "none"}'
            ) from None

    @staticmethod
    def _check_type(port: Output[Any] | Command[Any], owner: str, wanted: type[Any]) -> None:
        if port.value_type is not wanted:
            used_by = f", used by {owner}" if owner else ""
            raise FlatlandError(
                f'topic "{port.topic}" carries {port.value_type.__name__} already{used_by}, '
                f"not {wanted.__name__}"
            )
