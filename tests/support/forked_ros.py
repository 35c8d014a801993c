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


def write_programs(folder: Path, address: Path) -> None:
    """Writes the programs for a socket to a folder, which is then the first one of `PATH`."""
    for name in ("rosservice", "rostopic", "rosversion"):
        (folder / name).write_text(_CLIENT.format(python=sys.executable, address=str(address)))
        (folder / name).chmod(0o755)


def can_fork(
    command: Sequence[str], environment: Mapping[str, str], own: Mapping[str, str]
) -> bool:
    """Returns whether a fork is equivalent to a start of a program.

    Args:
        command: The program and its arguments.
        environment: The environment of the program.
        own: The environment of the process that forks.
    """
    changed = dict(environment.items() ^ own.items())
    is_known = Path(command[0]).name in _FUNCTIONS
    return is_known and not any(name.startswith(("PYTHON", "LD_")) for name in changed)


class ForkedProcess:
    """A forked program, with those methods of `subprocess.Popen` that `Program` uses.

    Attributes:
        pid: Process id.
        stdin: None; the standard input is empty.
        stdout: What the program prints, None if it prints to another stream.
        stderr: The same for its errors.
        returncode: The exit code, negative for a signal; None while the program runs.
    """

    def __init__(
        self,
        address: Path,
        command: Sequence[str],
        *,
        env: Mapping[str, str],
        cwd: Path | str | None = None,
    ) -> None:
        """Starts the program.

        Args:
            address: Socket of the process that forks.
            command: The program and its arguments.
            env: All environment variables.
            cwd: Working folder; None for that of this process.
        """
        self.returncode: int | None = None
        self.stdin: IO[str] | None = None
        self._receiving = threading.Lock()
        self._server = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._server.connect(str(address))
        message = json.dumps([command, str(cwd or Path.cwd()), dict(env)]).encode()
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
