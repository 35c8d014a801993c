"""The watch of the ROS master, which the test lets poll a real master."""

from __future__ import annotations

import logging
import os
import threading
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("rospy", reason="ROS is not installed")

import rosgraph
import rospy
from rospy.impl.registration import Registration

from flatland.ros.transport import master_watch
from flatland.ros.transport.master_watch import LimitedTransport, MasterWatch

NODE_URI = "http://127.0.0.1:1"


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
    """A watch of a master that knows the node.

    Attributes:
        periods: Times between the polls [s].
        remaining: Polls that the watch is still to make.
    """

    def __init__(self, master: Any, monkeypatch: pytest.MonkeyPatch) -> None:
        self.master = master
        self.registrar = Registrar()
        self.remaining = 0
        self.periods: list[float] = []
        self.threads: list[dict[str, Any]] = []
        self.replaced = 0
        monkeypatch.setattr(rospy, "get_name", lambda: "/node")
        monkeypatch.setattr(rospy.core, "get_node_uri", lambda: NODE_URI)
        fake = SimpleNamespace(Thread=self._thread, Event=threading.Event)
        monkeypatch.setattr(master_watch, "threading", fake)
        self.watch = MasterWatch(self.registrar, self._replace)  # type: ignore[arg-type]
        monkeypatch.setattr(self.watch._closed, "wait", self._wait)
        self.register()

    def _thread(self, **options: Any) -> Any:
        self.threads.append(options)
        return SimpleNamespace(start=lambda: options.update(started=True))

    def _replace(self) -> None:
        self.replaced += 1

    def _wait(self, period: float) -> bool:
        self.periods.append(period)
        self.remaining -= 1
        return self.remaining < 0

    def register(self, uri: str = NODE_URI) -> None:
        """Makes the master know the node."""
        rosgraph.Master("/node").registerService("/s", "rosrpc://127.0.0.1:1", uri)

    def poll(self, count: int = 1) -> int:
        """Polls the master; returns the number of registrations that are queued."""
        self.remaining = count
        before = len(self.registrar.actions)
        self.threads[0]["target"]()
        return len(self.registrar.actions) - before


@pytest.fixture
def setup(master: Any, monkeypatch: pytest.MonkeyPatch, caplog: Any) -> Setup:
    caplog.set_level(logging.INFO, "flatland")
    return Setup(master, monkeypatch)


def test_a_thread_polls_the_master_once_a_second(
    setup: Setup, monkeypatch: pytest.MonkeyPatch
) -> None:
    [options] = setup.threads
    assert options["started"]
    assert options["daemon"] is True
    assert options["name"] == "flatland-master-watch"
    transports: list[LimitedTransport] = []
    make_connection = LimitedTransport.make_connection

    def connect(transport: LimitedTransport, host: str) -> Any:
        transports.append(transport)
        return make_connection(transport, host)

    monkeypatch.setattr(LimitedTransport, "make_connection", connect)
    assert setup.poll(2) == 0
    assert setup.periods == [1.0] * 3
    assert len(set(transports)) == 2  # a new connection for each poll
    connection = transports[0].make_connection("robot:11311")
    assert connection.timeout == 10.0


def test_a_master_that_returns_is_registered_with_once(
    setup: Setup, caplog: pytest.LogCaptureFixture
) -> None:
    assert setup.poll() == 0
    setup.master.stop()
    assert setup.poll(2) == 0
    assert setup.registrar.master_lost
    assert [(record.levelname, record.getMessage()) for record in caplog.records] == [
        (
            "WARNING",
            f"the ROS master at {setup.master.uri} does not respond ([Errno 111] Connection "
            "refused): the simulation continues; the node registers again when the master is back",
        )
    ]
    setup.master.start()
    assert setup.poll(2) == 1
    assert not setup.registrar.master_lost
    setup.master.stop()
    assert setup.poll() == 0
    assert len(caplog.records) == 2


def test_another_master_is_registered_with_also_without_a_failure(
    setup: Setup, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert setup.poll() == 0
    monkeypatch.setattr(os, "getpid", lambda: 1)  # the process of the master
    assert setup.poll(2) == 1


def test_a_node_that_the_master_does_not_know_is_registered(setup: Setup) -> None:
    setup.master.stop()
    setup.master.start()
    assert setup.poll(2) == 1
    setup.registrar.actions.clear()
    setup.watch._registering = 0  # as after the registration
    assert setup.poll() == 1


def test_the_watch_ends_when_another_node_has_the_name(setup: Setup) -> None:
    setup.register("http://127.0.0.1:2")
    assert setup.poll(2) == 0
    assert setup.replaced == 1
    assert setup.remaining == 1


def test_a_watch_that_was_closed_registers_and_reports_nothing(
    setup: Setup, caplog: pytest.LogCaptureFixture
) -> None:
    setup.master.stop()
    setup.watch.close()
    assert setup.watch._closed.is_set()
    assert setup.poll() == 0
    assert not setup.registrar.master_lost
    setup.master.start()
    assert setup.poll(2) == 0
    assert setup.remaining == 1
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
    setup.master.stop()
    setup.master.start()
    assert setup.poll() == 1
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
        f"the ROS master at {setup.master.uri} is back: registered 2 topics, 1 subscriptions and "
        "3 services again",
    )
    # Also after a failure, the next poll may register again.
    monkeypatch.setattr(master_watch, "get_topic_manager", lambda: None)
    assert setup.poll() == 1
    with pytest.raises(AttributeError):
        setup.registrar.run()
    assert setup.poll() == 1
