"""Time limits of all tests, and a function that waits for a condition.

The limits end tests whose event never occurs. They are generous, so that no test fails on a busy
machine; `bench/` measures speed.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Final

import pytest

TIMEOUT: Final = 120.0  # s; for any event and for the end of any program
BUILD_TIMEOUT: Final = 1200.0  # s; for a program that compiles the extension
_POLL_PERIOD: Final = 0.01  # s


def wait_until(
    what: str,
    condition: Callable[[], Any],
    timeout: float = TIMEOUT,
    *,
    poll_period: float = _POLL_PERIOD,
) -> Any:
    """Waits until a condition holds, for states that are not reported by an event.

    Args:
        what: Name of the condition, for the failure.
        condition: Returns a true value once it holds. A failed assertion in it is equivalent to a
            false value, and is part of the failure message.
        timeout: Limit [s].
        poll_period: Time between two calls of the condition [s].

    Returns:
        The value that the condition returned.
    """
    end = time.monotonic() + timeout
    while True:
        reason = ""
        try:
            if result := condition():
                return result
        except AssertionError as error:
            reason = f": {error}"
        if time.monotonic() > end:
            pytest.fail(f"{what}: not within {timeout} s{reason}")
        time.sleep(poll_period)
