"""Chromium's DevTools protocol through the pipes of a headless browser.

See "Chrome DevTools Protocol": each message is JSON, ends with a null byte, and belongs to the
browser or to a session, such as that of a page.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import select
import signal
import subprocess
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

_TIMEOUT: Final = 60.0  # s; for the response to a command, which includes the end of a script
_END_TIMEOUT: Final = 10.0  # s; until a browser ends that was closed
_LOG_SIZE: Final = 5000  # characters of the log of the browser in an error
_LEAST_DESCRIPTOR: Final = 10  # above those of the browser
# The browser reads commands from descriptor 3 and writes messages to descriptor 4.
_START: Final = 'exec "$@" 3<&{reading} 4>&{writing}'


class DevToolsError(AssertionError):
    """A command has failed. `wait_until` repeats it: the page may have been left for another."""


class DevTools:
    """A browser that is controlled through the protocol."""

    def __init__(self, command: Sequence[str], log: Path, on_event: Callable[[Any], None]) -> None:
        """Starts the browser.

        Args:
            command: The browser and its arguments.
            log: File for the output of the browser.
            on_event: Called for each event, while the response to a command is awaited.
        """
        self._log = log
        self._on_event = on_event
        self._number = 0
        self._received = b""
        reading, self._output = _pipe()
        self._input, writing = _pipe()
        start = _START.format(reading=reading, writing=writing)
        with log.open("wb") as stream:
            self._process = subprocess.Popen(
                ["/bin/bash", "-c", start, "bash", *command, "--remote-debugging-pipe"],
                pass_fds=[reading, writing],
                stdout=stream,
                stderr=stream,
                start_new_session=True,
            )
        os.close(reading)
        os.close(writing)

    def call(self, method: str, session: str = "", /, **parameters: Any) -> Any:
        """Sends a command and returns its result.

        Args:
            method: Domain and name of the command.
            session: Identifier of a session, empty for the browser.
            parameters: Parameters of the command.

        Raises:
            DevToolsError: The command has failed.
            RuntimeError: The browser has ended or does not respond. It is ended; the log is part of
                the message.
        """
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if session:
            message["sessionId"] = session
        end = time.monotonic() + _TIMEOUT
        with contextlib.suppress(BrokenPipeError):  # found by `_receive`
            _write(self._output, json.dumps(message).encode() + b"\0")
        while (response := self._receive(end)).get("id") != self._number:
            self._on_event(response)
        if "error" in response:
            raise DevToolsError(f"{method}: {response['error']['message']}")
        return response["result"]

    def wait_for(self, is_done: Callable[[], bool]) -> None:
        """Receives events until a condition holds that depends on them.

        Raises:
            RuntimeError: As `call`, also if the condition does not hold within some time.
        """
        end = time.monotonic() + _TIMEOUT
        while not is_done():
            self._on_event(self._receive(end))

    def _receive(self, end: float) -> Any:
        """Returns the next message."""
        parts = []
        while b"\0" not in self._received:
            parts.append(self._received)
            if not select.select([self._input], [], [], max(end - time.monotonic(), 0.0))[0]:
                raise self._failure(f"the browser does not respond within {_TIMEOUT:g} s")
            self._received = os.read(self._input, 1 << 20)
            if not self._received:
                raise self._failure("the browser has ended")
        last, _, self._received = self._received.partition(b"\0")
        return json.loads(b"".join([*parts, last]))

    def _failure(self, reason: str) -> RuntimeError:
        """Ends the browser, and returns an exception with its log."""
        self.kill()
        log = self._log.read_text(errors="replace")[-_LOG_SIZE:]
        return RuntimeError(f"{reason}\n{self._log}:\n{log}")

    def close(self) -> None:
        """Ends the browser."""
        with contextlib.suppress(RuntimeError):
            self.call("Browser.close")
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_END_TIMEOUT)
        self.kill()
        os.close(self._input)
        os.close(self._output)

    def kill(self) -> None:
        """Kills the browser and its processes."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()


def _pipe() -> tuple[int, int]:
    """Returns the ends of a new pipe."""
    ends = os.pipe()
    reading, writing = (fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, _LEAST_DESCRIPTOR) for end in ends)
    for end in ends:
        os.close(end)
    return reading, writing


def _write(output: int, data: bytes) -> None:
    while data:
        data = data[os.write(output, data) :]
