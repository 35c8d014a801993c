"""Talks to the ROS master in a thread of its own, so that nobody else waits for it.

Each topic and service costs a call to the master: a millisecond when it answers, and for as long
as it takes when it does not, since rospy tries again and again. The thread that steps the world
only says what it wants; things are done in that order.
"""

from __future__ import annotations

import logging
import queue
import threading
from collections import Counter
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
        self._users: Counter[tuple[str, str]] = Counter()
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

    def claim(self, kind: str, name: str, ros_type: type[Any], *, shared: bool = True) -> None:
        """Reserves a name; rospy itself would mix up two types of one name.

        Args:
            kind: `publisher`, `subscriber` or `service`.
            name: Resolved name.
            ros_type: The message or service class.
            shared: Whether others of the same type may have it as well.

        Raises:
            FlatlandError: The name has another type, or is taken.
        """
        key = kind, name
        with self._lock:
            known = self._types.setdefault(key, ros_type)
            if known is not ros_type:
                raise FlatlandError(
                    f'{kind} "{name}" has the type {known._type} already, not {ros_type._type}'
                )
            if self._users[key] and not shared:
                raise FlatlandError(f'{kind} "{name}" exists already')
            self._users[key] += 1

    def release(self, kind: str, name: str) -> None:
        """Gives back what `claim` reserved."""
        key = kind, name
        with self._lock:
            self._users[key] -= 1
            if not self._users[key]:
                del self._users[key], self._types[key]

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
