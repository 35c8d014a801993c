"""Calls to the ROS master in a separate thread, so that no other thread blocks on it.

Each topic and service costs a call to the master. The call takes a millisecond if the master
responds, and otherwise blocks until it does, because rospy retries indefinitely. The thread that
steps the world only queues these calls; they are made in the order in which they were queued.
"""

from __future__ import annotations

import contextlib
import logging
import queue
import threading
from collections.abc import Callable, Mapping
from typing import Any

import rospy

from flatland.errors import FlatlandError

_LOG = logging.getLogger("flatland")


class Registrar:
    """Registers and unregisters topics and services in order.

    Attributes:
        master_lost: Whether the ROS master is known not to respond.
    """

    def __init__(self) -> None:
        """Starts the thread."""
        self._actions: queue.SimpleQueue[Callable[[], object]] = queue.SimpleQueue()
        self._unfinished = 0  # actions in the queue, and the one that is carried out
        self._closed = False
        self.master_lost = False
        self._lock = threading.Lock()
        self._types: dict[tuple[str, str], type[Any]] = {}
        self._owners: dict[tuple[str, str], list[str]] = {}
        # Parameters by resolved name: as the node found them, and as it has set them.
        self._found_parameters: dict[str, object] = {}
        self._own_parameters: dict[str, object] = {}
        self._thread = threading.Thread(target=self._run, name="flatland-registrar", daemon=True)
        self._thread.start()

    def submit(self, action: Callable[[], object]) -> None:
        """Queues an action and returns immediately."""
        with self._lock:
            self._unfinished += 1
        self._actions.put(action)

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
        self, kind: str, name: str, ros_type: type[Any], owner: str, *, shared: bool = True
    ) -> None:
        """Reserves a name, because rospy does not detect two types of the same name.

        Args:
            kind: `publisher`, `subscriber` or `service`.
            name: Resolved name.
            ros_type: Message or service class.
            owner: Plugin that uses the name, for messages; empty for the node itself.
            shared: Whether the name may have other owners with the same type.

        Raises:
            FlatlandError: The name has another type, or cannot be shared.
        """
        key = kind, name
        with self._lock:
            known = self._types.setdefault(key, ros_type)
            owners = self._owners.setdefault(key, [])
            used_by = f", used by {owners[0]}" if owners and owners[0] else ""
            if known is not ros_type:
                raise FlatlandError(
                    f'{kind} "{name}" has the type {known._type} already{used_by}, '
                    f"not {ros_type._type}"
                )
            if owners and not shared:
                raise FlatlandError(f'{kind} "{name}" exists already{used_by}')
            owners.append(owner)

    def release(self, kind: str, name: str, owner: str) -> None:
        """Releases a name reserved by `claim`."""
        key = kind, name
        with self._lock:
            self._owners[key].remove(owner)
            if not self._owners[key]:
                del self._owners[key], self._types[key]

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
