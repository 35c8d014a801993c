"""Forwards the log of flatland to rospy, that is, to the console and to `/rosout`.

The level of the logger `rosout` of the node applies, which the service `~set_logger_level` changes.
"""

from __future__ import annotations

import contextlib
import copy
import io
import logging
from collections.abc import Callable
from typing import Any, Final

import rospy
from rosgraph.roslogging import LoggingException, RosStreamHandler
from rospy.impl.paramserver import get_param_server_cache

from flatland.node.names import sendable_text

_TOPICS_PARAMETER: Final = "/rosout_disable_topics_generation"


class _ToRosout(logging.Handler):
    """Forwards records to the logger of rospy, preserving their source location."""

    def __init__(self) -> None:
        super().__init__()
        self._rosout = logging.getLogger("rosout")

    def emit(self, record: logging.LogRecord) -> None:
        if not self._rosout.isEnabledFor(record.levelno):
            return
        try:
            text = record.getMessage()
            sendable = sendable_text(text)
            if sendable != text:
                # rospy cannot publish it.
                record = copy.copy(record)
                record.msg, record.args = sendable, None
            self._rosout.handle(record)
        except Exception:
            self.handleError(record)


def log_without_file() -> None:
    """Makes `rospy.init_node` accept that no log file can be written; must be called before it.

    The log is then only shown on the screen and published. A folder or file without permission
    would be a traceback, and with a folder that cannot be created, nothing would be shown.
    """
    configure = rospy.core.configure_logging

    def configure_or_warn(*arguments: Any, **options: Any) -> None:
        try:
            configure(*arguments, **options)
        except (OSError, LoggingException) as error:
            _show_on_screen()
            logging.getLogger("rosout").warning(
                "the log is not written to a file: %s; set ROS_LOG_DIR to a folder in which this "
                "user may write",
                error,
            )
        else:
            if rospy.core._log_filename is None:  # rospy has written a warning
                _show_on_screen()

    rospy.core.configure_logging = configure_or_warn


def _show_on_screen() -> None:
    """Configures the logger of rospy as usual, without the file."""
    logger = logging.getLogger("rosout")
    logger.setLevel(logging.INFO)
    logger.addHandler(RosStreamHandler())


def _protect_handlers() -> None:
    """Makes the handlers of rospy accept any text, and ignore that a stream has been closed.

    Otherwise, the program that logs would get an exception.
    """
    for logger in (logging.getLogger("rosout"), logging.getLogger()):
        for handler in logger.handlers:
            if isinstance(handler, RosStreamHandler):
                handler._write = _without_os_errors(handler._write)
            elif isinstance(handler, logging.FileHandler):
                handler.errors = "backslashreplace"
                if isinstance(handler.stream, io.TextIOWrapper):
                    handler.stream.reconfigure(errors=handler.errors)


def _without_os_errors(write: Callable[..., None]) -> Callable[..., None]:
    def write_or_ignore(*arguments: Any) -> None:
        # The reader of the output has ended, or the disk is full.
        with contextlib.suppress(OSError):
            write(*arguments)

    return write_or_ignore


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
    _protect_handlers()
    if logger.level == logging.NOTSET:
        # All records: the level of rospy's logger decides.
        logger.setLevel(logging.DEBUG)
