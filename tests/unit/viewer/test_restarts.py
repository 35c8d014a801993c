"""Restarts of a viewer that crashes, with functions in place of the viewer."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from waiting import TIMEOUT, wait_until

PROGRAM = """
import os, signal, sys, time
from pathlib import Path
from flatland.viewer.restarts import run_with_restarts

starts = Path(sys.argv[1])

def wait():
    while True:  # A handler in Python runs too late if the signal arrives just before a long sleep.
        time.sleep(0.01)

def run(disable_restarts):
    with starts.open("a") as file:
        print(os.getpid(), file=file)
    count = len(starts.read_text().split())
    {body}

sys.exit(run_with_restarts(run))
"""

CLOSED = "flatland_viz: RViz or OpenGL has crashed (SIGABRT) while the viewer was closed\n"


class Program:
    """A program that runs a function with restarts."""

    def __init__(self, folder: Path, body: str) -> None:
        self._starts = folder / "starts"
        self._process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM.format(body=body), self._starts],
            stderr=subprocess.PIPE,
            text=True,
            cwd=folder,
            start_new_session=True,
        )

    @property
    def pid(self) -> int:
        return self._process.pid

    def children(self) -> list[int]:
        """Process ids of all starts so far."""
        return list(map(int, self._starts.read_text().split())) if self._starts.exists() else []

    def wait_for_starts(self, count: int) -> int:
        """Waits for a number of starts, and returns the process id of the last one."""
        wait_until(f"{count} starts", lambda: len(self.children()) >= count)
        return self.children()[-1]

    def end(self) -> tuple[int, str]:
        """Waits for the end; returns the exit code and the messages."""
        _, messages = self._process.communicate(timeout=TIMEOUT)
        return self._process.returncode, messages

    def kill(self) -> None:
        if self._process.poll() is None:
            self._process.kill()
            self._process.communicate()


@pytest.fixture
def programs() -> Iterator[list[Program]]:
    started: list[Program] = []
    yield started
    for program in started:
        program.kill()


def start(programs: list[Program], folder: Path, body: str) -> Program:
    programs.append(Program(folder, body))
    return programs[-1]


def test_the_exit_code_is_that_of_the_function(programs, tmp_path):
    program = start(programs, tmp_path, "return 3")
    assert program.end() == (3, "")
    assert len(program.children()) == 1


def test_it_starts_again_after_a_crash(programs, tmp_path):
    program = start(programs, tmp_path, "return os.kill(os.getpid(), 11) or 9 if count == 1 else 5")
    code, messages = program.end()
    assert code == 5
    assert messages == (
        "flatland_viz: RViz or OpenGL has crashed (SIGSEGV); the viewer starts again\n"
    )
    assert len(program.children()) == 2


def test_the_number_of_restarts_is_limited(programs, tmp_path):
    program = start(programs, tmp_path, "os.abort()")
    code, messages = program.end()
    assert code == 128 + signal.SIGABRT
    assert messages.count("starts again") == 3
    assert messages.endswith("flatland_viz: RViz or OpenGL has crashed (SIGABRT) 4 times\n")
    assert len(program.children()) == 4


def test_a_killed_process_does_not_start_again(programs, tmp_path):
    program = start(programs, tmp_path, "wait()")
    os.kill(program.wait_for_starts(1), signal.SIGKILL)
    assert program.end() == (128 + signal.SIGKILL, "")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_stop_signal_ends_the_child(programs, tmp_path, number):
    program = start(programs, tmp_path, "wait()")
    program.wait_for_starts(1)
    os.kill(program.pid, number)
    assert program.end() == (0, "")
    assert len(program.children()) == 1


def test_a_crash_on_a_stop_signal_is_the_end(programs, tmp_path):
    crash = "signal.signal(15, lambda *_: os.abort())"
    program = start(programs, tmp_path, f"{crash}; os.kill(os.getppid(), 15); wait()")
    assert program.end() == (0, CLOSED)
    assert len(program.children()) == 1


def test_a_crash_at_the_end_is_not_followed_by_a_restart(programs, tmp_path):
    program = start(programs, tmp_path, "disable_restarts(); os.abort()")
    assert program.end() == (0, CLOSED)
    assert len(program.children()) == 1


def test_the_child_ends_with_its_parent(programs, tmp_path):
    program = start(programs, tmp_path, "wait()")
    child = program.wait_for_starts(1)
    os.kill(program.pid, signal.SIGKILL)
    program.end()

    def has_ended() -> bool:
        try:
            return Path(f"/proc/{child}/stat").read_text().split()[2] == "Z"
        except FileNotFoundError:
            return True

    wait_until("end of the child", has_ended)
