"""Programs that a run starts: their output, and their end together with the run."""

from __future__ import annotations

import contextlib
import ctypes
import os
import re
import signal
import subprocess
import threading
import uuid
from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

MARK: Final = "FLATLAND_RUN"
"""Variable of the environment that all processes of a run inherit."""
_PR_SET_CHILD_SUBREAPER: Final = 36  # of linux/prctl.h
_ENDED: Final = (b"Z", b"X")  # states of processes that have ended, but are not collected
_LINES: Final = 8  # of the output that are kept
_MAX_LINE: Final = 300  # characters
_CHUNK: Final = 1 << 16  # bytes
_END_TIMEOUT: Final = 5.0  # s between a request to end and the signal KILL
_COLOURS: Final = re.compile(r"\x1b(\[[0-9;]*[A-Za-z]|\][^\x07]*\x07)")
# The limit of the memory of a worker process is not meant for its programs.
_UNLIMITED: Final = ("sh", "-c", 'ulimit -S -v "$(ulimit -H -v)"; exec "$@"', "sh")


def new_mark() -> str:
    """Returns a value of `MARK` that no other process has."""
    return uuid.uuid4().hex


def adopt_orphans() -> None:
    """Makes this process the parent of its descendants whose own parent has ended."""
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def end_marked(mark: str, leader: int = 0, socket: int = 0) -> None:
    """Ends all processes of a run by the signal KILL, except for the current process.

    These are the processes with a mark in their environment, those in the session of a process,
    those that have inherited a socket from it by a fork, and all descendants of these.

    Args:
        mark: Value of `MARK`, which programs inherit.
        leader: The process that leads their session, and is ended as well; 0 for none.
        socket: Inode of the socket; 0 for none.
    """
    # A process may start another one meanwhile.
    while processes := _processes_of(f"{MARK}={mark}".encode(), leader, f"socket:[{socket}]"):
        for process in processes:
            with contextlib.suppress(OSError):
                os.kill(process, signal.SIGKILL)


def _processes_of(wanted: bytes, leader: int, socket: str) -> set[int]:
    parents: dict[int, int] = {}
    found = set()
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            # After the name in parentheses, which may contain anything.
            status = (folder / "stat").read_bytes().rpartition(b")")[2].split()
            state, process = status[0], int(folder.name)
            if state in _ENDED:
                continue
            parents[process], session = int(status[1]), int(status[3])
            if (
                (leader and leader in (process, session))
                or wanted in (folder / "environ").read_bytes().split(b"\0")
                or _has_inherited(folder, socket)
            ):
                found.add(process)
    new = found
    while new:
        new = {process for process, parent in parents.items() if parent in new} - found
        found |= new
    return found - {os.getpid()}


def _has_inherited(folder: Path, socket: str) -> bool:
    """Returns whether a process executes the program of this one, and has a socket."""
    if (folder / "exe").readlink() != Path("/proc/self/exe").readlink():
        return False
    return any(file.readlink().name == socket for file in (folder / "fd").iterdir())


class Program:
    """A program with all the processes that it starts."""

    def __init__(self, command: Sequence[str], environment: Mapping[str, str], folder: str) -> None:
        """Starts the program.

        Args:
            command: Its path and arguments.
            environment: Variables in addition to those of this process.
            folder: The folder that it is started in.

        Raises:
            OSError: It cannot be started.
        """
        self._mark = os.environ.get(MARK) or new_mark()
        self._process = subprocess.Popen(  # noqa: S603 - the user names the program
            [*_UNLIMITED, *command],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env={**os.environ, **environment, MARK: self._mark},
            cwd=folder or None,
            start_new_session=True,
        )
        self._lines: deque[str] = deque(maxlen=_LINES)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def exit_code(self) -> int | None:
        """Exit code, negative for a signal; None while the program runs."""
        return self._process.poll()

    @property
    def last_lines(self) -> str:
        """The last lines of the output."""
        return " | ".join(self._lines)

    def end(self) -> None:
        """Requests the program to end, and ends the processes that remain after some seconds."""
        if self._process.poll() is None:
            self._process.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(_END_TIMEOUT)
        end_marked(self._mark)
        self._process.wait()
        self._reader.join()
        if self._process.stdout is not None:
            self._process.stdout.close()

    def _read(self) -> None:
        """Keeps the last lines until all processes have closed the output."""
        if self._process.stdout is None:
            return
        rest = b""
        while data := os.read(self._process.stdout.fileno(), _CHUNK):
            *lines, rest = (rest + data).split(b"\n")
            rest = rest[-_MAX_LINE:]
            for line in lines[-_LINES:]:
                text = _COLOURS.sub("", line[:_CHUNK].decode(errors="replace")).strip()
                if text:
                    self._lines.append(text[:_MAX_LINE])
