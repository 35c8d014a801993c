"""Brings what flatland logs to the console and to `/rosout`, as rospy's own messages."""

from __future__ import annotations

import logging


class _ToRosout(logging.Handler):
    """Hands records on to rospy's logger, with the place that they came from."""

    def __init__(self) -> None:
        super().__init__()
        self._rosout = logging.getLogger("rosout")

    def emit(self, record: logging.LogRecord) -> None:
        if self._rosout.isEnabledFor(record.levelno):
            self._rosout.handle(record)


def log_to_ros() -> None:
    """Sends all that flatland logs through rospy, once; call it after `rospy.init_node`."""
    logger = logging.getLogger("flatland")
    # Records must not reach the root's handlers as well: rospy's logger passes them on there.
    logger.propagate = False
    logger.handlers = [_ToRosout()]
    if logger.level == logging.NOTSET:
        logger.setLevel(logging.INFO)
