"""Runs the viewer in a child process, and starts it again after a crash.

RViz and OpenGL run inside the viewer, and a crash in them cannot be handled in the same process.
"""

from __future__ import annotations

import ctypes
import mmap
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

STOP_SIGNALS: Final = (signal.SIGINT, signal.SIGTERM)
_CRASHES: Final = frozenset(
    {signal.SIGABRT, signal.SIGBUS, signal.SIGFPE, signal.SIGILL, signal.SIGSEGV}
)
_MAX_STARTS: Final = 4
_PR_SET_PDEATHSIG: Final = 1  # of prctl(2)


@contextmanager
def stop_signals_blocked() -> Iterator[None]:
    """Delays stop signals of this thread, and blocks them in threads that it starts meanwhile."""
    signal.pthread_sigmask(signal.SIG_BLOCK, STOP_SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, STOP_SIGNALS)


def run_with_restarts(run: Callable[[Callable[[], None], bool], int]) -> int:
    """Runs a function in a child process, and again if the process crashes.

    Stop signals are forwarded to the child, where they raise `SystemExit` unless the function has
    installed other handlers. The child ends with this process. To be called before other threads
    are started.

    Args:
        run: Returns an exit code. Its arguments are a function that disables restarts, to be
            called before the end, and whether this is the last start.

    Returns:
        In the child, the exit code of the function. In this process, the exit code of the child, or
        128 plus the number of the signal that ended it; 0 if it crashed after a stop signal or with
        restarts disabled.
    """
    is_stopped = False
    disabled = mmap.mmap(-1, 1)  # shared with the child; not 0 if restarts are disabled
    parent = os.getpid()
    # They remain blocked here: a handler in Python would run too late if the signal arrived just
    # before `waitpid` blocks. The end of the child is a signal as well.
    waited = {*STOP_SIGNALS, signal.SIGCHLD}
    signal.pthread_sigmask(signal.SIG_BLOCK, waited)
    for start in range(1, _MAX_STARTS + 1):
        if signal.sigpending() & set(STOP_SIGNALS):
            return 0
        sys.stdout.flush()
        sys.stderr.flush()
        child = os.fork()
        if child == 0:
            for number in STOP_SIGNALS:
                signal.signal(number, lambda *_: sys.exit(0))
            _end_with(parent)
            signal.pthread_sigmask(signal.SIG_UNBLOCK, waited)
            return run(lambda: disabled.__setitem__(0, 1), start == _MAX_STARTS)
        while (ended := os.waitpid(child, os.WNOHANG))[0] == 0:
            received = signal.sigwait(waited)
            if received in STOP_SIGNALS:
                is_stopped = True
                os.kill(child, received)  # It exists until it has been waited for.
        _, status = ended
        code = os.waitstatus_to_exitcode(status)
        if -code not in _CRASHES:
            break
        is_last = is_stopped or disabled[0] != 0
        if is_last:
            consequence = " while the viewer was closed"
        elif start < _MAX_STARTS:
            consequence = "; the viewer starts again"
        else:
            consequence = f" {_MAX_STARTS} times"
        name = signal.Signals(-code).name
        print(f"flatland_viz: RViz or OpenGL has crashed ({name}){consequence}", file=sys.stderr)
        if is_last:
            return 0
    return code if code >= 0 else 128 - code


def _end_with(parent: int) -> None:
    """Ends this process when its parent ends, in a process group of its own.

    The terminal and roslaunch send signals to the group of the parent, which forwards them.
    """
    os.setsid()
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() != parent:
        os._exit(0)
