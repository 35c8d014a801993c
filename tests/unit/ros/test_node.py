"""The main program of the node, whose client library and parts are those of the test."""

from __future__ import annotations

import gc
import logging
import threading
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
from waiting import TIMEOUT

pytest.importorskip("rospy", reason="ROS is not installed")

import rosgraph
import rospy
from rospy.exceptions import TransportTerminated

from flatland.node.clock import SimulatedClock, WallClock
from flatland.node.parameters import ParameterError
from flatland.ros import logs, message_types, node, parameter_server
from flatland.ros.node import ServerNode
from flatland.ros.transport import inbound, master_watch, registrar, ros_transport

URI = "http://robot:11311"


class Run:
    """The run of the world; `serving` is called while it is served."""

    def __init__(self, is_fault: Any, unregister: Any) -> None:
        self.is_fault, self.unregister = is_fault, unregister
        self.stopping = threading.Event()
        self.watchdog = SimpleNamespace(request_stop=self.stopping.set, timeout=None)
        self.serving: Callable[..., None] = lambda *_: None

    def exit_code_of(self, simulate: Callable[[], None]) -> int:
        try:
            simulate()
        except ParameterError:
            return 1
        return 0

    def serve(self, parameters: Any, transport: Any, clock: Any, *, ended: Any) -> None:
        self.serving(parameters, transport, clock)
        ended()


class Registrar:
    def __init__(self, calls: list[Any]) -> None:
        self._calls = calls

    def keep_parameters(self, found: Any) -> None:
        self._calls.append(("keep", found))

    def flush(self, timeout: float) -> bool:
        self._calls.append(("flush", timeout))
        return True

    def close(self, timeout: float) -> None:
        self._calls.append(("registrar closed", timeout))


