"""Ports: outputs that plugins emit values to, and commands that they read.

A plugin declares an `Output` or a `Command` and does not depend on what is connected to it. The
ROS bridge, a test or a notebook finds both by their resolved topic in the `PortRegistry`.
"""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable, Hashable, Sequence
from typing import Any, ClassVar, Generic, Protocol, TypeVar

from flatland.checks import check_function, shown
from flatland.errors import PLUGIN_FAULTS, WorldError
from flatland.graph_names import global_name
from flatland.uncopied import uncopied

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)
SubscriberFault = Callable[["Output[Any]", Callable[[Any], None], BaseException], None]
OwnerFinder = Callable[[object], "PortUser | None"]
OwnedSubscription = tuple["Output[Any]", "Token", Callable[[Any], None], bool]


class PortUser(Protocol):
    """A plugin, or the plugins of a world, by which an output is used."""

    def _call_at_end(self, function: Callable[[], None]) -> None:
        """Calls a function when the user ends."""


class Token:
    """Identifies a subscription of an output.

    Attributes:
        owner: The plugin that has made it, or its world if it is not known which plugin has; None
            if it was made outside of the world. A clone has copies of those with an owner.
    """

    __slots__ = ("owner",)

    def __init__(self, owner: PortUser | None) -> None:
        """Creates the identity of a new subscription."""
        self.owner = owner


def callback_name(callback: object) -> str:
    """Returns the name of a function, for messages."""
    while isinstance(callback, functools.partial):
        callback = callback.func
    return getattr(callback, "__qualname__", None) or repr(callback)


