"""teleop_key in a real terminal, and teleop.launch."""

from __future__ import annotations

import os
import pty
import re
import select
import signal
import subprocess
import termios
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import roslaunch.config
import roslib.packages
import rospkg
from geometry_msgs.msg import Twist
from waiting import TIMEOUT, wait_until

TOPIC = "/flatland_tests/cmd_vel"
REMAPPED = f"cmd_vel:={TOPIC}"


class Terminal:
    """A program in a terminal of its own, as in a shell."""

    def __init__(self, command: list[str], environment: dict[str, str]) -> None:
        self._master, self._slave = pty.openpty()
        self.attributes = termios.tcgetattr(self._slave)
        self.text = ""
        self.process = subprocess.Popen(
            command,
            env=environment,
            stdin=self._slave,
            stdout=self._slave,
            stderr=self._slave,
            start_new_session=True,
            preexec_fn=self._control,
        )
        self._closed = threading.Event()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _control(self) -> None:
        # The terminal controls the session of the program, so that Ctrl-C is a signal.
        os.close(os.open(os.ttyname(0), os.O_RDWR))

    def _read(self) -> None:
        while not self._closed.is_set():
            if select.select([self._master], [], [], 0.05)[0]:
                try:
                    self.text += os.read(self._master, 4096).decode(errors="replace")
                except OSError:
                    return

    def press(self, keys: bytes) -> None:
        os.write(self._master, keys)

    def hold(self, key: bytes, until: Callable[[], bool]) -> None:
        """Repeats a key as a terminal does, until a condition holds."""
        end = time.monotonic() + TIMEOUT
        self.press(key)
        while not until():
            assert time.monotonic() < end
            time.sleep(0.03)  # the period of the repetitions
            self.press(key)

    def until(self, pattern: str) -> None:
        wait_until(pattern, lambda: re.search(pattern, self.text))

    @property
    def current_attributes(self) -> Any:
        return termios.tcgetattr(self._slave)

    def wait(self) -> int:
        return self.process.wait(TIMEOUT)

    def hang_up(self) -> None:
        """Closes the terminal."""
        self._closed.set()
        self._reader.join(TIMEOUT)
        os.close(self._slave)
        os.close(self._master)
        self._master = self._slave = -1

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        if self._master >= 0:
            self.hang_up()


@pytest.fixture
def terminal(launcher: Any) -> Iterator[Callable[..., Terminal]]:
    terminals: list[Terminal] = []

    def start(*command: str) -> Terminal:
        terminals.append(Terminal(list(command), launcher.environment))
        return terminals[-1]

    yield start
    for terminal in terminals:
        terminal.close()


@pytest.fixture(scope="module")
def teleop_path(ros_environment: dict[str, str]) -> str:
    """The program that rosrun starts as teleop_key."""
    packages = rospkg.RosPack(ros_environment["ROS_PACKAGE_PATH"].split(":"))
    return str(roslib.packages.find_node("flatland", "teleop_key", packages)[0])


@pytest.fixture
def teleop(terminal: Callable[..., Terminal], teleop_path: str, ros: Any) -> tuple[Terminal, Any]:
    """A teleoperation that a subscriber has connected to; a single press counts for 2 s."""
    program = terminal(teleop_path, REMAPPED, "_max_linear:=0.8", "_repeat_delay:=2")
    commands = ros.topic(TOPIC, Twist)
    program.until(f"{TOPIC}: ")  # without "(no subscriber)"
    return program, commands


def velocity(message: Twist) -> tuple[float, float]:
    return message.linear.x, message.angular.z


def is_zero(message: Twist) -> bool:
    return velocity(message) == (0.0, 0.0)


