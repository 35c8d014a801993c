"""Stop requests, and a time limit for the node to react to one."""

from __future__ import annotations

import contextlib
import logging
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable
from typing import Final

from flatland.node.stacks import describe_stack

_LOG = logging.getLogger("flatland")

DEFAULT_SHUTDOWN_TIMEOUT: Final = 2.0  # s
_LAST_ACTION_TIMEOUT: Final = 2.0  # s, for each action that precedes a forced exit
_STOP_SIGNALS: Final = (signal.SIGINT, signal.SIGTERM)


class ShutdownWatchdog:
    """Stops the node on SIGINT and SIGTERM, and ends a process that does not stop in time.

    Python executes signal handlers in the main thread only, and only between two of its own
    instructions, so not while a large map is loaded in C++. A separate thread therefore reads the
    signals, requests the stop, and waits. If the process still runs after the time limit, it logs
    what is running and exits with code 1.

    Attributes:
        timeout: Limit of wall time between a stop request and the end of the process [s]; None
            for no limit.
    """

    def __init__(self, on_stop: Callable[[], None], unregister: Callable[[], None]) -> None:
        """Starts the thread; must be called in the main thread.

        Args:
            on_stop: Called in that thread when the first stop is requested.
            unregister: Unregisters the node from the ROS master; called before a forced exit.
        """
        self.timeout: float | None = DEFAULT_SHUTDOWN_TIMEOUT
        self._on_stop = on_stop
        self._unregister = unregister
        self._reading_end, self._writing_end = socket.socketpair()
        self._writing_end.setblocking(False)
        signal.set_wakeup_fd(self._writing_end.fileno(), warn_on_full_buffer=False)
        for number in _STOP_SIGNALS:
            signal.signal(number, lambda *_: None)
        threading.Thread(target=self._watch, name="flatland-watchdog", daemon=True).start()

    def request_stop(self) -> None:
        """Requests a stop, as a signal does; safe from any thread, never blocks."""
        with contextlib.suppress(BlockingIOError):  # A full buffer contains earlier requests.
            self._writing_end.send(bytes([signal.SIGTERM]))

    def _watch(self) -> None:
        while self._reading_end.recv(1)[0] not in _STOP_SIGNALS:
            pass
        self._on_stop()
        timeout = self.timeout
        if timeout is None:
            return
        time.sleep(min(timeout, threading.TIMEOUT_MAX))
        # The process still runs. Each action has a thread of its own, because it may block as
        # well, for example on a pipe or a lock.
        for action in (lambda: _log_running(timeout), self._unregister, logging.shutdown):
            thread = threading.Thread(target=action, daemon=True)
            thread.start()
            thread.join(_LAST_ACTION_TIMEOUT)
        os._exit(1)


def _log_running(timeout: float) -> None:
    _LOG.critical("not stopped within %g s, exiting; still running: %s", timeout, _running())


def _running() -> str:
    """Describes the code that keeps the process from ending, in one line."""
    main = threading.main_thread()
    threads = [main]
    if not main.is_alive():
        # Python waits for these threads after the main thread has ended.
        others = [t for t in threading.enumerate() if t.is_alive() and not t.daemon]
        threads = others or threads
    frames = sys._current_frames()
    return "; ".join(
        f"thread {thread.name}: {describe_stack(frames[thread.ident])}"
        for thread in threads
        if thread.ident in frames
    )
