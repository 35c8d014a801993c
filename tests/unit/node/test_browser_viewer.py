"""The viewer in the browser as a part of the node, without ROS."""

from __future__ import annotations

import errno
import re
import socket
from types import SimpleNamespace
from typing import Any

import pytest
from free_ports import free_port
from waiting import wait_until
from web_client import WebClient

from flatland import web
from flatland.errors import FlatlandError
from flatland.node import browser_viewer


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
    tries = []
    wait = browser_viewer.BrowserViewer._listen
    port = free_port()
    taken = socket.create_server(("127.0.0.1", port))

    def listen(self: Any, viewer: Any) -> None:
        start = viewer.start

        def start_and_release() -> None:
            tries.append(viewer)
            if len(tries) == 2:
                taken.close()
            start()

        viewer.start = start_and_release
        wait(self, viewer)

    monkeypatch.setattr(browser_viewer.BrowserViewer, "_listen", listen)
    serve(web=True, web_port=port)
    assert url_of_the_page(caplog) == f"http://127.0.0.1:{port}/"
    assert len(tries) == 2


class Viewer:
    """A server that records its calls."""

    url, view_url = "url", None

    def __init__(self, calls: list[Any], *arguments: Any, **options: Any) -> None:
        self._calls = calls
        calls.append(("create", arguments, options))

    def add_world(self, *arguments: Any, **options: Any) -> None:
        self._calls.append(("world", arguments, options))

    def start(self) -> None:
        self._calls.append("start")

    def close(self) -> None:
        self._calls.append("close")


@pytest.fixture
def wired(monkeypatch: pytest.MonkeyPatch, transport: Any) -> tuple[Any, Any, list[Any]]:
    """A viewer that the test starts, its simulation, and the calls of its server."""
    calls: list[Any] = []
    monkeypatch.setattr(web, "WebViewer", lambda *args, **options: Viewer(calls, *args, **options))
    posted: list[Any] = []
    simulation: Any = SimpleNamespace(world="world", post=posted.append, posted=posted)
    parameters: Any = SimpleNamespace(
        web_host="host", web_port=7, web_token="t", web_view_token="v", web_read_only=True
    )
    operations: Any = "operations"
    viewer = browser_viewer.BrowserViewer(transport, simulation, operations, parameters)
    return viewer, simulation, calls


def test_the_server_is_created_from_the_parameters(
    wired: Any, transport: Any, caplog: pytest.LogCaptureFixture
) -> None:
    viewer, simulation, calls = wired
    [outer] = simulation.posted
    outer()
    thread = simulation.posted[1].__self__
    assert (thread.name, thread.daemon) == ("flatland-web-start", True)
    viewer._start()
    options = {"token": "t", "view_token": "v", "read_only": True}
    topics = transport.foreign_topics
    added = {"simulation": simulation, "controller": "operations", "foreign_topics": topics}
    assert calls == [("create", ("host", 7), options), ("world", ("world",), added), "start"]
    assert [record.getMessage() for record in caplog.records] == ["viewer in the browser: url"]
    for _ in range(2):
        viewer.close()
    assert calls[3:] == ["close"]
    assert topics.closed


def test_a_server_that_starts_during_the_end_is_closed(wired: Any, transport: Any) -> None:
    viewer, _, calls = wired
    viewer.close()
    viewer._start()
    assert calls[2:] == ["start", "close"]
    assert transport.foreign_topics.closed


@pytest.mark.parametrize("closing", [False, True])
def test_an_error_of_the_start_is_reported_unless_the_node_ends(
    wired: Any,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    closing: bool,
) -> None:
    viewer, _, calls = wired

    def fail(_viewer: Any) -> None:
        calls.append("start")
        raise ValueError("invalid host")

    monkeypatch.setattr(Viewer, "start", fail)
    if closing:
        viewer.close()
    viewer._start()
    assert calls[2:] == ["start", "close"]
    text = (
        "the viewer in the browser cannot start: invalid host. The simulator continues without it"
    )
    assert [record.getMessage() for record in caplog.records] == ([] if closing else [text])


def test_an_internal_error_of_the_start_is_logged(
    wired: Any, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(_viewer: Any) -> None:
        raise RuntimeError("cause")

    monkeypatch.setattr(Viewer, "start", fail)
    wired[0]._start()
    [record] = caplog.records
    assert record.getMessage() == "unexpected internal error of the viewer in the browser"
    assert record.exc_info is not None


@pytest.mark.parametrize(
    ("cause", "tries"), [(OSError(errno.EADDRINUSE, ""), 51), (OSError(errno.EACCES, ""), 1)]
)
def test_a_port_in_use_is_tried_for_ten_seconds(
    wired: Any, monkeypatch: pytest.MonkeyPatch, cause: OSError, tries: int
) -> None:
    viewer, _, calls = wired
    now = [100.0]
    monkeypatch.setattr(browser_viewer, "time", SimpleNamespace(monotonic=lambda: now[0]))
    waits: list[float] = []

    def wait(seconds: float) -> bool:
        waits.append(seconds)
        now[0] += 0.2001
        return False

    monkeypatch.setattr(viewer._closing, "wait", wait)

    def fail(_viewer: Any) -> None:
        calls.append("start")
        raise FlatlandError("no port") from cause

    monkeypatch.setattr(Viewer, "start", fail)
    viewer._start()
    assert calls.count("start") == tries
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


def test_the_viewer_ends_with_the_node(serve: Any, caplog: pytest.LogCaptureFixture) -> None:
    node = serve(web=True, web_port=0)
    url = url_of_the_page(caplog)
    node.close()
    with pytest.raises(OSError, match="Cannot connect"):
        WebClient(url)
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
