"""Calls to the ROS master in a separate thread, so that no other thread blocks on it.

Each topic and service costs a call to the master. The call takes a millisecond if the master
responds, and otherwise blocks until it does, because rospy retries indefinitely. The thread that
steps the world only queues these calls, which are made in the order of the queue.
"""

from __future__ import annotations

import contextlib
import logging
import queue
import threading
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Protocol

import rospy

from flatland.errors import FlatlandError

_LOG = logging.getLogger("flatland")


def unregister(topic: rospy.topics.Topic) -> None:
    """Unregisters a publisher or subscriber of rospy, and closes all descriptors of it.

    rospy polls the connections of a topic with a descriptor that it leaves to Python's cyclic
    garbage collector. To be called in an action of the registrar.
    """
    impl = topic.impl
    topic.unregister()
    if impl is not None and impl.closed:  # not while another publisher of the topic uses it
        with impl.c_lock:  # A thread that adds a connection checks `closed` with this lock.
            impl.connection_poll.poller.close()


class Endpoint(Protocol):
    """A publisher, subscriber or service of the node."""

    @property
    def owner(self) -> str:
        """Plugin that uses it, for messages; empty for the node itself."""

    @property
    def ready(self) -> bool:
        """Whether it is registered, and its owner has been notified of a connection."""