def test_keys_drive_and_release_stops(teleop: tuple[Terminal, Any]) -> None:
    program, commands = teleop
    assert program.current_attributes != program.attributes
    assert "Hold a key to drive" in program.text
    # A held key is published repeatedly, and its release once. Ctrl-Z and Ctrl-S are ignored.
    program.press(b"\x1a\x13w")
    moving = [commands.next()]
    while not is_zero(moving[-1]):
        moving.append(commands.next())
    assert len(moving) > 2
    assert {velocity(message) for message in moving[:-1]} == {(0.4, 0.0)}
    # An arrow key at another speed, stopped by the space key before its time has elapsed.
    program.press(b"++\x1b[D")
    assert velocity(commands.next()) == (0.0, pytest.approx(1.4))
    program.press(b" ")
    commands.until(is_zero)
    program.until(r"\+0\.00 m/s \+0\.00 rad/s, speed 70% \(0\.56 m/s, 1\.40 rad/s\)")
    program.press(b"\x03")
    assert program.wait() == 0
    assert program.current_attributes == program.attributes
    wait_until("the end of the connection", lambda: not commands.connected)
    assert commands.is_empty
    assert "Traceback" not in program.text


def test_a_signal_stops_the_robot_and_restores_the_terminal(teleop: tuple[Terminal, Any]) -> None:
    program, commands = teleop
    program.press(b"w")
    commands.until(lambda message: not is_zero(message))
    program.process.send_signal(signal.SIGTERM)
    commands.until(is_zero)
    assert program.wait() == 0
    assert program.current_attributes == program.attributes
    assert "Traceback" not in program.text


def test_a_closed_terminal_stops_the_robot(teleop: tuple[Terminal, Any]) -> None:
    """As when a connection by ssh ends."""
    program, commands = teleop
    program.press(b"w")
    commands.next()
    program.hang_up()
    commands.until(is_zero)
    assert program.wait() == 0


def test_teleop_launch_runs_in_the_terminal(terminal: Callable[..., Terminal], ros: Any) -> None:
    program = terminal(
        "roslaunch", "flatland", "teleop.launch", f"cmd_vel:={TOPIC}", "max_angular:=3"
    )
    commands = ros.topic(TOPIC, Twist)
    program.until(f"{TOPIC}: ")
    messages: list[tuple[float, float]] = []

    def has_driven() -> bool:
        messages.extend(map(velocity, commands.rest(0)))
        return len(messages) > 5

    program.hold(b"a", has_driven)
    # On a busy machine, the key may count as released in between.
    assert messages[0] == (0.0, 1.5)
    assert set(messages) <= {(0.0, 1.5), (0.0, 0.0)}
    commands.until(is_zero)
    program.press(b"\x03")
    program.wait()
    assert program.current_attributes == program.attributes


def test_the_joystick_is_configured(
    checkout: Path, ros_environment: dict[str, str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """With packages of the same names, since Debian has none of them."""
    given = "joystick:=true max_linear:=0.3 max_angular:=0.7 enable_button:=4 joy_dev:=/dev/js1"
    files = [(str(checkout / "launch" / "teleop.launch"), given.split())]

    def load(packages: str) -> Any:
        monkeypatch.setenv("ROS_PACKAGE_PATH", packages)
        monkeypatch.setattr("roslaunch.substitution_args._rospack", None)
        return roslaunch.config.load_config_default(files, None, verbose=False)

    known = ros_environment["ROS_PACKAGE_PATH"]
    with pytest.raises(Exception, match=r"package was not found.*: joy"):
        load(known)
    for package in ("joy", "teleop_twist_joy"):
        (tmp_path / package).mkdir()
        text = f"<package><name>{package}</name></package>"
        (tmp_path / package / "package.xml").write_text(text)
    config = load(f"{tmp_path}:{known}")
    assert {node.name for node in config.nodes} == {"joy", "teleop_twist_joy"}
    found = {name: param.value for name, param in config.params.items()}
    assert found["/joy/dev"] == "/dev/js1"
    assert found["/teleop_twist_joy/scale_linear"] == 0.3
    assert found["/teleop_twist_joy/scale_angular"] == 0.7
    assert found["/teleop_twist_joy/enable_button"] == 4
