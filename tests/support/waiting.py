"""Waiting for events: the only place that limits how long a test waits.

The limits exist to end a test whose event never occurs. They are generous on purpose, so that a
test does not fail because the machine is busy; how fast the simulator is belongs into `bench/`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Final

import pytest

TIMEOUT: Final = 120.0  # s; for any event, and for any program that is expected to end
BUILD_TIMEOUT: Final = 1200.0  # s; for a program that compiles the extension
_POLL_PERIOD: Final = 0.01  # s


def wait_until(
    what: str,
    condition: Callable[[], Any],
    timeout: float = TIMEOUT,
    *,
    poll_period: float = _POLL_PERIOD,
) -> Any:
    """Waits until a condition holds; for states that no event announces.

    Args:
        what: Name of the condition, for the failure.
        condition: Returns a true value once it holds; an assertion that fails in it means the same
            as a false value and is shown with the failure.
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