@uncopied("World.clone() copies a world with its outputs")
class Output(Generic[T]):
    """A stream of values that a plugin emits.

    Attributes:
        name: Topic under the namespace of the model, with a leading `/` only if it is global.
        topic: The topic with a leading `/`: the key in the registry.
        value_type: Type of the values.
        latest: The last value emitted, None before the first.
        owners: Names of the plugins that opened it, for messages.
        closed: Whether the last of these plugins has ended.
    """

    outside_state: ClassVar[dict[str, Callable[[], object]]] = {
        "_inner_wanters": frozenset,
        "_lock": threading.Lock,
        "_subscribers": tuple,
        "_wanters": frozenset,
    }

    __slots__ = (
        "_find_owner",
        "_inner_wanters",
        "_lock",
        "_on_fault",
        "_on_wanted",
        "_subscribers",
        "_wanters",
        "closed",
        "latest",
        "name",
        "owners",
        "topic",
        "value_type",
    )

    def __init__(
        self,
        name: str,
        value_type: type[T],
        owner: str = "",
        on_fault: SubscriberFault | None = None,
        on_wanted: Callable[[], None] | None = None,
        find_owner: OwnerFinder | None = None,
    ) -> None:
        """Creates an output without subscribers.

        Args:
            name: Resolved topic.
            value_type: Type of the values.
            owner: Name of the plugin, for messages.
            on_fault: Called with the exception of a subscriber, which then does not reach the
                plugin that emits; None to propagate it.
            on_wanted: Called from any thread when `wanted` may have changed.
            find_owner: Returns who makes a subscription, by its callback, or by None for a demand;
                see `Token`.
        """
        self.name = name
        self.topic = global_name(name)
        self.value_type = value_type
        self.latest: T | None = None
        self.owners = [owner]
        self.closed = False
        self._on_fault = on_fault
        self._on_wanted = on_wanted
        self._find_owner = find_owner
        # All are replaced and never modified, so that other threads may read them at any time; the
        # lock serializes the replacements.
        self._lock = threading.Lock()
        self._subscribers: tuple[tuple[Token, Callable[[T], None]], ...] = ()
        self._wanters: frozenset[Hashable] = frozenset()
        self._inner_wanters: frozenset[Hashable] = frozenset()  # on behalf of plugins

    @property
    def wanted(self) -> bool:
        """Whether anything uses the values, so that computing them is worthwhile."""
        return bool(self._wanters)

    def want(self, who: Hashable) -> None:
        """Marks the output as wanted on behalf of `who`; safe from any thread."""
        owner = None if self._find_owner is None else self._find_owner(None)
        if owner is not None:
            owner._call_at_end(lambda: self.unwant(who))
        with self._lock:
            if owner is not None:
                self._inner_wanters |= {who}
            self._set_wanters(self._wanters | {who})

    def unwant(self, who: Hashable) -> None:
        """Reverts `want` for `who`; safe from any thread."""
        with self._lock:
            self._inner_wanters -= {who}
            self._set_wanters(self._wanters - {who})

    def _set_wanters(self, wanters: frozenset[Hashable]) -> None:
        was_wanted, self._wanters = bool(self._wanters), wanters
        if bool(wanters) != was_wanted and self._on_wanted is not None:
            self._on_wanted()

    def emit(self, value: T) -> None:
        """Stores a value as `latest` and passes it to all subscribers."""
        self.latest = value
        for _, callback in self._subscribers:
            try:
                callback(value)
            except PLUGIN_FAULTS as error:
                self.report_fault(callback, error)

    def report_fault(self, callback: Callable[[T], None], error: BaseException) -> None:
        """Handles an exception of a subscriber, as if it had raised in `emit`.

        For subscribers that finish their work later. To be called while the exception is handled.

        Args:
            callback: The subscriber.
            error: What it raised.
        """
        if self._on_fault is None:
            raise error
        self._on_fault(self, callback, error)

    def subscribe(self, callback: Callable[[T], None], *, wants: bool = True) -> Callable[[], None]:
        """Subscribes a function to all further values; safe from any thread.

        Args:
            callback: Called with each value, in the thread that steps the world. What it raises
                does not affect the plugin that emits; `World` documents where it is raised or
                logged.
            wants: Whether the subscription makes the output wanted; False for a subscriber that
                calls `want` and `unwant` itself.

        Returns:
            A function that ends this subscription; further calls have no effect. A subscription
            that a plugin makes in `on_initialize`, or one of its methods, also ends with it.

        Raises:
            TypeError: `callback` is no function.
        """
        check_function("callback", callback)
        owner = None if self._find_owner is None else self._find_owner(callback)
        token = Token(owner)
        self._add(token, callback, wants=wants)
        return lambda: self.unsubscribe(token)

    def _add(self, token: Token, callback: Callable[[T], None], *, wants: bool) -> None:
        with self._lock:
            self._subscribers = (*self._subscribers, (token, callback))
            if wants:
                self._set_wanters(self._wanters | {token})
        if token.owner is not None:
            token.owner._call_at_end(lambda: self.unsubscribe(token))

    def unsubscribe(self, token: Token) -> None:
        """Ends a subscription; idempotent, and safe from any thread."""
        with self._lock:
            self._subscribers = tuple(s for s in self._subscribers if s[0] is not token)
            self._set_wanters(self._wanters - {token})

    @property
    def of_plugins(self) -> list[OwnedSubscription]:
        """The subscriptions of plugins, and whether each of them wants the output."""
        return [
            (self, token, callback, token in self._wanters)
            for token, callback in self._subscribers
            if token.owner is not None
        ]

    def resume(self, token: Token, callback: Callable[[T], None], *, wants: bool) -> None:
        """Continues a subscription that has ended, or that is the copy of another one."""
        self.unsubscribe(token)
        self._add(token, callback, wants=wants)

    def sort(self, tokens: Sequence[Token]) -> None:
        """Calls subscribers in the order of some tokens, after those of others."""
        places = {id(token): place for place, token in enumerate(tokens)}
        with self._lock:
            self._subscribers = tuple(
                sorted(self._subscribers, key=lambda each: places.get(id(each[0]), -1))
            )


class CommandSource(Protocol[T_co]):
    """Passes valid values to the plugin of a command without a call of `Command.set`."""

    @property
    def value(self) -> T_co:
        """The last value."""

    @property
    def received(self) -> int:
        """Number of values."""

    def settled(self) -> None:
        """Called when the command has other values from now on."""


