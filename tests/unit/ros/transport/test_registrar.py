"""The queue of registrations, claimed names and parameters, without a ROS master."""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest
from waiting import TIMEOUT

pytest.importorskip("rospy", reason="ROS is not installed")

import rospy

from flatland.errors import FlatlandError
from flatland.ros.transport.registrar import Registrar, unregister

TOPIC = "/topic"
Scan = type("Scan", (), {"_type": "a/Scan"})
Grid = type("Grid", (), {"_type": "a/Grid"})


class Endpoint:
    """A publisher, subscriber or service."""

    def __init__(self, owner: str = "", ready: bool = False) -> None:
        self.owner = owner
        self.ready = ready


@pytest.fixture
def registrar(monkeypatch: pytest.MonkeyPatch) -> Iterator[Registrar]:
    monkeypatch.setattr(rospy.core, "is_shutdown_requested", lambda: False)
    registrar = Registrar()
    yield registrar
    registrar.close(TIMEOUT)


class Blocked:
    """An action that lasts until the test releases it."""

    def __init__(self, registrar: Registrar) -> None:
        self.started, self.released = threading.Event(), threading.Event()
        registrar.submit(self._run)
        assert self.started.wait(TIMEOUT)

    def _run(self) -> None:
        self.started.set()
        assert self.released.wait(TIMEOUT)


def test_actions_run_in_order_in_a_thread_of_their_own(registrar: Registrar) -> None:
    done: list[Any] = []
    for number in range(3):
        registrar.submit(lambda number=number: done.append(number))  # type: ignore[misc]
    registrar.submit(lambda: done.append(threading.current_thread().name))
    assert registrar.flush(TIMEOUT)
    assert done == [0, 1, 2, "flatland-registrar"]
    assert registrar._thread.daemon


def test_an_action_that_fails_is_logged_and_the_next_ones_run(
    registrar: Registrar, caplog: pytest.LogCaptureFixture
) -> None:
    def fail() -> None:
        raise RuntimeError("cause")

    registrar.submit(fail)
    assert registrar.flush(TIMEOUT)
    [record] = caplog.records
    assert record.levelno == logging.ERROR
    assert record.getMessage() == "cannot register or unregister a topic or service"
    assert record.exc_info is not None


def test_a_flush_waits_for_the_actions_in_the_queue_only(registrar: Registrar) -> None:
    assert registrar.flush(TIMEOUT)
    blocked = Blocked(registrar)
    assert not registrar.flush(0.0)
    registrar.master_lost = True
    assert not registrar.flush(TIMEOUT)  # at once
    blocked.released.set()
    registrar.master_lost = False
    assert registrar.flush(TIMEOUT)
    # Nothing is in the queue, so that a lost master does not matter.
    while registrar._unfinished:
        registrar._thread.join(0.001)
    registrar.master_lost = True
    assert registrar.flush(0.0)


def test_the_queue_is_discarded_at_the_end(registrar: Registrar) -> None:
    done: list[str] = []
    blocked = Blocked(registrar)
    registrar.submit(lambda: done.append("late"))
    registrar.close(0.0)  # the action in progress exceeds the limit
    assert registrar._thread.is_alive()
    blocked.released.set()
    registrar.close(TIMEOUT)
    assert not registrar._thread.is_alive()
    assert done == []


