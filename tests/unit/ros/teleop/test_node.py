"""The loop of the teleoperation with a pipe as its terminal, and its start."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any
from unittest.mock import ANY

import pytest

from flatland.node.parameters import TeleopParameters
from flatland.ros.teleop import node
from flatland.ros.teleop.held_key import HeldKey
from flatland.ros.teleop.node import USAGE, _Teleoperation

PERIOD = 0.1


def twist() -> Any:
    return SimpleNamespace(
        linear=SimpleNamespace(x=0.0, y=0.0), angular=SimpleNamespace(x=0.0, z=0.0)
    )


class Publisher:
    """A topic whose subscriber is the test.

    Attributes:
        sent: Linear and angular velocity of each message.
    """

    topic = "/cmd_vel"
    connected = True

    def __init__(self) -> None:
        self.sent: list[tuple[float, float]] = []

    def publish(self, message: Any) -> None:
        self.sent.append((message.linear.x, message.angular.z))


class Terminal:
    """Keys and time: each wait of the loop is a step of the script of the test.

    Attributes:
        script: Steps: the time by which the clock advances [s], and what is ready then: keys, None
            if nothing is, or `stop`.
        timeouts: The limits of the waits [s].
        written: What the loop has written.
    """

    STOP = object()

    def __init__(self) -> None:
        self.script: list[tuple[float, Any]] = []
        self.timeouts: list[float] = []
        self.written = ""
        self.now = 10.0
        self._keys: bytes = b""

    def select(self, watched: list[Any], _w: Any, _x: Any, timeout: float) -> Any:
        key_input, stop = watched
        assert key_input is self
        self.timeouts.append(round(timeout, 6))
        advance, ready = self.script.pop(0)
        self.now += advance
        if ready is Terminal.STOP:
            return [stop], [], []
        if ready is None:
            return [], [], []
        self._keys = ready
        return [key_input], [], []

    def read(self) -> bytes:
        return self._keys

    def write(self, text: str) -> None:
        self.written += text

    def __enter__(self) -> Terminal:
        return self

    def __exit__(self, *_: object) -> None:
        self.write("(restored)")


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    terminal = Terminal()
    monkeypatch.setattr(node, "time", SimpleNamespace(monotonic=lambda: terminal.now))
    monkeypatch.setattr(node, "select", terminal)
    monkeypatch.setattr(node, "_write", terminal.write)
    return terminal


@pytest.fixture
def publisher() -> Publisher:
    return Publisher()


@pytest.fixture
def run(terminal: Terminal, publisher: Publisher) -> Callable[..., _Teleoperation]:
    """Runs the loop with a script, with velocities of 0.5 m/s and 1 rad/s."""
    keys = HeldKey(1.0, 2.0, repeat_delay=0.25, key_timeout=0.25)
    teleoperation = _Teleoperation(keys, publisher, twist, PERIOD)  # type: ignore[arg-type]

    def run(*script: tuple[float, Any]) -> _Teleoperation:
        terminal.script = list(script)
        teleoperation.run(terminal, object())  # type: ignore[arg-type]
        assert terminal.script == []
        return teleoperation

    return run


def test_a_held_key_is_published_at_the_rate_and_its_release_once(
    run: Any, terminal: Terminal, publisher: Publisher
) -> None:
    run(
        (0.0, b"q"),
        (0.04, None),  # too early for the next message
        (0.06, None),
        (0.1, None),
        (0.05, None),  # released
        (0.5, None),
        (0.5, Terminal.STOP),
    )
    assert publisher.sent == [(0.5, 1.0)] * 3 + [(0.0, 0.0)]
    assert terminal.timeouts == [0.5, 0.1, 0.06, 0.1, 0.05, 0.5, 0.5]


def test_a_change_is_published_at_once(run: Any, publisher: Publisher) -> None:
    run((0.0, b"w"), (0.01, b"d"), (0.01, b" "), (0.01, b"w "), (0.0, Terminal.STOP))
    assert publisher.sent == [(0.5, 0.0), (0.0, -1.0), (0.0, 0.0)]


def test_the_wait_is_never_negative(run: Any, terminal: Terminal, publisher: Publisher) -> None:
    run((0.0, b"w"), (0.2, b"w"), (0.2, Terminal.STOP))
    assert terminal.timeouts == [0.5, 0.1, 0.1]
    publisher.connected = False  # only the status changes
    run((0.0, Terminal.STOP))


def test_an_arrow_key_may_arrive_in_parts_and_an_escape_key_is_no_part(
    run: Any, publisher: Publisher
) -> None:
    run((0.0, b"\x1b"), (0.0, b"[A"), (0.0, b"x\x1b"), (0.0, None), (0.0, b"[A"), (0.0, b"\x04"))
    # Forwards, the stop key, and the letter after the escape key: left.
    assert publisher.sent == [(0.5, 0.0), (0.0, 0.0), (0.0, 1.0)]


@pytest.mark.parametrize("end", [b"\x03", b"\x04", b"", Terminal.STOP])
def test_the_end_publishes_zero_if_the_robot_moves(
    run: Any, publisher: Publisher, end: Any
) -> None:
    # A key after the end is ignored.
    teleoperation = run((0.0, b"w"), (0.0, end + b"a" if end and end is not Terminal.STOP else end))
    assert publisher.sent == [(0.5, 0.0)]
    for _ in range(2):
        teleoperation.stop()
    assert publisher.sent == [(0.5, 0.0), (0.0, 0.0)]


def test_the_status_is_written_when_it_changes(
    run: Any, terminal: Terminal, publisher: Publisher
) -> None:
    publisher.connected = False
    run((0.0, None), (0.0, b"e"), (0.01, None), (0.0, Terminal.STOP))
    publisher.connected = True
    run((0.0, b"-"), (0.0, Terminal.STOP))
    lines = terminal.written.split("\r\x1b[K")
    speed = "speed 50% (0.50 m/s, 1.00 rad/s)"
    assert lines == [
        "",
        f"/cmd_vel (no subscriber): +0.00 m/s +0.00 rad/s, {speed}",
        f"/cmd_vel (no subscriber): +0.50 m/s -1.00 rad/s, {speed}",
        f"/cmd_vel: +0.50 m/s -1.00 rad/s, {speed}",
        "/cmd_vel: +0.40 m/s -0.80 rad/s, speed 40% (0.40 m/s, 0.80 rad/s)",
    ]


# -- the start -------------------------------------------------------------------------------------


@pytest.fixture
def ros(
    master: Any, monkeypatch: pytest.MonkeyPatch, terminal: Terminal, publisher: Publisher
) -> list[Any]:
    """Replaces the node, of which a process has one; returns the calls."""
    import rospy

    from flatland.ros import logs
    from flatland.ros.transport import publisher as publishers
    from flatland.ros.transport import registrar

    calls: list[Any] = []

    def record(name: str, result: Any = None) -> Callable[..., Any]:
        def call(*arguments: Any, **options: Any) -> Any:
            calls.append((name, *arguments, *options.items()))
            return result

        return call

    node_registrar = SimpleNamespace(flush=record("flush"))
    monkeypatch.setattr(rospy, "init_node", record("node"))
    monkeypatch.setattr(rospy, "on_shutdown", record("on shutdown"))
    monkeypatch.setattr(rospy, "signal_shutdown", record("shutdown"))
    monkeypatch.setattr(logs, "log_to_ros", record("log"))
    monkeypatch.setattr(registrar, "Registrar", lambda: node_registrar)
    monkeypatch.setattr(publishers, "Publisher", record("advertise", publisher))
    monkeypatch.setattr(node, "StopRequests", lambda: SimpleNamespace(request="stop"))
    monkeypatch.setattr(node, "KeyInput", record("terminal", terminal))
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(isatty=lambda: True, fileno=lambda: 7))
    return calls


def test_the_program_starts_drives_and_ends(
    ros: list[Any], terminal: Terminal, publisher: Publisher
) -> None:
    import rospy
    from geometry_msgs.msg import Twist

    parameters = {"max_linear": 0.4, "max_angular": 3.0, "rate": 10.0, "key_timeout": 0.3}
    rospy.set_param(rospy.get_name(), parameters)
    terminal.script = [
        (0.0, b"q"),
        (0.0, None),
        (0.1, b"q"),
        (0.29, None),
        (0.02, None),
        (0.0, b"c"),
        (0.0, Terminal.STOP),
    ]
    assert node.main() == 0
    options = [("anonymous", True), ("disable_signals", True), ("disable_rostime", True)]
    assert ros == [
        ("node", "teleop_key", *options),
        ("log",),
        ("on shutdown", "stop"),
        ("advertise", ANY, "cmd_vel", Twist),
        ("flush", 5.0),
        ("terminal", 7),
        ("shutdown", "end of the teleoperation"),
    ]
    assert publisher.sent == [(0.2, 1.5)] * 3 + [(0.0, 0.0), (-0.2, 1.5), (0.0, 0.0)]
    assert terminal.timeouts[1] == 0.1  # the period
    assert terminal.written.startswith(f"{USAGE}\n\r")
    assert terminal.written.endswith("(restored)\n")


def test_a_program_that_fails_stops_the_robot(
    ros: list[Any], terminal: Terminal, publisher: Publisher
) -> None:
    terminal.script = [(0.0, b"w")]  # then the wait fails
    with pytest.raises(IndexError):
        node.main()
    assert publisher.sent == [(TeleopParameters().max_linear / 2, 0.0), (0.0, 0.0)]
    assert terminal.written.endswith("(restored)\n")
    assert ros[-1] == ("shutdown", "end of the teleoperation")


def test_an_invalid_parameter_ends_the_program(
    ros: list[Any], caplog: pytest.LogCaptureFixture
) -> None:
    import rospy

    rospy.set_param("~rate", 0.0)
    assert node.main() == 1
    assert ros[-1] == ("shutdown", "invalid parameter")
    [record] = (record for record in caplog.records if record.name == "flatland")
    assert record.levelname == "CRITICAL"
    assert record.getMessage().startswith('Invalid parameter "~rate": ')


@pytest.mark.parametrize(
    ("uri", "text"),
    [
        (
            "http://127.0.0.1:1",
            "no ROS master at http://127.0.0.1:1: start the simulator first",
        ),
        (
            "nonsense",
            'invalid master URI "nonsense": it does not start with http://, expected '
            "http://HOST:PORT, such as http://localhost:11311 (from ROS_MASTER_URI)",
        ),
    ],
)
def test_the_program_needs_a_master(
    ros: list[Any],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    uri: str,
    text: str,
) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", uri)
    assert node.main() == 1
    assert ros == []
    assert capsys.readouterr() == ("", f"teleop_key: {text}\n")


def test_the_program_needs_a_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(isatty=lambda: False))
    assert node.main() == 1
    assert capsys.readouterr().err.startswith("teleop_key: the standard input is not a terminal: ")
