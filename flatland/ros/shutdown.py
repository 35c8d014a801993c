"""Ends the node within a second of SIGINT or SIGTERM, whatever it is doing."""

from __future__ import annotations

import logging
import os
import signal
import socket
import threading
import time
from collections.abc import Callable
from typing import Final

_GRACE: Final = 0.6  # s that the node has to end by itself
_LAST_CALLS: Final = 0.2  # s for saying good-bye to the ROS master after that


class StopSignals:
    """Watches for SIGINT and SIGTERM in a thread of its own.

    Python runs signal handlers in the main thread only, and only between two of its own
    instructions: not while a large map is being loaded in C++. The thread hears of a signal at
    once, asks the node to stop, and ends the process if it does not do so in time.

    Attributes:
        received: Set with the first signal.
    """

    def __init__(self, on_stop: Callable[[], None], good_bye: Callable[[], None]) -> None:
        """Starts to watch; call it from the main thread.

        Args:
            on_stop: Called with the first signal, in the watching thread.
            good_bye: Called before the process is ended by force.
        """
        self.received = threading.Event()
        self._on_stop = on_stop
        self._good_bye = good_bye
        self._reading_end, self._writing_end = socket.socketpair()
        self._writing_end.setblocking(False)
        signal.set_wakeup_fd(self._writing_end.fileno(), warn_on_full_buffer=False)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: None)
        threading.Thread(target=self._watch, name="flatland-signals", daemon=True).start()

    def _watch(self) -> None:
        while self._reading_end.recv(1)[0] not in (signal.SIGINT, signal.SIGTERM):
            pass
        self.received.set()
        self._on_stop()
        time.sleep(_GRACE)
        # Still here: the main thread is busy in C++ or in a plugin that does not return.
        farewell = threading.Thread(target=self._good_bye, daemon=True)
        farewell.start()
        farewell.join(_LAST_CALLS)
        logging.shutdown()
        os._exit(0)