def test_nothing_is_registered_during_a_shutdown(
    registrar: Registrar, monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[str] = []
    monkeypatch.setattr(rospy.core, "is_shutdown_requested", lambda: True)
    registrar._run_one(lambda: done.append("late"))
    assert done == []


def test_topics_that_close_in_a_block_that_fails_are_closed(registrar: Registrar) -> None:
    done: list[str] = []

    def reopen() -> None:
        with registrar.closing_last():
            registrar.submit_closing(lambda: done.append("close"))
            registrar.submit(lambda: done.append("open"))
            raise RuntimeError("cause")

    with pytest.raises(RuntimeError):
        reopen()
    registrar.submit_closing(lambda: done.append("at once"))
    assert registrar.flush(TIMEOUT)
    assert done == ["open", "close", "at once"]


# -- names -----------------------------------------------------------------------------------------


def test_a_name_has_one_type_until_it_is_released(registrar: Registrar) -> None:
    first, second, other = Endpoint("laser of model r"), Endpoint(), Endpoint()
    registrar.claim("publisher", TOPIC, Scan, first)
    registrar.claim("publisher", TOPIC, Scan, second)
    registrar.claim("subscriber", TOPIC, Grid, other)
    text = 'publisher "/topic" has the type a/Scan already, used by laser of model r, not a/Grid'
    with pytest.raises(FlatlandError, match=text):
        registrar.claim("publisher", TOPIC, Grid, Endpoint())
    registrar.release("publisher", TOPIC, first)
    registrar.release("publisher", TOPIC, first)
    with pytest.raises(FlatlandError, match="has the type a/Scan already, not a/Grid"):
        registrar.claim("publisher", TOPIC, Grid, Endpoint())
    registrar.release("publisher", TOPIC, second)
    registrar.claim("publisher", TOPIC, Grid, Endpoint())
    registrar.release("publisher", "/unknown", first)
    assert set(registrar._types) == {("publisher", TOPIC), ("subscriber", TOPIC)}
    registrar.release("subscriber", TOPIC, other)
    assert set(registrar._endpoints) == set(registrar._types) == {("publisher", TOPIC)}


def test_a_service_has_one_provider(registrar: Registrar) -> None:
    registrar.claim("service", "/s", Scan, Endpoint("plugin"), shared=False)
    with pytest.raises(FlatlandError, match='service "/s" exists already, used by plugin'):
        registrar.claim("service", "/s", Scan, Endpoint(), shared=False)


def test_an_endpoint_gives_way_to_one_that_does_not(registrar: Registrar) -> None:
    done: list[str] = []
    viewers = [Endpoint("viewer"), Endpoint("viewer")]
    for number, viewer in enumerate(viewers):
        end = lambda number=number: done.append(f"end {number}")  # noqa: E731
        registrar.claim("subscriber", TOPIC, Scan, viewer, give_way=end)
    # Not to another one that gives way.
    with pytest.raises(FlatlandError, match="has the type a/Scan already, used by viewer"):
        registrar.claim("subscriber", TOPIC, Grid, Endpoint(), give_way=lambda: None)
    plugin = Endpoint("plugin")
    registrar.claim("subscriber", TOPIC, Grid, plugin)
    registrar.submit(lambda: done.append("open"))
    assert registrar.flush(TIMEOUT)
    assert done == ["end 0", "end 1", "open"]
    with pytest.raises(FlatlandError, match="has the type a/Grid already, used by plugin"):
        registrar.claim("subscriber", TOPIC, Scan, Endpoint())
    for viewer in viewers:
        registrar.release("subscriber", TOPIC, viewer)
    with pytest.raises(FlatlandError, match="has the type a/Grid already, used by plugin"):
        registrar.claim("subscriber", TOPIC, Scan, Endpoint())
    # With the same type, they share the name; then, none of them gives way.
    registrar.claim("subscriber", TOPIC, Grid, viewers[0], give_way=lambda: done.append("end"))
    with pytest.raises(FlatlandError, match="has the type a/Grid already"):
        registrar.claim("subscriber", TOPIC, Scan, Endpoint())
    assert registrar.flush(TIMEOUT)
    assert "end" not in done


def test_a_topic_is_connected_if_all_its_endpoints_are_ready(registrar: Registrar) -> None:
    publisher, subscriber, service = Endpoint(ready=True), Endpoint(), Endpoint()
    assert not registrar.is_connected(TOPIC)
    registrar.claim("service", TOPIC, Scan, service, shared=False)
    assert not registrar.is_connected(TOPIC)
    registrar.claim("publisher", TOPIC, Scan, publisher)
    assert registrar.is_connected(TOPIC)
    registrar.claim("subscriber", TOPIC, Scan, subscriber)
    assert not registrar.is_connected(TOPIC)
    subscriber.ready, publisher.ready = True, False
    assert not registrar.is_connected(TOPIC)
    publisher.ready = True
    assert registrar.is_connected(TOPIC)


# -- parameters ------------------------------------------------------------------------------------


def test_a_parameter_is_set_in_order_and_again_on_a_new_master(
    registrar: Registrar, master: Any, caplog: pytest.LogCaptureFixture
) -> None:
    rate, seed = map(rospy.resolve_name, ("~rate", "~seed"))

    def restored(**found: object) -> dict[str, object]:
        """Returns the parameters of a new master, on which someone has set others before."""
        master.start()
        rospy.set_param(rospy.get_name(), found)
        registrar.restore_parameters()
        return {name: rospy.get_param(name) for name in (rate, seed, "/use_sim_time")}

    registrar.set_parameter("~rate", 50.0)
    assert registrar.flush(TIMEOUT)
    assert rospy.get_param("~rate") == 50.0
    registrar.keep_parameters({rate: 10.0, seed: 1, "/use_sim_time": True})
    master.stop()
    assert restored(seed=2, rate=20.0) == {rate: 50.0, seed: 2, "/use_sim_time": True}
    # Without a master, the last value is that of the next master.
    master.stop()
    registrar.set_parameter("~rate", 60.0)
    assert registrar.flush(TIMEOUT)
    assert caplog.records == []
    assert restored() == {rate: 60.0, seed: 1, "/use_sim_time": True}


# -- topics of rospy -------------------------------------------------------------------------------


@pytest.mark.parametrize("closed", [False, True])
def test_the_descriptor_of_a_topic_is_closed_with_its_last_publisher(closed: bool) -> None:
    done: list[str] = []
    lock = threading.Lock()

    def close() -> None:
        assert lock.locked()
        done.append("close")

    impl = SimpleNamespace(
        closed=False,
        c_lock=lock,
        connection_poll=SimpleNamespace(poller=SimpleNamespace(close=close)),
    )

    def unregister_topic() -> None:
        done.append("unregister")
        impl.closed = closed
        topic.impl = None

    topic: Any = SimpleNamespace(impl=impl, unregister=unregister_topic)
    unregister(topic)
    assert done == (["unregister", "close"] if closed else ["unregister"])
    unregister(topic)  # has no implementation any more
    assert done.count("unregister") == 2
