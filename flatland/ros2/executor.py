"""Runs the callbacks of a node in a thread."""

from __future__ import annotations

import logging
import threading
from typing import Any, Final

from rclpy.exceptions import InvalidHandle
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future

_LOG = logging.getLogger("flatland")

_SPIN_PERIOD: Final = 3600.0  # s
_END_TIMEOUT: Final = 0.5  # s, for the callback in progress at the end


class ExecutorThread:
    """Runs the callbacks of a node in a thread, until `close`."""

    def __init__(self, node: Node) -> None:
        """Starts the thread.

        Args:
            node: The node.
        """
        # Not the experimental EventsExecutor: the process crashes when connections are closed while
        # others are opened.
        self._executor: Any = SingleThreadedExecutor()
        self._executor.add_node(node)
        self._end = Future(executor=self._executor)
        self._thread = threading.Thread(target=self._run, name="flatland-executor", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Ends the thread."""
        self._end.set_result(None)
        self._executor.wake()
        self._thread.join(_END_TIMEOUT)

    def _run(self) -> None:
        while not self._end.done():
            try:
                self._executor.spin_until_future_complete(self._end, _SPIN_PERIOD)
            except InvalidHandle:
                pass  # An event of a connection that has just been closed.
            except Exception:
                _LOG.exception("unexpected internal error in a callback")
