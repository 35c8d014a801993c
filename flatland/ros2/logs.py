"""Forwards the log of flatland to rclpy, that is, to the console and to `/rosout`."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

from flatland.node.names import sendable_text


class _ToRcutils(logging.Handler):
    """Forwards records to a logger of rclpy."""

    def __init__(self, logger: Any) -> None:
        super().__init__()
        # rclpy refuses different levels in calls from the same line.
        self._functions: tuple[tuple[int, Callable[[str], object]], ...] = (
            (logging.CRITICAL, lambda text: logger.fatal(text)),
            (logging.ERROR, lambda text: logger.error(text)),
            (logging.WARNING, lambda text: logger.warning(text)),
            (logging.INFO, lambda text: logger.info(text)),
            (logging.NOTSET, lambda text: logger.debug(text)),
        )

    def emit(self, record: logging.LogRecord) -> None:
        try:
            text = sendable_text(self.format(record))
            next(log for level, log in self._functions if record.levelno >= level)(text)
        except Exception:
            self.handleError(record)


def log_to_ros(logger: Any) -> None:
    """Forwards the log of flatland to rclpy, whose levels apply.

    Args:
        logger: The logger of the node.
    """
    flatland = logging.getLogger("flatland")
    flatland.propagate = False
    flatland.handlers = [_ToRcutils(logger)]
    if flatland.level == logging.NOTSET:
        flatland.setLevel(logging.DEBUG)