@uncopied("World.clone() copies a world with its commands")
class Command(Generic[T]):
    """A value that is set from outside and read by a plugin.

    Attributes:
        name: Topic under the namespace of the model, with a leading `/` only if it is global.
        topic: The topic with a leading `/`.
        value_type: Type of the values.
        owner: Name of the plugin that opened it, for messages.
        closed: Whether the plugin has ended.
        on_change: Called after `state` was set, in any thread; None for no function.
    """

    outside_state: ClassVar[dict[str, Callable[[], object]]] = {
        "_lock": threading.Lock,
        "_on_set": lambda: None,
        "_source": lambda: None,
    }

    __slots__ = (
        "_lock",
        "_on_set",
        "_received",
        "_source",
        "_value",
        "accept",
        "closed",
        "name",
        "on_change",
        "owner",
        "topic",
        "value_type",
    )

    def __init__(
        self,
        name: str,
        value_type: type[T],
        default: T,
        accept: Callable[[T], bool] | None,
        owner: str,
    ) -> None:
        """Creates a command that holds its default.

        Args:
            name: Resolved topic.
            value_type: Type of the values.
            default: Value before the first one is received.
            accept: Returns whether a value is valid; an invalid one is ignored.
            owner: Name of the plugin, for messages.
        """
        self.name = name
        self.owner = owner
        self.topic = global_name(name)
        self.value_type = value_type
        self._lock = threading.Lock()  # held while the value and the number are replaced
        self._value = default
        self._received = 0
        self.closed = False
        self.accept = accept
        self._source: CommandSource[T] | None = None
        self._on_set: Callable[[Command[T], T], None] | None = None
        self.on_change: Callable[[], None] | None = None

    @property
    def state(self) -> tuple[T, int]:
        """The last value accepted or the default, and the number of values accepted.

        They belong together, also while another thread sets the command.
        """
        with self._lock:
            source = self._source
            if source is None:
                return self._value, self._received
            return source.value, self._received + source.received

    @property
    def value(self) -> T:
        """The last value accepted, or the default."""
        source = self._source  # Another thread may end it.
        return self._value if source is None else source.value

    @value.setter
    def value(self, value: T) -> None:
        self._replace(value, 0)

    @property
    def received(self) -> int:
        """Number of values accepted."""
        return self.state[1]

    def _replace(self, value: T, count: int) -> None:
        """Sets the value, counts it, and only then notifies the plugin."""
        if self._source is not None:
            self.settle()
        with self._lock:
            self._value = value
            self._received += count
        if self.on_change is not None:
            self.on_change()

    @property
    def on_set(self) -> Callable[[Command[T], T], None] | None:
        """Called as `on_set(command, value)` before each `set`, also for values not accepted.

        None for no function; settable.
        """
        return self._on_set

    @on_set.setter
    def on_set(self, function: Callable[[Command[T], T], None] | None) -> None:
        self.settle()
        self._on_set = function

    def follow(self, source: CommandSource[T]) -> None:
        """Takes its values from a source that passes them to the plugin itself, until `settle`."""
        self.settle()
        self._source = source

    def settle(self) -> None:
        """Keeps the last value of a source, which must not pass further values to the plugin."""
        if self._source is None:
            return
        with self._lock:
            source, self._source = self._source, None
            if source is not None:
                self._value = source.value
                self._received += source.received
        if source is not None:
            source.settled()

    def renew(self, new: Command[T]) -> None:
        """Becomes equal to a new command of the same topic; `on_set` remains."""
        self.name, self.owner, self.accept = new.name, new.owner, new.accept
        self.settle()
        self._value, self._received, self.closed = new.value, 0, False
        self.on_change = None

    def set(self, value: T) -> None:
        """Sets the value if `accept` allows it.

        Raises:
            TypeError: The value does not have the type of the command.
        """
        if not isinstance(value, self.value_type):
            raise TypeError(
                f"command {self.topic} takes {self.value_type.__name__}, got {shown(value)}"
            )
        if self._on_set is not None:
            self._on_set(self, value)
        if self.accept is None or self.accept(value):
            self._replace(value, 1)


@uncopied("World.clone() copies a world with its commands")
class CommandTopic(Generic[T]):
    """All commands of one topic; they are set together, like the subscribers of a ROS topic."""

    def __init__(self, commands: list[Command[T]]) -> None:
        """Creates a view of the commands of one topic.

        Args:
            commands: The list of the commands, which the registry updates; not empty.
        """
        self._commands = commands
        self.topic = commands[0].topic
        self.value_type = commands[0].value_type

    @property
    def value(self) -> T:
        """The value of the first command of the topic."""
        if not self._commands:
            raise WorldError(f"command {self.topic} was closed with its model")
        return self._commands[0].value

    def set(self, value: T) -> None:
        """Sets all commands of the topic.

        Raises:
            TypeError: The value does not have the type of the topic.
            WorldError: The command was closed.
        """
        if not self._commands:
            raise WorldError(f"command {self.topic} was closed with its model")
        for command in self._commands:
            command.set(value)
