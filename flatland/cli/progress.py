"""Progress of commands that take long, and their interruption."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any


@contextmanager
def progress_bar(seconds: float) -> Iterator[Callable[[float, float], None]]:
    """Shows a progress bar on the standard error output if it is a terminal.

    Args:
        seconds: Simulated time at the end.

    Yields:
        A function of the additional simulated time [s] and the real-time factor.
    """
    try:
        from tqdm import tqdm
    except ImportError:  # `flatland doctor` reports it
        yield lambda _seconds, _factor: None
        return
    form = "{percentage:3.0f}%|{bar}| {n:.1f}/{total:.1f} s [{elapsed}<{remaining}{postfix}]"
    with tqdm(total=seconds, bar_format=form, disable=None, file=sys.stderr) as bar:

        def advance(more: float, factor: float) -> None:
            bar.set_postfix_str(f"{factor:.1f}x real time", refresh=False)
            bar.update(more)

        yield advance


@contextmanager
def counting_bar(total: int, unit: str) -> Iterator[Callable[[str], None]]:
    """Shows a progress bar of a number of equal parts, as `progress_bar`.

    Args:
        total: Number of parts.
        unit: Name of a part.

    Yields:
        A function that counts a part; its argument is shown beside the bar.
    """
    try:
        from tqdm import tqdm
    except ImportError:
        yield lambda _text: None
        return
    with tqdm(total=total, unit=unit, disable=None, file=sys.stderr) as bar:

        def advance(text: str) -> None:
            bar.set_postfix_str(text, refresh=False)
            bar.update()

        yield advance


class StopSignals:
    """Replaces the handlers of SIGINT and SIGTERM; the first signal only ends the simulation.

    A second signal has its usual effect.

    Attributes:
        signal: The signal that was received, 0 for none.
    """

    def __init__(self) -> None:
        self.signal = 0
        self._previous: dict[int, Any] = {}

    def __enter__(self) -> StopSignals:
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                self._previous[number] = signal.signal(number, self._handle)
        return self

    def __exit__(self, *_: object) -> None:
        self._restore()

    def _handle(self, number: int, _frame: FrameType | None) -> None:
        self.signal = number
        self._restore()

    def _restore(self) -> None:
        while self._previous:
            signal.signal(*self._previous.popitem())
