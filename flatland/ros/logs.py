"""Forwards the log of flatland to rospy, that is, to the console and to `/rosout`.

The level of the logger `rosout` of the node applies, which the service `~set_logger_level` changes.
"""

from __future__ import annotations

import logging


class _ToRosout(logging.Handler):
    """Forwards records to the logger of rospy, preserving their source location."""

    def __init__(self) -> None:
        super().__init__()
        self._rosout = logging.getLogger("rosout")

    def emit(self, record: logging.LogRecord) -> None:
        if self._rosout.isEnabledFor(record.levelno):
            self._rosout.handle(record)


def log_to_ros() -> None:
    """Forwards the log of flatland to rospy; must be called after `rospy.init_node`."""
    logger = logging.getLogger("flatland")
    # The logger of rospy propagates to the root logger already; avoid duplicate records.
    logger.propagate = False
    logger.handlers = [_ToRosout()]
    if logger.level == logging.NOTSET:
        # All records: the level of rospy's logger decides.
        logger.setLevel(logging.DEBUG)
