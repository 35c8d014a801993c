"""Ctrl-C while foreign code runs."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def user_interrupts() -> Iterator[Callable[[], bool]]:
    """Distinguishes Ctrl-C from a KeyboardInterrupt that foreign code raises.

    Yields:
        A function that returns whether the process has received SIGINT since the start of the
        block. In worker processes and other threads, where Ctrl-C has no effect, it has not.
    """
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield lambda: False
        return
    is_received = False

    def handle(number: int, frame: FrameType | None) -> None:
        nonlocal is_received
        is_received = True
        before(number, frame)

    signal.signal(signal.SIGINT, handle)
    try:
        yield lambda: is_received
    finally:
        # Foreign code, or the handler before, may have set another one.
        if signal.getsignal(signal.SIGINT) is handle:
            signal.signal(signal.SIGINT, before)
