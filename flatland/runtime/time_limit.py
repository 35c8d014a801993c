"""A limit of wall time for code that may block, executed in the calling thread."""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType
from typing import Any, Final, TypeVar

T = TypeVar("T")

_RETRY_PERIOD: Final = 0.1  # s, until code that catches everything has been left


class TimeLimitExceeded(BaseException):
    """The limit of wall time is exceeded; not an `Exception`, so that handlers do not catch it."""


def call_with_limit(seconds: float | None, action: Callable[[], T]) -> T:
    """Returns the result of a function, which is interrupted if it takes too long.

    In the main thread, a signal (SIGALRM) interrupts Python code and system calls that wait, such
    as `sleep`, a socket or a lock. The signal is repeated if the function catches the exception. An
    alarm that the program has set is delayed until the function returns.

    Other threads receive no signals. There, a trace function compares the time with the limit
    before each line of Python code. Calls that wait are not interrupted, and neither is
    code that catches the exception. The function runs more slowly, and debuggers do not stop in it.

    Code of an extension that neither returns nor handles signals cannot be interrupted at all.

    Args:
        seconds: Limit of wall time [s]; None for no limit.
        action: The function.

    Raises:
        TimeLimitExceeded: The function took longer.
    """
    if seconds is None:
        return action()
    if threading.current_thread() is threading.main_thread():
        return _call_with_signal(min(seconds, threading.TIMEOUT_MAX), action)
    return _call_traced(seconds, action)


def _call_with_signal(seconds: float, action: Callable[[], T]) -> T:
    is_active = True

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        if is_active:
            raise TimeLimitExceeded

    start = time.monotonic()
    left, period = signal.setitimer(signal.ITIMER_REAL, 0)
    previous = signal.signal(signal.SIGALRM, interrupt)
    try:
        try:
            signal.setitimer(signal.ITIMER_REAL, seconds, _RETRY_PERIOD)
            return action()
        finally:
            # A signal that arrives from here on must not skip the rest of the clean-up.
            is_active = False
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, previous)
        if left:
            left -= time.monotonic() - start
            # 0 would discard an alarm that is due.
            signal.setitimer(signal.ITIMER_REAL, max(left, 1e-6), period)


def _call_traced(seconds: float, action: Callable[[], T]) -> T:
    deadline = time.monotonic() + seconds

    def trace(_frame: FrameType, _event: str, _argument: object) -> Any:
        if time.monotonic() > deadline:
            raise TimeLimitExceeded
        return trace

    previous = sys.gettrace()
    sys.settrace(trace)  # for functions that are called from here on, not for this one
    try:
        return action()
    finally:
        sys.settrace(previous)
