"""The viewer in the browser as a part of the node, without ROS."""

from __future__ import annotations

import re
import socket
from typing import Any

import pytest
from free_ports import free_port
from waiting import wait_until
from web_client import WebClient

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
