"""Warnings about input that may be repeated at a high rate."""

from __future__ import annotations

import logging
import math
import time
from typing import Final

_LOG = logging.getLogger("flatland")

WARNING_PERIOD: Final = 1.0  # s of wall time between two warnings, at least


class OccasionalWarning:
    """Logs warnings of one source, and omits a warning that follows another one too soon."""

    def __init__(self) -> None:
        """Creates a source that has logged nothing."""
        self._last = -math.inf

    def log(self, text: str, *arguments: object) -> None:
        """Logs a warning, at most one a second.

        Args:
            text: Text with the format specifiers of `logging`.
            arguments: Its arguments.
        """
        now = time.monotonic()
        if now - self._last >= WARNING_PERIOD:
            self._last = now
            _LOG.warning(text, *arguments)