class Setup:
    """A node; `calls` is what it does, in order.

    Attributes:
        parameters: The private parameters.
        use_sim_time: Value of `/use_sim_time`.
        online: Whether there is a master: values of successive calls, the last one forever.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.calls: list[Any] = []
        self.parameters: dict[str, Any] = {"world_path": "world.yaml", "shutdown_timeout": 7.0}
        self.use_sim_time: Any = True
        self.online: list[Any] = [True]
        self.replace: Callable[[], None] = lambda: None
        self.hooks: list[Callable[[str], None]] = []
        self.init_error: Exception | None = None
        record = self.calls.append
        monkeypatch.setattr(node, "NodeRun", Run)
        monkeypatch.setattr(node, "_unregister", lambda: record("unregister"))
        monkeypatch.setattr(rosgraph, "is_master_online", self._is_online)
        monkeypatch.setattr(rosgraph, "get_master_uri", lambda: URI)
        monkeypatch.setattr(rospy, "init_node", self._init_node)
        monkeypatch.setattr(rospy, "get_name", lambda: "/flatland_server")
        monkeypatch.setattr(rospy.core, "_preshutdown_hooks", self.hooks)
        monkeypatch.setattr(inbound, "install", lambda: record("install"))
        monkeypatch.setattr(logs, "log_to_ros", lambda: record("log"))
        monkeypatch.setattr(parameter_server, "ParameterServer", lambda: self)
        monkeypatch.setattr(registrar, "Registrar", lambda: Registrar(self.calls))
        monkeypatch.setattr(ros_transport, "RosTransport", lambda given: ("transport", given))
        monkeypatch.setattr(master_watch, "MasterWatch", self._watch)
        monkeypatch.setattr(message_types, "_selected", "flatland")
        monkeypatch.setattr(node, "select_package", self._select)
        monkeypatch.setattr(
            "flatland.node.clock.SimulatedClock.__init__",
            lambda clock, transport, rate: record(("clock", transport[0], rate)),
        )
        self.node = ServerNode()
        self.run: Run = self.node._run  # type: ignore[assignment]
        self.run.serving = lambda *_: record("serve")

    def _is_online(self) -> bool:
        answer = self.online.pop(0) if len(self.online) > 1 else self.online[0]
        if isinstance(answer, Exception):
            raise answer
        return bool(answer)

    def _init_node(self, name: str, **options: Any) -> None:
        self.calls.append((name, options))
        if self.init_error is not None:
            raise self.init_error

    def _select(self, package: str) -> None:
        self.calls.append(("package", package))
        if package != "flatland":
            raise ImportError("no module")

    def _watch(self, _registrar: Registrar, replace: Callable[[], None]) -> Any:
        self.replace = replace
        return SimpleNamespace(close=lambda: self.calls.append("watch closed"))

    # -- the parameter server

    def get(self, name: str) -> Any:
        return self.parameters.get(name)

    def found(self) -> str:
        return "found parameters"


@pytest.fixture
def setup(monkeypatch: pytest.MonkeyPatch) -> Setup:
    return Setup(monkeypatch)


STARTED = [
    "install",
    ("flatland_server", {"disable_signals": True, "disable_rostime": True}),
    "log",
]
CLOSED = [("registrar closed", 2.0), "unregister"]


def test_a_node_starts_serves_and_ends_in_order(setup: Setup) -> None:
    served: list[Any] = []

    def serve(parameters: Any, transport: Any, clock: Any) -> None:
        setup.calls.append("serve")
        served.extend((parameters.world_path, transport[0], type(clock)))

    setup.run.serving = serve
    assert setup.node.run() == 0
    assert setup.calls == [
        *STARTED,
        ("package", "flatland"),
        ("keep", "found parameters"),
        ("clock", "transport", 0.0),
        ("flush", 0.1),
        "serve",
        "watch closed",  # before the topics
        "watch closed",
        *CLOSED,
    ]
    assert served == ["world.yaml", "transport", SimulatedClock]
    assert setup.run.watchdog.timeout == 7.0
    assert setup.run.unregister is node._unregister
    assert setup.run.is_fault is node._is_fault_of_client


def test_a_node_with_wall_time_publishes_no_clock(setup: Setup) -> None:
    setup.parameters["use_sim_time"] = False
    setup.use_sim_time = None
    clocks: list[Any] = []
    setup.run.serving = lambda _parameters, _transport, clock: clocks.append(type(clock))
    assert setup.node.run() == 0
    assert clocks == [WallClock]
    assert not any(call[0] == "clock" for call in setup.calls)


@pytest.mark.parametrize("by", ["watch", "shutdown"])
def test_a_node_whose_name_is_taken_ends_with_an_error(
    setup: Setup, caplog: pytest.LogCaptureFixture, by: str
) -> None:
    def serve(*_: object) -> None:
        [shut_down] = setup.hooks
        if by == "watch":
            setup.replace()
        else:
            shut_down("[/flatland_server] Reason: new node registered with same name")
        assert setup.run.stopping.is_set()
        shut_down("end")  # A later reason does not change the result.

    setup.run.serving = serve
    assert setup.node.run() == 1
    assert [(record.levelname, record.getMessage()) for record in caplog.records] == [
        (
            "CRITICAL",
            f'another node has taken the name "/flatland_server" on the ROS master at {URI}: this '
            "one ends",
        )
    ]
    assert setup.calls[-2:] == CLOSED


def test_a_shutdown_of_rospy_stops_the_node(setup: Setup, caplog: pytest.LogCaptureFixture) -> None:
    other: Callable[[str], None] = lambda _: None  # noqa: E731
    setup.hooks.append(other)

    def serve(*_: object) -> None:
        assert setup.hooks[1:] == [other]
        setup.hooks[0]("user request")
        assert setup.run.stopping.is_set()

    setup.run.serving = serve
    assert setup.node.run() == 0
    assert caplog.records == []


def test_an_invalid_address_of_the_master_is_reported(
    setup: Setup, caplog: pytest.LogCaptureFixture
) -> None:
    setup.online = [ValueError("invalid port")]
    assert setup.node.run() == 1
    assert setup.calls == []
    [record] = caplog.records
    assert (record.levelname, record.getMessage()) == (
        "CRITICAL",
        "invalid port (from ROS_MASTER_URI)",
    )


@pytest.mark.parametrize("stopping", [False, True])
def test_a_node_that_cannot_be_initialized_ends(
    setup: Setup, caplog: pytest.LogCaptureFixture, stopping: bool
) -> None:
    caplog.set_level(logging.DEBUG, "rosout")
    setup.init_error = rospy.ROSInitException("no port")
    waited = setup.node._wait_for_master

    def wait() -> bool:
        found = waited()
        if stopping:
            setup.run.stopping.set()
        return found

    setup.node._wait_for_master = wait  # type: ignore[method-assign]
    assert setup.node.run() == (0 if stopping else 1)
    assert setup.calls == STARTED[:2]
    logged = [(each.name, each.levelname, each.getMessage()) for each in caplog.records]
    assert logged == ([] if stopping else [("rosout", "CRITICAL", "no port")])


def test_an_invalid_parameter_ends_the_node_before_it_registers_anything(setup: Setup) -> None:
    setup.parameters["msgs_package"] = "flatland_msgs"
    errors: list[str] = []

    def report(simulate: Callable[[], None]) -> int:
        try:
            simulate()
        except ParameterError as error:
            errors.append(str(error))
            return 1
        return 0

    setup.run.exit_code_of = report  # type: ignore[method-assign]
    assert setup.node.run() == 1
    text = 'Invalid parameter "~msgs_package": "flatland_msgs" is not installed, no module'
    assert errors == [text]
    assert setup.calls == [*STARTED, ("package", "flatland_msgs"), "unregister"]


# -- the master ------------------------------------------------------------------------------------


class Waiting:
    """Time, and the answers of the search for the master, which is a step of each wait."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 50.0
        self.polls: list[float] = []
        self.slept: list[float] = []
        self.on_poll: Callable[[], None] = lambda: None
        self.threads: list[dict[str, Any]] = []
        clock = SimpleNamespace(monotonic=lambda: self.now, sleep=self.slept.append)
        monkeypatch.setattr(node, "time", clock)
        monkeypatch.setattr(node, "wait", self._wait)
        monkeypatch.setattr(
            node, "threading", SimpleNamespace(Thread=self._thread, Event=threading.Event)
        )

    def _thread(self, *, target: Callable[[], None], **options: Any) -> Any:
        self.threads.append(options)
        self.search = target
        return SimpleNamespace(start=lambda: options.update(started=True))

    def _wait(self, futures: list[Any], timeout: float) -> Any:
        self.polls.append(timeout)
        self.now += 1 / 16
        self.on_poll()
        return SimpleNamespace(done={future for future in futures if future.done()})


