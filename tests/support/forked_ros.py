"""Programs of ROS and the server node as forks of one process, which has imported them.

The programs spend most of their time on imports, and `roslaunch` runs `rosversion` twice. What
`roslaunch` itself starts is not forked.

Run as a program, this module is that process: it listens at the socket of its argument. A request
is a command, a folder, an environment and the streams. The responses are the process id of the
program and, at its end, its exit code.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import importlib
import json
import os
import select
import signal
import socket
import sys
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Any, Final

_FUNCTIONS: Final = {
    "flatland_server": ("flatland.ros.node", "main"),
    "roslaunch": ("roslaunch", "main"),
    "rosservice": ("rosservice", "rosservicemain"),
    "rostopic": ("rostopic", "rostopicmain"),
    "rosversion": ("rospkg.rosversion", "main"),
}
# What the node imports when it runs.
_IMPORTED: Final = (
    "flatland.node.served_world",
    "flatland.ros.transport.ros_transport",
    "flatland.plugins.diff_drive",
    "flatland.plugins.laser",
)
# Sends the command with its streams, and exits as it does.
_CLIENT: Final = """\
#!{python} -SE
import json, os, socket, sys
with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as server:
    server.connect({address!r})
    command = [os.path.basename(sys.argv[0]), *sys.argv[1:]]
    message = json.dumps([command, os.getcwd(), dict(os.environ)]).encode()
    socket.send_fds(server, [message], [0, 1, 2])
    server.recv(20)
    sys.exit(int(server.recv(20) or 1))
"""
_LONGEST_MESSAGE: Final = 1 << 18  # bytes
_PR_SET_NAME: Final = 15  # of prctl(2)


class Forks:
    """The process that forks."""

    def __init__(self, folder: Path, environment: Mapping[str, str]) -> None:
        """Starts the process.

        Args:
            folder: Folder for its socket, and its working folder.
            environment: All environment variables of the process.
        """
        # Not above, because the process itself would import pytest.
        from programs import Program

        self._environment = environment
        self._address = folder / "socket"
        command = [sys.executable, __file__, self._address]
        self._process = Program(command, env=environment, cwd=folder)
        self._process.wait_for_line("ready")

    def stop(self) -> None:
        """Stops the process."""
        self._process.stop()

    def write_programs(self, folder: Path) -> None:
        """Writes programs that fork to a folder, which is then the first one of `PATH`."""
        text = _CLIENT.format(python=sys.executable, address=str(self._address))
        for name in ("rosservice", "rostopic", "rosversion"):
            (folder / name).write_text(text)
            (folder / name).chmod(0o755)

    def start(self, command: Sequence[str], environment: Mapping[str, str]) -> ForkedProcess | None:
        """Starts a program, unless only a new process can be equivalent.

        Args:
            command: The program and its arguments.
            environment: All environment variables of the program.
        """
        changed = dict(environment.items() ^ self._environment.items())
        if any(name.startswith(("PYTHON", "LD_")) for name in changed):
            return None
        if Path(command[0]).name not in _FUNCTIONS:
            return None
        return ForkedProcess(self._address, command, environment)


class ForkedProcess:
    """A forked program, with those methods of `subprocess.Popen` that `Program` uses.

    Attributes:
        pid: Process id.
        stdin: None; the standard input is empty.
        stdout: What the program prints.
        stderr: What it prints to its standard error.
        returncode: The exit code, negative for a signal; None while the program runs.
    """

    def __init__(
        self, address: Path, command: Sequence[str], environment: Mapping[str, str]
    ) -> None:
        """Starts the program in the working folder of this process.

        Args:
            address: Socket of the process that forks.
            command: The program and its arguments.
            environment: All environment variables.
        """
        self.returncode: int | None = None
        self.stdin: IO[str] | None = None
        self._receiving = threading.Lock()
        self._server = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._server.connect(str(address))
        message = json.dumps([command, str(Path.cwd()), dict(environment)]).encode()
        outputs = os.pipe(), os.pipe()
        streams = [os.open(os.devnull, os.O_RDONLY), *(writing for _, writing in outputs)]
        socket.send_fds(self._server, [message], streams)
        for stream in streams:
            os.close(stream)
        self.stdout, self.stderr = (os.fdopen(reading, errors="replace") for reading, _ in outputs)
        self.pid = int(self._server.recv(20))

    def poll(self) -> int | None:
        """Returns the exit code, None while the program runs."""
        with self._receiving:
            if self.returncode is None and select.select([self._server], [], [], 0)[0]:
                self.returncode = int(self._server.recv(20) or -signal.SIGKILL)
                self._server.shutdown(socket.SHUT_RDWR)
        return self.returncode

    def wait(self) -> int:
        """Waits until the program ends and returns its exit code."""
        while (code := self.poll()) is None:
            select.select([self._server], [], [])
        return code

    def send_signal(self, number: signal.Signals) -> None:
        """Sends a signal to the program unless it has ended."""
        if self.poll() is None:
            os.kill(self.pid, number)


def _serve(address: str) -> None:
    """Forks for each request; returns in the process of a program, which is then to be run."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listener:
        listener.bind(address)
        listener.listen()
        signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # ends the processes that have responded
        print("ready", flush=True)
        while True:
            connection, _ = listener.accept()
            if os.fork() == 0:
                signal.signal(signal.SIGCHLD, signal.SIG_DFL)
                break
            connection.close()
    message, streams, _, _ = socket.recv_fds(connection, _LONGEST_MESSAGE, 3)
    program = os.fork()
    if program:
        for stream in streams:
            os.close(stream)
        connection.send(str(program).encode())
        _, status = os.waitpid(program, 0)
        with contextlib.suppress(OSError):  # the client has ended
            connection.send(str(os.waitstatus_to_exitcode(status)).encode())
        os._exit(0)
    connection.close()
    os.setsid()
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
        os.close(stream)
    sys.argv[:], folder, environment = json.loads(message)
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    name = Path(sys.argv[0]).name
    ctypes.CDLL(None).prctl(_PR_SET_NAME, name.encode())


def _run() -> int | str | None:
    """Runs the program of `sys.argv`, and returns its exit code."""
    module, function = _FUNCTIONS[Path(sys.argv[0]).name]
    run: Any = getattr(importlib.import_module(module), function)
    code: int | str | None = run()
    return code


if __name__ == "__main__":
    importlib.import_module("flatland.ros.rospy_import").defer_catkin()
    for name in (*(module for module, _ in _FUNCTIONS.values()), *_IMPORTED):
        importlib.import_module(name)
    gc.freeze()
    try:
        _serve(sys.argv[1])
    except KeyboardInterrupt:
        sys.exit()
    sys.exit(_run())
