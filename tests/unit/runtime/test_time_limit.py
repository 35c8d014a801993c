"""Limits of wall time: interruption of code, and its effects."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future

import pytest
from waiting import TIMEOUT

from flatland.runtime.time_limit import TimeLimitExceeded, time_limit

LIMIT = 0.05


def loop() -> None:
    while True:
        pass


def stubborn_loop() -> None:
    interruptions = 0
    while interruptions < 3:
        try:
            loop()
        except BaseException:
            interruptions += 1
    loop()


def receive() -> None:
    reader, _writer = socket.socketpair()
    with reader, _writer:
        reader.recv(1)


def in_thread(run: Callable[[], object]) -> BaseException | None:
    """Runs a function in a new thread and returns its exception."""
    done: Future[None] = Future()

    def call() -> None:
        try:
            run()
        except BaseException as error:
            done.set_exception(error)
        else:
            done.set_result(None)

    threading.Thread(target=call, daemon=True).start()
    return done.exception()


def limited(run: Callable[[], object]) -> None:
    with time_limit(LIMIT):
        run()


@pytest.mark.parametrize(
    "block",
    [loop, stubborn_loop, receive, lambda: time.sleep(1e6), lambda: threading.Event().wait()],
    ids=["loop", "stubborn loop", "socket", "sleep", "lock"],
)
def test_code_that_blocks_the_main_thread_is_interrupted(block: Callable[[], object]) -> None:
    handler = signal.getsignal(signal.SIGALRM)
    with pytest.raises(TimeLimitExceeded):
        limited(block)
    assert signal.getsignal(signal.SIGALRM) is handler
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


@pytest.mark.parametrize("block", [loop, stubborn_loop])
def test_python_code_in_another_thread_is_interrupted(block: Callable[[], object]) -> None:
    assert isinstance(in_thread(lambda: limited(block)), TimeLimitExceeded)


@pytest.mark.parametrize("in_main_thread", [False, True])
def test_code_that_returns_in_time_is_not_interrupted(in_main_thread: bool) -> None:
    def run() -> None:
        for _ in range(20):
            with time_limit(10):
                pass
        with pytest.raises(KeyError), time_limit(10):
            raise KeyError

    if in_main_thread:
        run()
    else:
        assert in_thread(run) is None


def test_without_a_limit_nothing_is_interrupted() -> None:
    with time_limit(None):
        assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


@pytest.mark.parametrize("run", [lambda: None, loop], ids=["in time", "too late"])
def test_code_can_be_traced_after_a_limit_in_a_thread(run: Callable[[], object]) -> None:
    """In Python 3.11, a cancelled exception would keep traced code from proceeding."""
    code = f"""
import sys, threading
from flatland.runtime.time_limit import TimeLimitExceeded, time_limit

def limited():
    try:
        with time_limit(0.05):
            {"pass" if run is not loop else "while True: pass"}
    except TimeLimitExceeded:
        print("limited")

thread = threading.Thread(target=limited)
thread.start()
thread.join()
sys.settrace(lambda *arguments: None)
print(sum(number for number in range(10)))
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=TIMEOUT, check=True
    )
    assert done.stdout.split() == ([] if run is not loop else ["limited"]) + ["45"]
