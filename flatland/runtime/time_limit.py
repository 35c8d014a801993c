"""A limit of wall time for code that may block, executed in the calling thread."""

from __future__ import annotations

import ctypes
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Final

_RETRY_PERIOD: Final = 0.1  # s, until code that catches everything has been left


class TimeLimitExceeded(BaseException):
    """The limit of wall time is exceeded; not an `Exception`, so that handlers do not catch it."""


@contextmanager
def time_limit(seconds: float | None) -> Iterator[None]:
    """Raises in the calling thread when the block takes too long.

    In the main thread, a signal (SIGALRM) interrupts Python code and system calls that wait, such
    as `sleep`, a socket or a lock. In other threads, only Python code is interrupted. Code of an
    extension that neither returns nor handles signals cannot be interrupted at all.

    Args:
        seconds: Limit of wall time [s]; None for no limit.

    Raises:
        TimeLimitExceeded: The block took longer.
    """
    if seconds is None:
        yield
    elif threading.current_thread() is threading.main_thread():
        with _signal_limit(seconds):
            yield
    else:
        with _exception_limit(seconds):
            yield


@contextmanager
def _signal_limit(seconds: float) -> Iterator[None]:
    is_active = True

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        if is_active:
            raise TimeLimitExceeded

    previous = signal.signal(signal.SIGALRM, interrupt)
    try:
        try:
            signal.setitimer(signal.ITIMER_REAL, min(seconds, threading.TIMEOUT_MAX), _RETRY_PERIOD)
            yield
        finally:
            # A signal that arrives from here on must not skip the rest of the clean-up.
            is_active = False
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, previous)


@contextmanager
def _exception_limit(seconds: float) -> Iterator[None]:
    thread = ctypes.c_ulong(threading.get_ident())
    finished = threading.Event()
    lock = threading.Lock()
    has_expired = False

    def raise_in_thread() -> None:
        exception = ctypes.py_object(TimeLimitExceeded)
        ctypes.pythonapi.PyThreadState_SetAsyncExc(thread, exception)

    def interrupt() -> None:
        nonlocal has_expired
        wait = min(seconds, threading.TIMEOUT_MAX)
        while not finished.wait(wait):
            with lock:
                if not finished.is_set():
                    has_expired = True
                    raise_in_thread()
            wait = _RETRY_PERIOD

    threading.Thread(target=interrupt, name="flatland-time-limit", daemon=True).start()
    try:
        yield
    finally:
        while not finished.is_set():
            # An exception of the limit can also be raised here.
            with suppress(TimeLimitExceeded), lock:
                finished.set()
        if has_expired:
            # Another exception may be pending. It must be raised, not cancelled: Python 3.11 does
            # not reset its request flag for a cancelled one. All code would then be slower, and
            # traced code would not proceed.
            with suppress(TimeLimitExceeded):
                raise_in_thread()
                while True:
                    pass
