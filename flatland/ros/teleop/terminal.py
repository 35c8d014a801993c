"""A terminal that reports each key at once, and the signals that end a program."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import termios
from typing import Final

_STOP_SIGNALS: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
_IFLAG, _LFLAG, _CC = 0, 3, 6  # indices of the attributes of a terminal


class KeyInput:
    """Makes a terminal report keys without echo for the duration of a block.

    The keys that would suspend the program (Ctrl-Z) or the output (Ctrl-S) are disabled: a robot
    keeps its last command while its teleoperation is suspended.
    """

    def __init__(self, fd: int) -> None:
        """Reads the attributes of the terminal, which the end of the block restores.

        Args:
            fd: File descriptor of the terminal.
        """
        self._fd = fd
        self._saved = termios.tcgetattr(fd)

    def __enter__(self) -> KeyInput:
        """Changes the attributes."""
        attributes = termios.tcgetattr(self._fd)
        attributes[_LFLAG] &= ~(termios.ICANON | termios.ECHO)
        attributes[_IFLAG] &= ~termios.IXON
        characters = attributes[_CC]
        characters[termios.VMIN], characters[termios.VTIME] = 1, 0
        characters[termios.VSUSP] = bytes([os.fpathconf(self._fd, "PC_VDISABLE")])
        termios.tcsetattr(self._fd, termios.TCSADRAIN, attributes)
        return self

    def __exit__(self, *error: object) -> None:
        """Restores the attributes and discards keys that were not read."""
        with contextlib.suppress(termios.error):  # The terminal was closed.
            termios.tcsetattr(self._fd, termios.TCSAFLUSH, self._saved)

    def read(self) -> bytes:
        """Returns the input that is available; empty if the terminal was closed."""
        try:
            return os.read(self._fd, 1024)
        except OSError:
            return b""

    def fileno(self) -> int:
        """Returns the file descriptor, for `select`."""
        return self._fd


class StopRequests:
    """A file that becomes readable when a signal or another thread requests a stop."""

    def __init__(self) -> None:
        """Handles the signals from now on; must be called in the main thread."""
        self._reading_end, self._writing_end = socket.socketpair()
        self._writing_end.setblocking(False)
        signal.set_wakeup_fd(self._writing_end.fileno(), warn_on_full_buffer=False)
        for number in _STOP_SIGNALS:
            signal.signal(number, lambda *_: None)

    def request(self) -> None:
        """Requests a stop; safe from any thread."""
        with contextlib.suppress(BlockingIOError):
            self._writing_end.send(b"\0")

    def fileno(self) -> int:
        """Returns the file descriptor, for `select`."""
        return self._reading_end.fileno()
