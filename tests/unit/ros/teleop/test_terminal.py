"""A terminal whose other end is the test, and requests to stop."""

from __future__ import annotations

import os
import pty
import select
import signal
import socket
import termios
from collections.abc import Iterator
from typing import Any

import pytest

from flatland.ros.teleop.terminal import KeyInput, StopRequests

LFLAG, IFLAG, CC = 3, 0, 6


@pytest.fixture
def ends() -> Iterator[tuple[int, int]]:
    """The end of the user and that of the program."""
    user, program = pty.openpty()
    yield user, program
    for each in (user, program):
        try:
            os.close(each)
        except OSError:  # closed by the test
            continue


def test_keys_are_reported_at_once_without_echo(ends: tuple[int, int]) -> None:
    user, program = ends
    before = termios.tcgetattr(program)
    assert before[LFLAG] & termios.ICANON
    assert before[LFLAG] & termios.ECHO
    key_input = KeyInput(program)
    with key_input as entered:
        assert entered is key_input
        assert key_input.fileno() == program
        during = termios.tcgetattr(program)
        assert during[LFLAG] == before[LFLAG] & ~(termios.ICANON | termios.ECHO)
        assert during[IFLAG] == before[IFLAG] & ~termios.IXON
        characters = during[CC]
        # At least one key for each read, and no time limit.
        assert characters[termios.VMIN] == 1
        assert characters[termios.VTIME] == 0
        assert characters[termios.VSUSP] == b"\0"
        os.write(user, b"w\x1a\x13")
        assert key_input.read() == b"w\x1a\x13"
        os.write(user, b"x" * 2000)
        assert len(key_input.read()) == 1024
    assert termios.tcgetattr(program) == before
    # Keys that were not read are not left to the shell.
    assert select.select([program], [], [], 0)[0] == []


def test_a_closed_terminal_has_no_keys_and_is_not_restored(ends: tuple[int, int]) -> None:
    user, program = ends
    with KeyInput(program) as key_input:
        os.close(user)
        assert key_input.read() == b""
        os.close(program)
        assert key_input.read() == b""


@pytest.fixture
def signals(monkeypatch: pytest.MonkeyPatch) -> dict[int, Any]:
    """The handlers that are installed, by signal; those of the process stay."""
    handlers: dict[int, Any] = {}
    monkeypatch.setattr(
        signal, "signal", lambda number, handler: handlers.update({number: handler})
    )
    monkeypatch.setattr(
        signal,
        "set_wakeup_fd",
        lambda fd, warn_on_full_buffer: handlers.update({-1: (fd, warn_on_full_buffer)}),
    )
    return handlers


def test_signals_and_requests_make_the_file_readable(signals: dict[int, Any]) -> None:
    stop = StopRequests()
    assert set(signals) == {-1, signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT}
    assert signals[signal.SIGTERM](signal.SIGTERM, None) is None  # ends no system call
    fd, warns = signals[-1]
    assert not warns
    assert not os.get_blocking(fd)
    assert select.select([stop], [], [], 0)[0] == []
    os.write(fd, b"\x0f")
    assert select.select([stop], [], [], 0)[0] == [stop]
    assert stop._reading_end.recv(10) == b"\x0f"
    stop.request()
    assert select.select([stop], [], [], 0)[0] == [stop]


def test_requests_never_block(signals: dict[int, Any]) -> None:
    del signals
    stop = StopRequests()
    stop._writing_end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1)
    for _ in range(10_000):  # more than the file can hold
        stop.request()
    assert select.select([stop], [], [], 0)[0] == [stop]
