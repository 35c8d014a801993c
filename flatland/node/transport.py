"""What the node needs from a client library of ROS."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Final, Protocol, TypeVar

from flatland.node.names import sendable_text

if TYPE_CHECKING:
    from flatland.node.adapters.writer import Writer
    from flatland.node.handles import Handles, HandleServer
    from flatland.node.ticker import TickerThread
    from flatland.runtime.requests import Post, Requests
    from flatland.simulation import Simulation
    from flatland.web.foreign_topics import ForeignTopics
    from flatland.world import World

    class ForeignTopicsConnection(ForeignTopics, Protocol):
        """Topics of other nodes, until `close`."""

        def close(self) -> None:
            """Unsubscribes and unregisters everything."""


OnConnection = Callable[[bool], object]
"""Called in any thread whenever a subscriber may have connected or disconnected, with whether there
are subscribers."""

R = TypeVar("R")

_POLL_PERIOD: Final = 0.2  # s between two checks of a request that waits
MARKERS: Final = "visualization_msgs/MarkerArray"
REPLACED: Final = ("/clock",)
"""Topics whose messages are replaced by the next one, so that subscribers need not receive all."""
REGISTRATION_TIMEOUT: Final = 5.0
"""Limit of wall time for the registration of the topics of new models [s]."""


class CallError(Exception):
    """A service call failed; the text is the message of the response.

    Attributes:
        index: Index of the item of the request that caused the failure; -1 if there is none.
    """

    def __init__(self, text: str, index: int = -1) -> None:
        """Initializes the error."""
        super().__init__(sendable_text(text))
        self.index = index


@dataclass(frozen=True, slots=True)
class Adapter:
    """Conversion between the values of one type and ROS messages.

    Attributes:
        value_type: Type of the values.
        message_type: The ROS message class.
        to_message: Converts a value to a message; None if values are only received.
        from_message: Converts a message to a value; None if values are only published.
        serialize: Converts a value to a serialized message; None to serialize the result of
            `to_message`.
    """

    value_type: type[Any]
    message_type: type[Any]
    to_message: Callable[[Any], Any] | None
    from_message: Callable[[Any], Any] | None
    serialize: Callable[[Any], bytes] | None = None

    @property
    def publishable(self) -> Callable[[Any], Any] | None:
        """Converts a value to what `Publisher.publish` accepts, as fast as possible."""
        return self.serialize or self.to_message


class Connection(Protocol):
    """A topic or service of this node that can be closed."""

    def close(self) -> None:
        """Unregisters the topic or service asynchronously."""


class MessageFile(Connection, Protocol):
    """A recording of messages that can be closed."""

    @property
    def error(self) -> str:
        """Why the recording has ended before its end; empty if it has not."""


class Publisher(Connection, Protocol):
    """Publishes messages without blocking.

    Attributes:
        topic: Resolved name of the topic.
        connected: Whether the topic has subscribers.
        closed: Whether the topic was closed, or has given way.
    """

    topic: str
    connected: bool
    closed: bool

    @property
    def connections(self) -> int:
        """Number of subscribers that are connected."""

    def publish(self, message: Any) -> None:
        """Sends a message, or its bytes, to all subscribers; has no effect once closed."""


class Subscription(Connection, Protocol):
    """A subscription to a topic.

    Attributes:
        closed: Whether it has ended: it was closed, or has given way.
    """

    closed: bool


class StateTopic(Connection, Protocol):
    """Publishes a state: to new subscribers when they connect, to all by `send`.

    Attributes:
        topic: Resolved name of the topic.
        connected: Whether the topic has subscribers.
    """

    topic: str
    connected: bool

    def replace(self, make: Callable[[], Any]) -> None:
        """Publishes another state from now on; must be called in the thread that steps the world.

        Args:
            make: Creates the message of the new state, as in `Transport.advertise_state`.
        """

    def send(self) -> None:
        """Publishes the current state.

        Must be called in the thread that steps the world, except for the topic of the clock.
        """


class Transport(ABC):
    """The connections of the node to others; methods do not block unless documented.

    Names are in the namespace of the node, global with a leading `/`, private with a leading `~`.
    Names of plugins in `owner` occur in messages only. `advertise`, `advertise_state`, `subscribe`
    and `serve` raise a `FlatlandError` if the node uses the name for another type.

    Attributes:
        REGISTER_ADAPTER: Full name of the function that registers adapters, for messages.
    """

    REGISTER_ADAPTER: ClassVar[str]

    # -- topics and services ---------------------------------------------------------------

    @abstractmethod
    def find_adapter(self, value_type: type[Any]) -> Adapter | None:
        """Returns the adapter of a value type or of its nearest base class, or None."""

    @abstractmethod
    def message_class(self, name: str) -> type[Any]:
        """Imports a message class.

        Args:
            name: `PACKAGE/NAME`, with the package `flatland` for messages of flatland.

        Raises:
            ImportError: The package is not installed.
        """

    @abstractmethod
    def writer(self) -> Writer:
        """Returns a writer for a new message."""

    @abstractmethod
    def advertise(
        self,
        topic: str,
        message_type: type[Any],
        *,
        queue_size: int = 1,
        latch: bool = False,
        on_connection: OnConnection | None = None,
        owner: str = "",
        gives_way: bool = False,
    ) -> Publisher:
        """Advertises a topic.

        Args:
            topic: Name of the topic.
            message_type: ROS message class.
            queue_size: Maximum number of messages queued for a slow subscriber.
            latch: Whether a new subscriber receives the last message when it connects.
            on_connection: Reports changes of the subscribers.
            owner: Plugin that publishes.
            gives_way: Whether the topic is closed when another publisher of this node, which does
                not give way, needs another message class.
        """

    @abstractmethod
    def advertise_state(
        self,
        topic: str,
        message_type: type[Any],
        make: Callable[[], Any],
        post: Post,
        on_connection: OnConnection | None = None,
    ) -> StateTopic:
        """Advertises a state.

        Args:
            topic: Name of the topic.
            message_type: ROS message class.
            make: Creates the message of the current state, as an object or as its bytes; called
                between two steps.
            post: Runs an action between two steps.
            on_connection: Reports changes of the subscribers.
        """

    @abstractmethod
    def subscribe(
        self,
        topic: str,
        message_type: type[Any],
        callback: Callable[[Any], object],
        *,
        owner: str = "",
        gives_way: bool = False,
    ) -> Subscription:
        """Calls a function with each message of a topic, in any thread.

        Args:
            topic: Name of the topic.
            message_type: ROS message class.
            callback: The function.
            owner: Plugin that subscribes.
            gives_way: Whether the subscription ends when another one of this node, which does not
                give way, needs another message class.
        """

    @abstractmethod
    def serve(
        self,
        name: str,
        service_type: type[Any] | str,
        handler: Callable[[Any], Any],
        *,
        owner: str = "",
    ) -> Connection:
        """Calls a function with each request of a service, each in a thread of its own.

        Args:
            name: Name of the service.
            service_type: ROS service class, whose handler returns a response; or `PACKAGE/NAME`,
                with the package `flatland` for services of flatland, whose handler returns the
                fields of the response by name: poses (x, y, theta), times [ns], and values that
                have an adapter are converted.
            handler: The function. A `CallError` is reported to the client without a traceback.
            owner: Plugin that offers the service.
        """

    @abstractmethod
    def service_class(self, name: str) -> type[Any]:
        """Returns the class of a service of flatland."""

    def wait_for(self, future: Future[R], requests: Requests) -> R:
        """Waits in the thread of a service until the simulation has handled a request.

        Args:
            future: Result of the request.
            requests: The queue of the request.

        Raises:
            CallError: The node shuts down first, or a plugin blocks the simulation; in the latter
                case, the request is withdrawn.
        """
        while True:
            try:
                return future.result(timeout=_POLL_PERIOD)
            except TimeoutError:
                if future.done():
                    raise
                if self.shutting_down:
                    raise CallError("the simulator is shutting down") from None
                if requests.blocked_by and future.cancel():
                    raise CallError(
                        f"the simulation is blocked: {requests.blocked_by} does not return"
                    ) from None

    def publishable(self, value_type: type[Any]) -> tuple[type[Any], Callable[[Any], Any]]:
        """Returns the message class of a value type and the function that converts the values.

        Raises:
            LookupError: There is no adapter that publishes such values.
        """
        adapter = self.find_adapter(value_type)
        if adapter is None or adapter.publishable is None:
            raise LookupError(f"no adapter publishes {value_type.__name__}")
        return adapter.message_type, adapter.publishable

    def receivable(self, value_type: type[Any]) -> tuple[type[Any], Callable[[Any], Any]]:
        """Returns the message class of a value type and the function that converts messages.

        Raises:
            LookupError: There is no adapter that receives such values.
        """
        adapter = self.find_adapter(value_type)
        if adapter is None or adapter.from_message is None:
            raise LookupError(f"no adapter receives {value_type.__name__}")
        return adapter.message_type, adapter.from_message

    def state_of(
        self,
        topic: str,
        value_type: type[Any],
        make: Callable[[], Any],
        post: Post,
        on_connection: OnConnection | None = None,
    ) -> StateTopic:
        """Advertises a state whose current value `make` returns."""
        message_type, convert = self.publishable(value_type)
        return self.advertise_state(
            topic, message_type, lambda: convert(make()), post, on_connection
        )

    def values(
        self, topic: str, value_type: type[Any], **options: Any
    ) -> tuple[Publisher, Callable[[Any], Any]]:
        """Advertises a topic for values.

        Args:
            topic: Name of the topic.
            value_type: Type of the values.
            options: Further arguments of `advertise`.

        Returns:
            The publisher, and the function that converts a value to what it publishes.
        """
        message_type, convert = self.publishable(value_type)
        return self.advertise(topic, message_type, **options), convert

    # -- the node --------------------------------------------------------------------------

    @property
    @abstractmethod
    def node_name(self) -> str:
        """Resolved name of the node."""

    @property
    @abstractmethod
    def shutting_down(self) -> bool:
        """Whether the node is ending, so that requests are no longer carried out."""

    @abstractmethod
    def resolve(self, name: str) -> str:
        """Returns the global name after remapping."""

    @abstractmethod
    def parameter(self, name: str) -> Any:
        """Returns a parameter in the namespace of the node, None if it is not set."""

    @abstractmethod
    def set_parameter(self, name: str, value: object) -> None:
        """Sets a parameter asynchronously."""

    @abstractmethod
    def flush(self, timeout: float) -> bool:
        """Waits until everything queued so far is registered.

        Args:
            timeout: Limit of wall time [s].

        Returns:
            Whether it is registered.
        """

    @abstractmethod
    def is_connected(self, topic: str) -> bool:
        """Returns whether all publishers and subscribers of this node for a topic are connected."""

    @abstractmethod
    def closing_last(self) -> AbstractContextManager[None]:
        """Closes topics after those that are opened in the block, which keeps connections."""

    @abstractmethod
    def dropped(self) -> Callable[[], Counter[tuple[str, str]]]:
        """Returns a function that counts dropped messages.

        It returns the number of messages dropped since its previous call, by topic and subscriber.
        """

    @abstractmethod
    def disable_delay(self) -> None:
        """Sends small messages at once from now on, at a higher cost per message."""

    @abstractmethod
    def record(self, path: str, world: World) -> MessageFile:
        """Records all messages of a world to an MCAP file, until `close`.

        Errors of the file, such as a full disk, are logged and end the recording.

        Raises:
            FlatlandError: A required package is not installed.
            OSError: The file cannot be created.
        """

    # -- time ------------------------------------------------------------------------------

    @abstractmethod
    def clock_topic(
        self, now: Callable[[], int], post: Post, on_connection: OnConnection
    ) -> StateTopic:
        """Advertises `/clock`; of several threads that send, none sends an earlier time.

        Args:
            now: Returns the current time [ns]; called in any thread.
            post: Runs an action at once, one at a time.
            on_connection: Reports changes of the subscribers.
        """

    @abstractmethod
    def set_time(self, time_ns: int) -> None:
        """Sets the ROS time of this node [ns]."""

    # -- displays, whose modules are imported in a background thread ----------------------------

    @abstractmethod
    def load_debug_markers(
        self,
    ) -> Callable[[Simulation, float, TickerThread], Connection]:
        """Imports the debug markers.

        Returns:
            A function that publishes them, called between two steps with the simulation, the rate
            [Hz] and the thread of the periodic work.
        """

    @abstractmethod
    def load_handle_server(self) -> Callable[[Post, Handles], HandleServer] | None:
        """Imports the server of interactive markers.

        Returns:
            The function that starts it; None if there is none for this kind of ROS.
        """

    @abstractmethod
    def load_foreign_topics(self) -> Callable[[Simulation], ForeignTopicsConnection]:
        """Imports the connection of the viewer in the browser with topics of other nodes.

        Returns:
            A function that creates it for a simulation; called in any thread.
        """
