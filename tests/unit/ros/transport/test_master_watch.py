"""The watch of the ROS master, whose responses and polls are those of the test."""

from __future__ import annotations

import logging
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("rospy", reason="ROS is not installed")

import rosgraph
import rospy
from rospy.impl.registration import Registration

from flatland.ros.transport import master_watch
from flatland.ros.transport.master_watch import POLL_PERIOD, LimitedTransport, MasterWatch

URI = "http://robot:11311"
NODE_URI = "http://robot:40000"


class Registrar:
    """Runs actions on demand.

    Attributes:
        calls: What the watch has called.
    """

    def __init__(self) -> None:
        self.master_lost = False
        self.actions: list[Callable[[], None]] = []
        self.calls: list[Any] = []

    def submit(self, action: Callable[[], None]) -> None:
        self.actions.append(action)

    def restore_parameters(self) -> None:
        self.calls.append("parameters")

    def run(self) -> None:
        while self.actions:
            self.actions.pop(0)()


class Setup:
    """A watch and the responses of the master, each of which is an error or process and URI.

    Attributes:
        steps: Called after each poll of the script.
        periods: Times between the polls [s].
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.registrar = Registrar()
        self.responses: list[Any] = []
        self.periods: list[float] = []
        self.threads: list[dict[str, Any]] = []
        self.replaced = 0
        self.transports: list[Any] = []
        monkeypatch.setattr(rosgraph, "get_master_uri", lambda: URI)
        monkeypatch.setattr(rospy, "get_name", lambda: "/node")
        monkeypatch.setattr(rospy.core, "get_node_uri", lambda: NODE_URI)
        monkeypatch.setattr(master_watch.threading, "Thread", self._thread)
        monkeypatch.setattr(master_watch, "ServerProxy", self._proxy)
        monkeypatch.setattr(master_watch, "MultiCall", self._multi_call)
        self.watch = MasterWatch(self.registrar, self._replace)  # type: ignore[arg-type]
        self.closed = self.watch._closed
        self.watch._closed = self  # type: ignore[assignment]

    def _thread(self, **options: Any) -> Any:
        self.threads.append(options)
        return SimpleNamespace(start=lambda: options.update(started=True))

    def _replace(self) -> None:
        self.replaced += 1

    def _proxy(self, uri: str, transport: Any) -> Any:
        assert uri == URI
        self.transports.append(transport)
        return self

    def __enter__(self) -> Any:
        return self

    def __exit__(self, *_: object) -> None:
        self.periods[-1] = -self.periods[-1]  # of a connection that was closed

    def _multi_call(self, master: Any) -> Any:
        assert master is self
        calls: list[Any] = []

        class Calls:
            def getPid(self, *arguments: str) -> None:  # noqa: N802
                calls.append(("getPid", *arguments))

            def lookupNode(self, *arguments: str) -> None:  # noqa: N802
                calls.append(("lookupNode", *arguments))

            def __call__(calls_of_master: Any) -> Any:  # noqa: N805
                assert calls == [("getPid", "/node"), ("lookupNode", "/node", "/node")]
                response = self.responses.pop(0)
                if isinstance(response, Exception):
                    raise response
                pid, uri = response
                return [[1, "", pid], [1, "", uri] if uri else [-1, "unknown", "nothing"]]

        return Calls()

    # -- replaces the event that ends the thread

    def wait(self, period: float) -> bool:
        self.periods.append(period)
        return not self.responses

    def is_set(self) -> bool:
        return self.closed.is_set()

    def set(self) -> None:
        self.closed.set()

    def poll(self, *responses: Any) -> int:
        """Polls once for each response; returns the number of registrations that are queued."""
        self.responses = list(responses)
        before = len(self.registrar.actions)
        self.watch._run()
        return len(self.registrar.actions) - before


@pytest.fixture
def setup(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> Setup:
    caplog.set_level(logging.INFO, "flatland")
    return Setup(monkeypatch)


KNOWN = (7, NODE_URI)


def test_a_thread_polls_the_master_once_a_second(setup: Setup) -> None:
    [options] = setup.threads
    assert options["started"]
    assert options["daemon"] is True
    assert options["name"] == "flatland-master-watch"
    assert setup.poll(KNOWN, KNOWN) == 0
    assert setup.periods == [-1.0, -1.0, 1.0]
    assert POLL_PERIOD == 1.0
    assert [transport._timeout for transport in setup.transports] == [10.0, 10.0]
    connection = setup.transports[0].make_connection("robot:11311")
    assert connection.timeout == 10.0
    assert connection is LimitedTransport.make_connection(setup.transports[0], "robot:11311")
    setup.watch.close()
    assert setup.closed.is_set()


def test_a_master_that_returns_is_registered_with_once(
    setup: Setup, caplog: pytest.LogCaptureFixture
) -> None:
    assert setup.poll(KNOWN, OSError("refused"), OSError("refused")) == 0
    assert setup.registrar.master_lost
    assert [(record.levelname, record.getMessage()) for record in caplog.records] == [
        (
            "WARNING",
            f"the ROS master at {URI} does not respond (refused): the simulation continues; the "
            "node registers again when the master is back",
        )
    ]
    assert setup.poll((8, ""), (8, "")) == 1
    assert not setup.registrar.master_lost
    assert setup.poll(OSError("again")) == 0
    assert len(caplog.records) == 2


def test_another_master_is_registered_with_also_without_a_failure(setup: Setup) -> None:
    assert setup.poll(KNOWN, (8, NODE_URI), (8, NODE_URI)) == 1


def test_a_node_that_the_master_does_not_know_is_registered(setup: Setup) -> None:
    assert setup.poll((7, ""), (7, "")) == 1
    setup.registrar.actions.clear()
    setup.watch._registering = 0  # as after the registration
    assert setup.poll((7, "")) == 1


def test_the_watch_ends_when_another_node_has_the_name(setup: Setup) -> None:
    assert setup.poll(KNOWN, (7, "http://other:1"), KNOWN) == 0
    assert setup.replaced == 1
    assert setup.responses == [KNOWN]


def test_a_watch_that_was_closed_registers_and_reports_nothing(
    setup: Setup, caplog: pytest.LogCaptureFixture
) -> None:
    setup.watch.close()
    assert setup.poll((7, ""), OSError("refused")) == 0
    assert setup.responses == [setup.responses[0]]
    setup.poll(OSError("refused"))
    assert not setup.registrar.master_lost
    assert caplog.records == []


def test_parameters_topics_subscriptions_and_services_are_registered_in_order(
    setup: Setup, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    calls = setup.registrar.calls
    topics = SimpleNamespace(
        get_publications=lambda: [["/scan", "a/Scan"], ["/tf", "a/Tf"]],
        get_subscriptions=lambda: [["/cmd_vel", "a/Twist"]],
    )
    services = SimpleNamespace(get_services=lambda: [["/s1", "u1"], ["/s2", "u2"], ["/s3", "u3"]])
    listeners = SimpleNamespace(notify_added=lambda *arguments: calls.append(arguments))
    monkeypatch.setattr(master_watch, "get_topic_manager", lambda: topics)
    monkeypatch.setattr(master_watch, "get_service_manager", lambda: services)
    monkeypatch.setattr(master_watch, "get_registration_listeners", lambda: listeners)
    assert setup.poll((7, "")) == 1
    setup.registrar.run()
    assert calls == [
        "parameters",
        ("/scan", "a/Scan", Registration.PUB),
        ("/tf", "a/Tf", Registration.PUB),
        ("/cmd_vel", "a/Twist", Registration.SUB),
        ("/s1", "u1", Registration.SRV),
        ("/s2", "u2", Registration.SRV),
        ("/s3", "u3", Registration.SRV),
    ]
    [record] = caplog.records
    assert (record.levelname, record.getMessage()) == (
        "WARNING",
        f"the ROS master at {URI} is back: registered 2 topics, 1 subscriptions and 3 services "
        "again",
    )
    # Also after a failure, the next poll may register again.
    monkeypatch.setattr(master_watch, "get_topic_manager", lambda: None)
    assert setup.poll((7, "")) == 1
    with pytest.raises(AttributeError):
        setup.registrar.run()
    assert setup.poll((7, "")) == 1