def test_a_missing_master_is_a_warning_after_a_second(
    setup: Setup, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    waiting = Waiting(monkeypatch)
    counts: list[int] = []

    def poll() -> None:
        counts.append(len(caplog.records))
        if len(counts) == 40:
            setup.online = [False, False, True]
            waiting.search()

    waiting.on_poll = poll
    assert setup.node._wait_for_master() is True
    assert waiting.slept == [0.2] * 2
    [options] = waiting.threads
    assert options == {"name": "flatland-master-search", "daemon": True, "started": True}
    assert set(waiting.polls) == {0.05}
    [record] = caplog.records
    assert (record.levelname, record.getMessage()) == (
        "WARNING",
        f"waiting for the ROS master at {URI}",
    )
    assert counts.index(1) == 17  # polls, the last of which are more than a second later


def test_a_stop_ends_the_search_for_the_master(
    setup: Setup, monkeypatch: pytest.MonkeyPatch
) -> None:
    waiting = Waiting(monkeypatch)
    waiting.on_poll = setup.run.stopping.set
    assert setup.node.run() == 0
    assert waiting.polls == [0.05]
    assert setup.calls == []


# -- functions -------------------------------------------------------------------------------------


def test_the_help_names_the_program_and_its_options(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        node.main(["--help"])
    text = " ".join(capsys.readouterr().out.split())
    assert text.startswith("usage: flatland_server ")
    assert "The simulator node of flatland. Parameters are set as _NAME:=VALUE." in text
    assert "package of the message and service types, if ~msgs_package is not set" in text


def test_the_default_of_the_package_is_that_of_the_command_line(setup: Setup) -> None:
    setup.node = ServerNode("flatland_msgs")
    assert setup.node.run() == 1
    assert ("package", "flatland_msgs") in setup.calls


def test_the_program_selects_the_package_of_messages(monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[Any] = []

    class Node:
        def __init__(self, package: str) -> None:
            started.append((package, gc.isenabled()))

        def run(self) -> int:
            return 5

    monkeypatch.setattr(node, "ServerNode", Node)
    assert node.main(["_world_path:=w", "__name:=n"]) == 5
    assert node.main(["--msgs-package", "flatland_msgs", "_rate:=1"]) == 5
    assert started == [("flatland", False), ("flatland_msgs", False)]
    assert gc.isenabled()
    with pytest.raises(SystemExit):
        node.main(["--msgs-package", "other"])
    assert node.main(["--msgs", "other"]) == 5  # not an abbreviation


def test_an_invalid_request_is_the_fault_of_a_client() -> None:
    assert node._is_fault_of_client(TransportTerminated)
    assert not node._is_fault_of_client(RuntimeError)


@pytest.mark.parametrize(
    ("own", "others", "text"),
    [
        (True, True, ""),
        (False, False, ""),
        (True, False, "/use_sim_time is not true: other nodes do not follow the simulated time"),
        (False, True, "/use_sim_time is true, but this node uses wall time and publishes no "),
    ],
)
def test_another_time_of_other_nodes_is_a_warning(
    caplog: pytest.LogCaptureFixture, own: bool, others: bool, text: str
) -> None:
    node._check_time_of_other_nodes(own, others)
    messages = [record.getMessage() for record in caplog.records]
    assert len(messages) == bool(text)
    assert all(message.startswith(text) for message in messages)


@pytest.fixture
def shutdown(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """The shutdown of rospy, which lasts `polls` polls."""
    state = SimpleNamespace(polls=3, slept=[], reasons=[], now=0.0, called=threading.Event())

    def signal(reason: str) -> None:
        state.reasons.append((reason, threading.current_thread().daemon))
        state.called.set()

    def sleep(seconds: float) -> None:
        assert state.called.wait(TIMEOUT)
        state.slept.append(seconds)
        state.now += seconds

    clock = SimpleNamespace(monotonic=lambda: state.now, sleep=sleep)
    monkeypatch.setattr(node, "time", clock)
    monkeypatch.setattr(rospy, "signal_shutdown", signal)
    monkeypatch.setattr(rospy, "is_shutdown", lambda: len(state.slept) >= state.polls)
    return state


def test_the_node_waits_until_it_is_unregistered(shutdown: SimpleNamespace) -> None:
    node._unregister()
    assert shutdown.slept == [0.002] * 3
    assert shutdown.reasons == [("shutdown", True)]
    shutdown.polls, shutdown.slept[:] = 10_000, []
    shutdown.now = 0.0
    node._unregister()
    assert shutdown.now == pytest.approx(2.0, abs=0.003)
