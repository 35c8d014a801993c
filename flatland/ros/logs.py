"""Forwards the log of flatland to rospy, that is, to the console and to `/rosout`.

The level of the logger `rosout` of the node applies, which the service `~set_logger_level` changes.
"""

from __future__ import annotations

import logging
from typing import Final

import rospy
from rospy.impl.paramserver import get_param_server_cache

_TOPICS_PARAMETER: Final = "/rosout_disable_topics_generation"


class _ToRosout(logging.Handler):
    """Forwards records to the logger of rospy, preserving their source location."""

    def __init__(self) -> None:
        super().__init__()
        self._rosout = logging.getLogger("rosout")

    def emit(self, record: logging.LogRecord) -> None:
        if self._rosout.isEnabledFor(record.levelno):
            self._rosout.handle(record)


def log_to_ros() -> None:
    """Forwards the log of flatland to rospy; must be called after `rospy.init_node`.

    rospy calls the master for each message, as long as a parameter of `/rosout` is not set. A
    master that does not respond would block the thread that logs, for example the thread that
    steps the world. The call also registers the node again after another one has taken its name.
    The parameter is therefore read once.
    """
    get_param_server_cache().set(_TOPICS_PARAMETER, rospy.get_param(_TOPICS_PARAMETER, False))
    logger = logging.getLogger("flatland")
    # The logger of rospy propagates to the root logger already; avoid duplicate records.
    logger.propagate = False
    logger.handlers = [_ToRosout()]
    if logger.level == logging.NOTSET:
        # All records: the level of rospy's logger decides.
        logger.setLevel(logging.DEBUG)