class Registrar:
    """Registers and unregisters topics and services in order.

    Attributes:
        master_lost: Whether the ROS master is known not to respond.
    """

    def __init__(self) -> None:
        """Starts the thread."""
        self._actions: queue.SimpleQueue[Callable[[], object]] = queue.SimpleQueue()
        self._postponed: list[Callable[[], object]] | None = None
        self._unfinished = 0  # actions in the queue, and the one that is carried out
        self._closed = False
        self.master_lost = False
        self._lock = threading.Lock()
        self._types: dict[tuple[str, str], type[Any]] = {}
        # The endpoints of each name, with the actions that end those that give way.
        self._endpoints: dict[tuple[str, str], dict[Endpoint, Callable[[], object] | None]] = {}
        # Parameters by resolved name: as the node found them, and as it has set them.
        self._found_parameters: dict[str, object] = {}
        self._own_parameters: dict[str, object] = {}
        self._thread = threading.Thread(target=self._run, name="flatland-registrar", daemon=True)
        self._thread.start()

    def submit(self, action: Callable[[], object]) -> None:
        """Queues an action and returns immediately."""
        with self._lock:
            self._put(action)

    def submit_closing(self, action: Callable[[], object]) -> None:
        """Queues an action that closes a topic; at the end of `closing_last` if that is active."""
        if self._postponed is None:
            self.submit(action)
        else:
            self._postponed.append(action)

    @contextlib.contextmanager
    def closing_last(self) -> Iterator[None]:
        """Closes topics after those that are opened in the block.

        A topic that is closed and opened again in the block stays registered, with the same
        connections, because rospy counts its publishers and subscriptions. To be used in the thread
        that steps the world, which also closes topics.
        """
        self._postponed = []
        try:
            yield
        finally:
            postponed, self._postponed = self._postponed, None
            for action in postponed:
                self.submit(action)

    def flush(self, timeout: float) -> bool:
        """Waits until all actions queued so far are done; not while the master is lost.

        Args:
            timeout: Limit of wall time [s].

        Returns:
            Whether they are done.
        """
        if not self._unfinished:
            return True  # A wait would cost two changes of threads.
        if self.master_lost:
            return False
        done = threading.Event()
        self.submit(done.set)
        return done.wait(timeout)

    def claim(
        self,
        kind: str,
        name: str,
        ros_type: type[Any],
        endpoint: Endpoint,
        *,
        shared: bool = True,
        give_way: Callable[[], object] | None = None,
    ) -> None:
        """Reserves a name, because rospy does not detect two types of the same name.

        Args:
            kind: `publisher`, `subscriber` or `service`.
            name: Resolved name.
            ros_type: Message or service class.
            endpoint: What uses the name.
            shared: Whether other endpoints of the same type may use the name.
            give_way: Action that ends the endpoint when another one, which does not give way,
                needs the name with another type; None to refuse the other one.

        Raises:
            FlatlandError: The name has another type, or cannot be shared.
        """
        key = kind, name
        with self._lock:
            known = self._types.setdefault(key, ros_type)
            endpoints = self._endpoints.setdefault(key, {})
            if known is not ros_type and give_way is None and None not in endpoints.values():
                # They end before the new one is opened, whose action is queued after this call.
                for end in endpoints.values():
                    if end is not None:
                        self._put(end)
                endpoints.clear()
                known = self._types[key] = ros_type
            owner = next((each.owner for each in endpoints), "")
            used_by = f", used by {owner}" if owner else ""
            if known is not ros_type:
                raise FlatlandError(
                    f'{kind} "{name}" has the type {known._type} already{used_by}, '
                    f"not {ros_type._type}"
                )
            if endpoints and not shared:
                raise FlatlandError(f'{kind} "{name}" exists already{used_by}')
            endpoints[endpoint] = give_way

    def release(self, kind: str, name: str, endpoint: Endpoint) -> None:
        """Releases a name reserved by `claim`, unless the endpoint has given way."""
        key = kind, name
        with self._lock:
            endpoints = self._endpoints.get(key, {})
            if endpoint in endpoints:
                del endpoints[endpoint]
                if not endpoints:
                    del self._endpoints[key], self._types[key]

    def is_connected(self, topic: str) -> bool:
        """Returns whether all publishers and subscribers of this node for a topic are connected.

        Args:
            topic: Resolved name; a topic that this node does not use is not connected.
        """
        with self._lock:
            endpoints = [
                endpoint
                for kind in ("publisher", "subscriber")
                for endpoint in self._endpoints.get((kind, topic), ())
            ]
        return bool(endpoints) and all(endpoint.ready for endpoint in endpoints)

    def set_parameter(self, name: str, value: object) -> None:
        """Sets a parameter asynchronously; without a master, as soon as there is one.

        Args:
            name: Name of the parameter, private with a leading `~`.
            value: The value.
        """
        resolved = rospy.resolve_name(name)
        self._own_parameters[resolved] = value

        def set_now() -> None:
            with contextlib.suppress(OSError):  # no master; `restore_parameters` sets it
                rospy.set_param(resolved, value)

        self.submit(set_now)

    def keep_parameters(self, parameters: Mapping[str, object]) -> None:
        """Stores parameters of the node that are set again on a new master.

        Args:
            parameters: Values by resolved name.
        """
        self._found_parameters.update(parameters)

    def restore_parameters(self) -> None:
        """Sets the parameters of the node on a new master; to be called in an action.

        A parameter that someone else has set in the meantime is kept, unless the node itself
        determines its value.
        """
        for name, value in self._found_parameters.items():
            if name not in self._own_parameters and not rospy.has_param(name):
                rospy.set_param(name, value)
        for name, value in list(self._own_parameters.items()):
            rospy.set_param(name, value)

    def close(self, timeout: float) -> None:
        """Discards the queue and ends the thread; rospy unregisters everything at shutdown.

        Args:
            timeout: Limit of wall time for the action in progress [s].
        """
        self._closed = True
        self.submit(lambda: None)
        self._thread.join(timeout)

    def _put(self, action: Callable[[], object]) -> None:
        """Queues an action; to be called with the lock."""
        self._unfinished += 1
        self._actions.put(action)

    def _run(self) -> None:
        while not self._closed:
            action = self._actions.get()
            self._run_one(action)
            with self._lock:
                self._unfinished -= 1

    def _run_one(self, action: Callable[[], object]) -> None:
        # A node that registers while it ends would take its name back from the node that
        # replaces it.
        if self._closed or rospy.core.is_shutdown_requested():
            return
        try:
            action()
        except Exception:
            _LOG.exception("cannot register or unregister a topic or service")
