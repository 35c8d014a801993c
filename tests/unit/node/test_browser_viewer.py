"""The viewer in the browser as a part of the node, without ROS."""

from __future__ import annotations

import errno
import re
import socket
import threading
from types import SimpleNamespace
from typing import Any

import pytest
from free_ports import free_port
from waiting import wait_until
from web_client import WebClient

import flatland
from flatland import web
from flatland.errors import FlatlandError
from flatland.node import browser_viewer
from flatland.node.clock import SimulatedClock
from flatland.node.operations import Operations
from flatland.node.parameters import read_parameters
from flatland.node.transport import REGISTRATION_TIMEOUT
from flatland.simulation import Simulation


def url_of_the_page(caplog: pytest.LogCaptureFixture) -> str:
    """Waits for the viewer and returns its address."""
    return str(
        wait_until("a viewer", lambda: re.search(r"in the browser: (http://\S+)", caplog.text))[1]
    )


@pytest.fixture(autouse=True)
def logged(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO", "flatland")


def test_a_port_in_use_is_an_error_and_the_simulator_continues(
    serve: Any, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(browser_viewer, "_PORT_TIMEOUT", 0.3)
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        node = serve(web=True, web_port=port)
        wait_until("an error", lambda: "cannot start" in caplog.text)
    assert (
        f"the viewer in the browser cannot start: the viewer cannot listen on port {port}"
        in caplog.text
    )
    assert "The simulator continues without it" in caplog.text
    start = node.world.timekeeper.sim_time_ns
    wait_until("a step", lambda: node.world.timekeeper.sim_time_ns > start)


def test_a_port_that_becomes_free_is_used(
    serve: Any, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As when the node that had the port ends, because this one has taken its name."""
    threads = []
    start = web.WebViewer.start
    port = free_port()
    taken = socket.create_server(("127.0.0.1", port))

    def start_and_release(viewer: Any) -> None:
        threads.append(threading.current_thread())
        if len(threads) == 2:
            taken.close()
        start(viewer)

    monkeypatch.setattr(web.WebViewer, "start", start_and_release)
    serve(web=True, web_port=port)
    assert url_of_the_page(caplog) == f"http://127.0.0.1:{port}/"
    assert [(each.name, each.daemon) for each in threads] == [("flatland-web-start", True)] * 2


@pytest.fixture
def viewer(
    empty_world: flatland.World, transport: Any, monkeypatch: pytest.MonkeyPatch
) -> browser_viewer.BrowserViewer:
    """A viewer that the test starts."""
    simulation = Simulation(empty_world)
    # The end of the world would start it once more.
    monkeypatch.setattr(simulation, "post", lambda _action: None)
    clock = SimulatedClock(transport)
    operations = Operations(transport, simulation, clock, "warn", move_keeps_odometry=False)
    parameters = read_parameters({"world_path": "world.yaml", "web_port": 0}.get)
    return browser_viewer.BrowserViewer(transport, simulation, operations, parameters)


@pytest.fixture
def closed(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The servers that have been closed."""
    closed: list[Any] = []
    close = web.WebViewer.close
    monkeypatch.setattr(
        web.WebViewer, "close", lambda server: (closed.append(server), close(server))
    )
    return closed


def test_a_server_that_starts_during_the_end_is_closed(
    viewer: Any, closed: list[Any], transport: Any, caplog: pytest.LogCaptureFixture
) -> None:
    viewer.close()
    viewer._start()
    assert len(closed) == 1
    assert transport.foreign_topics.closed
    assert transport.flushed == [REGISTRATION_TIMEOUT]
    assert caplog.records == []


@pytest.mark.parametrize("closing", [False, True])
@pytest.mark.parametrize(
    ("error", "text"),
    [
        (
            ValueError("invalid host"),
            "the viewer in the browser cannot start: invalid host. The simulator continues "
            "without it",
        ),
        (RuntimeError("cause"), "unexpected internal error of the viewer in the browser"),
    ],
)
def test_an_error_of_the_start_is_reported_unless_the_node_ends(
    viewer: Any,
    closed: list[Any],
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    error: Exception,
    text: str,
    closing: bool,
) -> None:
    def fail(_server: Any) -> None:
        raise error

    monkeypatch.setattr(web.WebViewer, "start", fail)
    if closing:
        viewer.close()
    viewer._start()
    assert len(closed) == 1
    is_logged = not closing or isinstance(error, RuntimeError)
    assert [record.getMessage() for record in caplog.records] == ([text] if is_logged else [])


@pytest.mark.parametrize(
    ("cause", "tries"), [(OSError(errno.EADDRINUSE, ""), 51), (OSError(errno.EACCES, ""), 1)]
)
def test_a_port_in_use_is_tried_for_ten_seconds(
    viewer: Any, monkeypatch: pytest.MonkeyPatch, cause: OSError, tries: int
) -> None:
    now = [100.0]
    monkeypatch.setattr(browser_viewer, "time", SimpleNamespace(monotonic=lambda: now[0]))
    waits: list[float] = []
    starts: list[Any] = []

    def wait(seconds: float) -> bool:
        waits.append(seconds)
        now[0] += 0.2001
        return False

    monkeypatch.setattr(viewer._closing, "wait", wait)

    def fail(server: Any) -> None:
        starts.append(server)
        raise FlatlandError("no port") from cause

    monkeypatch.setattr(web.WebViewer, "start", fail)
    viewer._start()
    assert len(starts) == tries
    assert waits == [0.2] * (tries - 1)


def test_access_from_other_machines_requires_a_token(
    serve: Any, caplog: pytest.LogCaptureFixture
) -> None:
    serve(web=True, web_host="0.0.0.0", web_port=0, web_read_only=True)
    found = re.fullmatch(r"http://[^/]+:(\d+)/\?token=(\S{16,})", url_of_the_page(caplog))
    assert found is not None
    port, token = found.groups()
    with WebClient(f"http://127.0.0.1:{port}/?token={token}") as client:
        assert client.hello["read_only"]
        assert "read-only" in client.refused("pause")
    with pytest.raises(ConnectionError, match="4401"):
        WebClient(f"http://127.0.0.1:{port}/?token=guess")


def test_given_tokens_are_those_of_controllers_and_viewers(
    serve: Any, caplog: pytest.LogCaptureFixture
) -> None:
    serve(web=True, web_port=0, web_token="token-of-controllers", web_view_token="token-of-viewers")
    for_viewers = wait_until("two addresses", lambda: re.search(r"for viewers: (\S+)", caplog.text))
    url = url_of_the_page(caplog)
    assert url.endswith("/?token=token-of-controllers")
    with WebClient(url) as client:
        assert not client.hello["read_only"]
    assert for_viewers[1].endswith("/?token=token-of-viewers")
    with WebClient(for_viewers[1]) as client:
        assert client.hello["read_only"]


def test_the_viewer_ends_with_the_node(
    serve: Any, closed: list[Any], caplog: pytest.LogCaptureFixture
) -> None:
    node = serve(web=True, web_port=0)
    url = url_of_the_page(caplog)
    node.close()
    with pytest.raises(OSError, match="Cannot connect"):
        WebClient(url)
    assert len(closed) == 1
    assert node.transport.foreign_topics.closed


def test_the_page_steps_a_world_in_lockstep(
    serve: Any, transport: Any, caplog: pytest.LogCaptureFixture
) -> None:
    serve(web=True, web_port=0, lockstep=True)
    clock = transport.topics["/clock"]
    clock.connect()
    with WebClient(url_of_the_page(caplog)) as client:
        status = client.status()
        assert (status["lockstep"], status["time"]) == (True, 0)
        assert (status["rate"], status["real_time_factor"]) == (None, None)
        client.do("step", n=40)
        client.until("step", lambda: client.status()["time"] == pytest.approx(0.2))
        assert clock.sent[-1] == 200_000_000
        assert "lockstep" in client.refused("set_rate", rate=10)
