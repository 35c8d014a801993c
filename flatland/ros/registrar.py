"""Talks to the ROS master in a thread of its own, so that nobody else waits for it.

Each topic and service costs a call to the master: a millisecond when it answers, and for as long
as it takes when it does not, since rospy tries again and again. The thread that steps the world
only says what it wants; things are done in that order.
"""

from __future__ import annotations

import logging
import queue
import threading
from collections.abc import Callable
from typing import Any

import rospy

from flatland.errors import FlatlandError

_LOG = logging.getLogger("flatland")


class Registrar:
    """Registers and unregisters topics and services, one after the other."""

    def __init__(self) -> None:
        """Starts the thread."""
        self._actions: queue.SimpleQueue[Callable[[], object]] = queue.SimpleQueue()
        self._closed = False
        self._lock = threading.Lock()
        self._types: dict[tuple[str, str], type[Any]] = {}
        self._owners: dict[tuple[str, str], list[str]] = {}
        self._thread = threading.Thread(target=self._run, name="flatland-registrar", daemon=True)
        self._thread.start()

    def submit(self, action: Callable[[], object]) -> None:
        """Does something after all that was submitted before; returns at once."""
        self._actions.put(action)

    def flush(self, timeout: float) -> bool:
        """Waits until all is done that was submitted before.

        Args:
            timeout: How long to wait at most [s].

        Returns:
            Whether it is done.
        """
        done = threading.Event()
        self.submit(done.set)
        return done.wait(timeout)

    def claim(
        self, kind: str, name: str, ros_type: type[Any], owner: str, *, shared: bool = True
    ) -> None:
        """Reserves a name; rospy itself would mix up two types of one name.

        Args:
            kind: `publisher`, `subscriber` or `service`.
            name: Resolved name.
            ros_type: The message or service class.
            owner: Plugin that uses the name, for messages; empty for the node itself.
            shared: Whether others of the same type may have it as well.

        Raises:
            FlatlandError: The name has another type, or is taken.
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
        """Gives back what `claim` reserved."""
        key = kind, name
        with self._lock:
            self._owners[key].remove(owner)
            if not self._owners[key]:
                del self._owners[key], self._types[key]

    def close(self, timeout: float) -> None:
        """Drops what is not done yet and ends; rospy unregisters all at once at shutdown.

        Args:
            timeout: How long to wait for what is being done [s].
        """
        self._closed = True
        self.submit(lambda: None)
        self._thread.join(timeout)

    def _run(self) -> None:
        while not self._closed:
            action = self._actions.get()
            if self._closed or rospy.is_shutdown():
                continue
            try:
                action()
            except Exception:
                _LOG.exception("a topic or service could not be registered")
