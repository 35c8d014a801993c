"""Limits of what the clients of a server can cause: connections, and warnings in the log."""

from __future__ import annotations

import errno
import logging
import resource
import time
from typing import Final

_LOG = logging.getLogger("flatland")

EXHAUSTED: Final = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)
"""Errors of accepting a connection that pass once others are closed."""
EXHAUSTED_PERIOD: Final = 0.1
"""Time after such an error until a connection is accepted again [s]."""
ACCEPTED_AT_ONCE: Final = 64
"""Largest number of connections that a server accepts before it serves them."""
_WARNING_PERIOD: Final = 1.0  # s between two equal warnings


def connection_limit(most: int) -> int:
    """Returns a limit for a server: a quarter of the files that the process may open at most.

    Args:
        most: The limit if the process may open enough files.
    """
    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return most if soft == resource.RLIM_INFINITY else min(most, soft // 4)


class LimitedLog:
    """Logs warnings, and equal warnings once a second at most."""

    def __init__(self) -> None:
        """Creates a log without warnings."""
        self._last = ""
        self._due = 0.0

    def warn(self, text: str) -> None:
        """Logs a warning, unless it repeats the last one within a second."""
        now = time.monotonic()
        if text != self._last or now >= self._due:
            self._last, self._due = text, now + _WARNING_PERIOD
            _LOG.warning("%s", text)
