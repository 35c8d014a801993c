"""A separate ROS master on a free port, and the programs that use it."""

from __future__ import annotations

import contextlib
import os
import re
import select
import shlex
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

import flatland

CHECKOUT = Path(__file__).resolve().parent.parent
TIMEOUT = 60.0  # s, for any event

_TICKS = os.sysconf("SC_CLK_TCK")


class Program:
    """A running program and its output."""

    def __init__(self, command: list[str], environment: Mapping[str, str]) -> None:
        """Starts the program in a new process group."""
        self.started = time.monotonic()
        self._text = ""
        self._popen = subprocess.Popen(
            command,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )

    @property
    def pid(self) -> int:
        """The process id."""
        return self._popen.pid

    def wait_for(self, pattern: str, timeout: float = TIMEOUT) -> re.Match[str]:
        """Waits until the output of the program contains a pattern.

        Args:
            pattern: Regular expression.
            timeout: Time limit [s].

        Returns:
            The first match.

        Raises:
            RuntimeError: The program has ended, or the time limit has expired.
        """
        end = time.monotonic() + timeout
        stream = self._popen.stdout
        assert stream is not None
        while True:
            match = re.search(pattern, self._text)
            if match:
                return match
            left = end - time.monotonic()
            ready = left > 0 and select.select([stream], [], [], left)[0]
            data = os.read(stream.fileno(), 65536) if ready else b""
            if not data:
                command = shlex.join(self._popen.args)
                raise RuntimeError(f"{pattern!r} not in the output of {command}:\n{self._text}")
            self._text += data.decode(errors="replace")

    def interrupt(self) -> None:
        """Sends the program an interrupt, without waiting for its end."""
        self._popen.send_signal(signal.SIGINT)

    def stop(self) -> None:
        """Interrupts the program, and kills what remains of its process group."""
        if self._popen.poll() is None:
            self._popen.send_signal(signal.SIGINT)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._popen.wait(10)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._popen.pid, signal.SIGKILL)
        self._popen.wait()
        if self._popen.stdout is not None:
            self._popen.stdout.close()


class RosSession:
    """A running ROS master and the environment of its nodes."""

    def __init__(self, environment: dict[str, str]) -> None:
        """Creates a session without programs; see `ros_session`."""
        self.environment = environment
        self._programs: list[Program] = []

    def start(self, *command: str) -> Program:
        """Starts a program, which is stopped at the end of the session."""
        program = Program(list(command), self.environment)
        self._programs.append(program)
        return program

    def launch(self, launch_file: str, **arguments: object) -> Program:
        """Starts a launch file of flatland."""
        given = [f"{name}:={value}" for name, value in arguments.items()]
        return self.start("roslaunch", "flatland", launch_file, *given)

    def server(self, **parameters: object) -> Program:
        """Starts the node without roslaunch, with private parameters."""
        given = [f"_{name}:={value}" for name, value in parameters.items()]
        script = CHECKOUT / "scripts" / "flatland_server"
        return self.start(sys.executable, str(script), *given)

    def stop(self, program: Program) -> None:
        """Stops a program of the session."""
        program.stop()
        self._programs.remove(program)

    def close(self) -> None:
        """Stops all programs, in reverse order of their start."""
        while self._programs:
            self._programs.pop().stop()


@contextlib.contextmanager
def ros_session(variables: Mapping[str, str] | None = None) -> Iterator[RosSession]:
    """Runs a ROS master; stops it and all programs at the end.

    Args:
        variables: Environment variables of the programs, in addition to those of a session; for
            another version of flatland.
    """
    with tempfile.TemporaryDirectory() as folder:
        session = RosSession({**_environment(Path(folder)), **(variables or {})})
        try:
            port = session.environment["ROS_MASTER_URI"].rsplit(":", 1)[1]
            session.start("roscore", "-p", port).wait_for("started core service")
            yield session
        finally:
            session.close()


def _environment(folder: Path) -> dict[str, str]:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    environment = {
        **os.environ,
        "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
        "ROS_IP": "127.0.0.1",
        "ROS_HOME": str(folder),
        "ROS_LOG_DIR": str(folder / "log"),
        "ROS_ETC_DIR": os.environ.get("ROS_ETC_DIR", "/etc/ros"),
        "ROS_VERSION": "1",
        "ROS_PYTHON_VERSION": "3",
        "ROS_DISTRO": os.environ.get("ROS_DISTRO", "Debian"),
        "PYTHONUNBUFFERED": "1",
    }
    environment.pop("ROS_HOSTNAME", None)
    # A start includes no compilation, as usual from the second one on.
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    package = Path(flatland.__file__).resolve().parent.parent
    if (package / "launch").is_dir():
        # flatland was imported from a source tree, which gets the layout of an installation.
        environment["PYTHONPATH"] = f"{package}:{os.environ.get('PYTHONPATH', '')}"
        environment["ROS_PACKAGE_PATH"] = f"{_overlay(package, folder)}:/usr/share"
    elif "ROS_PACKAGE_PATH" not in environment:
        environment["ROS_PACKAGE_PATH"] = f"{sys.prefix}/share:/usr/share"
    return environment


def _overlay(package: Path, folder: Path) -> Path:
    """Creates a package path with the installed layout of a source tree, and returns it."""
    share = folder / "share" / "flatland"
    (share / "scripts").mkdir(parents=True)
    for name in ("package.xml", "flatland_plugins.xml", "launch", "msg", "srv", "worlds"):
        (share / name).symlink_to(package / "catkin" / "flatland" / name)
    launcher = share / "scripts" / "flatland_server"
    script = package / "scripts" / "flatland_server"
    launcher.write_text(f'#!/bin/sh\nexec "{sys.executable}" "{script}" "$@"\n')
    launcher.chmod(0o755)
    return share.parent


def processor_time(pid: int) -> float:
    """Returns the processor time used by all threads of a process [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / _TICKS


def peak_memory(pid: int) -> float:
    """Returns the peak resident memory of a process [MB]."""
    status = Path(f"/proc/{pid}/status").read_text()
    match = re.search(r"VmHWM:\s+(\d+) kB", status)
    return int(match[1]) / 1024 if match else 0.0
