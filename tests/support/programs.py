"""Programs that a test runs, ended with their output shown if they print nothing for too long."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import IO, Any, Final

import pytest

SILENCE: Final = 30.0
"""Limit of the time for which a program that a test waits for may print nothing [s]."""

_END_OF_OUTPUT: Final = 5.0  # s, for children that keep the output open after the program has ended
_ESCAPES: Final = re.compile(r"\x1b\[[0-9;]*m")


class Program:
    """A running program and what it has printed."""

    def __init__(
        self,
        command: Sequence[str | Path],
        *,
        env: Mapping[str, str] | None = None,
        cwd: Path | str | None = None,
        stdout: int = subprocess.PIPE,
        stderr: int = subprocess.PIPE,
        input: str = "",  # noqa: A002 - as subprocess
        process: Any = None,
    ) -> None:
        """Starts the program in a session of its own.

        Args:
            command: The program and its arguments.
            env: All environment variables; None for those of this process.
            cwd: Working folder; None for that of this process.
            stdout: File descriptor for the standard output, if it is not to be read.
            stderr: The same for the standard error; `subprocess.STDOUT` for that of `stdout`.
            input: Text for the standard input.
            process: The program, if it has been started already.
        """
        self.command = [str(word) for word in command]
        self.process = process or subprocess.Popen(
            self.command,
            env=env,
            cwd=cwd,
            stdin=subprocess.PIPE if input else subprocess.DEVNULL,
            stdout=stdout,
            stderr=stderr,
            text=True,
            errors="replace",
            start_new_session=True,
        )
        self.lines: list[str] = []
        self._stdout: list[str] = []
        self._stderr: list[str] = []
        self._changed = threading.Condition()
        self._last_output = time.monotonic()
        streams = (self.process.stdout, self._stdout), (self.process.stderr, self._stderr)
        self._readers = [
            threading.Thread(target=self._read, args=(stream, text), daemon=True)
            for stream, text in streams
            if stream is not None
        ]
        self._open_streams = len(self._readers)
        others = (self._write, input), (self._notify_of_end,)
        threads = [threading.Thread(target=f, args=given, daemon=True) for f, *given in others]
        for thread in (*self._readers, *threads):
            thread.start()

    def _write(self, text: str) -> None:
        # The program may end before it has read everything.
        with contextlib.suppress(BrokenPipeError):
            if self.process.stdin is not None:
                with self.process.stdin as stream:
                    stream.write(text)

    def _read(self, stream: IO[str], text: list[str]) -> None:
        with stream:
            for line in stream:
                with self._changed:
                    text.append(line)
                    self.lines.append(_ESCAPES.sub("", line.rstrip("\n")))
                    self._last_output = time.monotonic()
                    self._changed.notify_all()
        with self._changed:
            self._open_streams -= 1
            self._changed.notify_all()

    def _notify_of_end(self) -> None:
        self.process.wait()
        with self._changed:
            self._changed.notify_all()

    @property
    def pid(self) -> int:
        """The process id."""
        return self.process.pid

    @property
    def output(self) -> str:
        """All lines printed so far, without colours."""
        with self._changed:
            return "\n".join(self.lines)

    @property
    def stdout(self) -> str:
        """What has been printed to standard output so far."""
        with self._changed:
            return "".join(self._stdout)

    @property
    def stderr(self) -> str:
        """What has been printed to standard error so far."""
        with self._changed:
            return "".join(self._stderr)

    @property
    def running(self) -> bool:
        """Whether the program has not ended."""
        return self.process.poll() is None

    @property
    def children(self) -> list[int]:
        """Process ids of the children of the program."""
        path = Path(f"/proc/{self.pid}/task/{self.pid}/children")
        return list(map(int, path.read_text().split()))

    def wait_for_line(self, pattern: str, silence: float = SILENCE) -> re.Match[str]:
        """Waits for output that matches a pattern; fails after the end of the output.

        Args:
            pattern: Regular expression of one line or several.
            silence: Limit of the time without output [s].
        """
        found: re.Match[str] | None = None

        def is_printed() -> bool:
            nonlocal found
            found = re.search(pattern, "\n".join(self.lines), re.MULTILINE)
            return found is not None or not self._open_streams

        self._wait_for(is_printed, silence)
        if found is not None:
            return found
        self.kill()
        pytest.fail(f"{self} printed no line with {pattern!r}:\n{self.output}")

    def wait(self, silence: float = SILENCE) -> int:
        """Waits until the program ends and returns its exit code.

        Args:
            silence: Limit of the time without output [s].
        """
        self._wait_for(lambda: not self.running, silence)
        if self.running:
            self.kill()
            pytest.fail(f"{self} was running after {silence:g} s without output:\n{self.output}")
        for reader in self._readers:
            reader.join(_END_OF_OUTPUT)
        return self.process.returncode

    def _wait_for(self, condition: Callable[[], bool], silence: float) -> None:
        """Waits until a condition holds, or nothing has been printed for some time."""
        start = time.monotonic()
        with self._changed:
            while not condition():
                left = max(start, self._last_output) + silence - time.monotonic()
                if left <= 0:
                    return
                self._changed.wait(left)

    def send(self, number: signal.Signals) -> None:
        """Sends a signal."""
        self.process.send_signal(number)

    def stop(self) -> int:
        """Stops the program and its children as Ctrl-C does, and returns its exit code."""
        if self.running:
            os.killpg(self.pid, signal.SIGINT)
        return self.wait()

    def kill(self) -> None:
        """Kills the program and its children."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.pid, signal.SIGKILL)
        self.process.wait()

    def __str__(self) -> str:
        """Returns the command."""
        return " ".join(self.command)


def run_program(
    command: Sequence[str | Path], *, check: bool = False, silence: float = SILENCE, **options: Any
) -> subprocess.CompletedProcess[str]:
    """Runs a program to its end.

    Args:
        command: The program and its arguments.
        check: Whether an exit code other than 0 fails the test.
        silence: Limit of the time without output [s].
        options: Further arguments of `Program`.
    """
    program = Program(command, **options)
    code = program.wait(silence)
    if check and code:
        pytest.fail(f"{program} exited with {code}:\n{program.output}")
    return subprocess.CompletedProcess(program.command, code, program.stdout, program.stderr)


def output_of(
    command: Sequence[str | Path],
    environment: Mapping[str, str],
    folder: Path,
    silence: float = SILENCE,
) -> str:
    """Runs a command and returns what it prints; the test fails if the command fails.

    Args:
        command: The program and its arguments.
        environment: All environment variables.
        folder: Working folder.
        silence: Limit of the time without output [s].
    """
    options = {"env": environment, "cwd": folder, "stderr": subprocess.STDOUT}
    return run_program(command, check=True, silence=silence, **options).stdout
