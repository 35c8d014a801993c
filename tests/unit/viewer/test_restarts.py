"""Restarts of a viewer that crashes, with functions in place of the viewer."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from programs import Program
from waiting import wait_until

PROGRAM = """
import os, signal, sys, time
from pathlib import Path
from flatland.viewer.restarts import run_with_restarts

starts = Path(sys.argv[1])

def wait():
    while True:  # A handler in Python runs too late if the signal arrives just before a long sleep.
        time.sleep(0.01)

def run(disable_restarts, is_last_start):
    with starts.open("a") as file:
        print(os.getpid(), file=file)
    count = len(starts.read_text().split())
    {body}

sys.exit(run_with_restarts(run))
"""

CLOSED = "flatland_viz: RViz or OpenGL has crashed (SIGABRT) while the viewer was closed\n"


class Restarted(Program):
    """A program that runs a function with restarts."""

    def __init__(self, folder: Path, body: str) -> None:
        self._file = folder / "starts"
        command = [sys.executable, "-c", PROGRAM.format(body=body), self._file]
        super().__init__(command, cwd=folder)

    @property
    def starts(self) -> list[int]:
        """Process ids of all starts so far."""
        return list(map(int, self._file.read_text().split())) if self._file.exists() else []

    def wait_for_start(self) -> int:
        """Waits for the first start and returns its process id."""
        wait_until("a start", lambda: self.starts)
        return self.starts[0]

    def end(self) -> tuple[int, str]:
        """Waits for the end; returns the exit code and the messages."""
        return self.wait(), self.stderr


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[[str], Restarted]]:
    """Starts a program whose function has a body."""
    started: list[Restarted] = []

    def start(body: str) -> Restarted:
        started.append(Restarted(tmp_path, body))
        return started[-1]

    yield start
    for program in started:
        program.kill()


def test_the_exit_code_is_that_of_the_function(start):
    program = start("return 3")
    assert program.end() == (3, "")
    assert len(program.starts) == 1


def test_it_starts_again_after_a_crash(start):
    program = start("return os.kill(os.getpid(), 11) or 9 if count == 1 else 5")
    crash = "flatland_viz: RViz or OpenGL has crashed (SIGSEGV); the viewer starts again\n"
    assert program.end() == (5, crash)
    assert len(program.starts) == 2


def test_the_number_of_restarts_is_limited(start):
    program = start("print(is_last_start, file=sys.stderr, flush=True); os.abort()")
    code, messages = program.end()
    assert code == 128 + signal.SIGABRT
    assert [messages.count(f"{is_last}\n") for is_last in (False, True)] == [3, 1]
    assert messages.count("starts again") == 3
    assert messages.endswith("flatland_viz: RViz or OpenGL has crashed (SIGABRT) 4 times\n")
    assert len(program.starts) == 4


def test_a_killed_process_does_not_start_again(start):
    program = start("wait()")
    os.kill(program.wait_for_start(), signal.SIGKILL)
    assert program.end() == (128 + signal.SIGKILL, "")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_stop_signal_ends_the_child(start, number):
    program = start("wait()")
    program.wait_for_start()
    os.kill(program.pid, number)
    assert program.end() == (0, "")
    assert len(program.starts) == 1


def test_a_crash_on_a_stop_signal_is_the_end(start):
    crash = "signal.signal(15, lambda *_: os.abort())"
    program = start(f"{crash}; os.kill(os.getppid(), 15); wait()")
    assert program.end() == (0, CLOSED)
    assert len(program.starts) == 1


def test_a_crash_at_the_end_is_not_followed_by_a_restart(start):
    program = start("disable_restarts(); os.abort()")
    assert program.end() == (0, CLOSED)
    assert len(program.starts) == 1


def test_the_child_ends_with_its_parent(start):
    program = start("wait()")
    child = program.wait_for_start()
    os.kill(program.pid, signal.SIGKILL)
    program.end()

    def has_ended() -> bool:
        try:
            return Path(f"/proc/{child}/stat").read_text().split()[2] == "Z"
        except FileNotFoundError:
            return True

    wait_until("end of the child", has_ended)
