"""The ports of a world by topic."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, Protocol, TypeVar

from flatland.errors import FlatlandError, WorldError
from flatland.graph_names import global_name
from flatland.plugin_api.ports import (
    Command,
    CommandTopic,
    Output,
    OwnerFinder,
    SubscriberFault,
)
from flatland.suggestions import did_you_mean, listed

T = TypeVar("T")


class PortObserver(Protocol):
    """Receives notifications of ports; implemented by `flatland.runtime.observer.Observers`."""

    def output_opened(self, output: Output[Any]) -> None:
        """Called before an output is added; an exception refuses the port."""

    def output_closed(self, output: Output[Any]) -> None:
        """Called after an output has been removed."""

    def command_opened(self, command: Command[Any]) -> None:
        """Called before a command is added; an exception refuses the port."""

    def command_closed(self, command: Command[Any]) -> None:
        """Called after a command has been removed."""


class PortRegistry:
    """All open ports of a world by resolved topic."""

    def __init__(
        self,
        observer: PortObserver,
        on_fault: SubscriberFault | None = None,
        on_wanted: Callable[[], None] | None = None,
        find_owner: OwnerFinder | None = None,
    ) -> None:
        """Creates an empty registry.

        Args:
            observer: Notified when ports open and close.
            on_fault: Called with the exceptions of subscribers of outputs, see `Output`.
            on_wanted: Called from any thread when an output may be wanted or not any more.
            find_owner: Returns who makes a subscription, see `Output`.
        """
        self._observer = observer
        self._on_fault = on_fault
        self._on_wanted = on_wanted
        self._find_owner = find_owner
        self._outputs: dict[str, Output[Any]] = {}
        self._commands: dict[str, list[Command[Any]]] = {}
        # Ports that were closed and may be opened again, None if they are not kept.
        self._kept: _KeptPorts | None = None

    @property
    def outputs(self) -> dict[str, Output[Any]]:
        """All open outputs by resolved topic."""
        return dict(self._outputs)

    @property
    def commands(self) -> dict[str, list[Command[Any]]]:
        """All open commands by resolved topic."""
        return {topic: list(commands) for topic, commands in self._commands.items()}

    @contextmanager
    def keeping(self) -> Iterator[None]:
        """Keeps ports that are closed and opened again in the block, with their subscribers.

        Opening a port returns the closed port of the same topic and type, reset to its initial
        values. Observers are notified only of ports that are still closed at the end.
        """
        kept = self._kept = _KeptPorts()
        try:
            yield
        finally:
            self._kept = None
            for output in kept.outputs.values():
                if output.closed:
                    self._observer.output_closed(output)
            for command in kept.commands:
                if command.closed:
                    self._forget(command)

    @property
    def kept(self) -> tuple[list[Output[Any]], list[Command[Any]]]:
        """The ports that are closed, but of which observers have not been notified."""
        if self._kept is None:
            return [], []
        return list(self._kept.outputs.values()), list(self._kept.commands)

    def _forget(self, command: Command[Any]) -> None:
        """Notifies the observers of a command that is closed."""
        if not self._commands.get(command.topic, True):
            del self._commands[command.topic]
        self._observer.command_closed(command)

    def commands_received(self) -> int:
        """Returns the number of values that all open commands accepted."""
        return sum(command.received for same in self._commands.values() for command in same)

    def open_output(self, name: str, value_type: type[T], owner: str = "") -> Output[T]:
        """Opens an output, which is shared by all plugins that open the same topic.

        Args:
            name: Resolved topic.
            value_type: Type of the values.
            owner: Name of the plugin, for messages.

        Raises:
            FlatlandError: The topic already carries values of another type.
        """
        output = self._outputs.get(global_name(name))
        if output is not None:
            _check_type(output, output.owners[0], value_type)
            output.owners.append(owner)
            return output
        output = self._keep_output(global_name(name), value_type)
        if output is not None:
            output.owners.append(owner)
            self._outputs[output.topic] = output
            return output
        output = Output(name, value_type, owner, self._on_fault, self._on_wanted, self._find_owner)
        self._observer.output_opened(output)
        self._outputs[output.topic] = output
        return output

    def _keep_output(self, topic: str, value_type: type[T]) -> Output[T] | None:
        """Returns the output of a topic that was closed a moment ago, None if there is none."""
        output = None if self._kept is None else self._kept.outputs.pop(topic, None)
        if output is None:
            return None
        if output.value_type is not value_type:
            self._observer.output_closed(output)
            return None
        output.closed, output.latest = False, None
        return output

    def close_output(self, output: Output[Any], owner: str = "") -> None:
        """Removes one owner of an output, and closes the output if it was the last one."""
        if output.closed:
            return
        output.owners.remove(owner)
        if output.owners:
            return
        del self._outputs[output.topic]
        output.closed = True
        if self._kept is None:
            self._observer.output_closed(output)
        else:
            self._kept.outputs[output.topic] = output

    def open_command(
        self,
        name: str,
        value_type: type[T],
        default: T,
        accept: Callable[[T], bool] | None = None,
        owner: str = "",
    ) -> Command[T]:
        """Opens a command; each plugin that opens the same topic has a command of its own.

        Args:
            name: Resolved topic.
            value_type: Type of the values.
            default: Value before the first one is received.
            accept: Returns whether a value is valid.
            owner: Name of the plugin, for messages.

        Raises:
            FlatlandError: The topic already carries values of another type.
        """
        command = Command(name, value_type, default, accept, owner)
        others = self._commands.get(command.topic)
        if others:
            _check_type(others[0], others[0].owner, value_type)
        kept = self._keep_command(command)
        if kept is None:
            self._observer.command_opened(command)
        else:
            command = kept
        self._commands.setdefault(command.topic, []).append(command)
        return command

    def _keep_command(self, new: Command[T]) -> Command[T] | None:
        """Returns a command of the same topic that was closed a moment ago, None without one."""
        for command in [] if self._kept is None else list(self._kept.commands):
            if command.topic != new.topic or self._kept is None:
                continue
            self._kept.commands.remove(command)
            if command.value_type is new.value_type:
                command.renew(new)
                return command
            self._observer.command_closed(command)
        return None

    def close_command(self, command: Command[Any]) -> None:
        """Closes a command."""
        if command.closed:
            return
        command.closed = True
        commands = self._commands[command.topic]
        commands[:] = [other for other in commands if other is not command]
        if self._kept is None:
            self._forget(command)
        else:
            # The list stays: a `CommandTopic` refers to it. The last plugin is the first to end.
            self._kept.commands.appendleft(command)

    def find_output(self, topic: str) -> Output[Any]:
        """Returns the output of a resolved topic.

        Raises:
            WorldError: The output does not exist; the text lists all outputs.
        """
        try:
            return self._outputs[global_name(topic)]
        except KeyError:
            raise WorldError(
                f'output "{topic}" does not exist; existing outputs: {_names(self._outputs)}',
                hint=did_you_mean(global_name(topic), self._outputs),
            ) from None

    def find_command(self, topic: str) -> CommandTopic[Any]:
        """Returns all commands of a resolved topic as one.

        Raises:
            WorldError: The command does not exist; the text lists all commands.
        """
        try:
            return CommandTopic(self._commands[global_name(topic)])
        except KeyError:
            raise WorldError(
                f'command "{topic}" does not exist; existing commands: {_names(self._commands)}',
                hint=did_you_mean(global_name(topic), self._commands),
            ) from None

    def commands_of(self, owner: str) -> list[Command[Any]]:
        """Returns the open commands of a plugin in order of their topics.

        Args:
            owner: Name of the plugin, as passed to `open_command`.
        """
        commands = [command for topic in self._commands.values() for command in topic]
        return sorted((c for c in commands if c.owner == owner), key=lambda c: c.topic)


class _KeptPorts:
    """Ports that were closed and may be opened again, in the order in which they were opened."""

    def __init__(self) -> None:
        self.outputs: dict[str, Output[Any]] = {}
        self.commands: deque[Command[Any]] = deque()


def _names(topics: Iterable[str]) -> str:
    return listed(sorted(topics))


def _check_type(port: Output[Any] | Command[Any], owner: str, value_type: type[Any]) -> None:
    if port.value_type is not value_type:
        used_by = f", used by {owner}" if owner else ""
        raise FlatlandError(
            f'topic "{port.topic}" already carries {port.value_type.__name__}{used_by}, '
            f"not {value_type.__name__}"
        )
