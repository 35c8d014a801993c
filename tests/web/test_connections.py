"""Connections: access, restarts, several browsers, sleeping browsers, garbage."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from chromium import Chromium
from viewed_world import ViewedWorld, ViewProgram, free_port, viewed_room, write_room
from viewer_page import ViewerPage
from waiting import TIMEOUT, wait_until
from websocket import WebSocket, WebSocketBadStatusException, create_connection

from flatland import Twist


def connect(room: ViewedWorld, **options: object) -> WebSocket:
    """Opens a WebSocket as the page does."""
    address = urlsplit(room.viewer.url)
    query = f"?{address.query}" if address.query else ""
    socket = create_connection(
        f"ws://{address.netloc}/ws{query}",
        timeout=TIMEOUT,
        subprotocols=["flatland.1"],
        **options,
    )
    assert isinstance(socket, WebSocket)
    return socket


def time_of(room: ViewedWorld) -> float:
    return room.ask(lambda: room.world.time)


# -- access --------------------------------------------------------------------------------


@pytest.fixture
def guarded_room(tmp_path: Path) -> Iterator[ViewedWorld]:
    """A room whose viewer requires a token."""
    with viewed_room(tmp_path, token="a-secret-token") as room:
        yield room


def test_the_page_requires_the_token(guarded_room: ViewedWorld, browser: Chromium) -> None:
    url = guarded_room.viewer.url
    assert "a-secret-token" in url
    page = ViewerPage(browser)
    page.open(url)
    browser.open(url.replace("a-secret-token", "another-token"))
    browser.until("document.querySelector('#message').innerText.includes('token')")
    assert browser.evaluate("flatland.state.worlds") == []
    browser.open("about:blank")
    browser.console()


def test_pages_of_other_origins_are_refused(room: ViewedWorld, browser: Chromium) -> None:
    """A page of another site, which the user has opened, cannot use the simulator."""
    port = urlsplit(room.viewer.url).port
    browser.open("data:text/html,<title>elsewhere</title>")
    result = browser.driver.execute_async_script(
        f"""
        const done = arguments[0];
        const socket = new WebSocket("ws://127.0.0.1:{port}/ws", ["flatland.1"]);
        socket.onmessage = () => done("message");
        socket.onclose = () => done("closed");
        """
    )
    assert result == "closed"
    browser.console()
    with pytest.raises(WebSocketBadStatusException):
        connect(room, origin="http://example.com")
    connect(room, origin=f"http://127.0.0.1:{port}").close()


# -- several clients -----------------------------------------------------------------------


def test_two_browsers_show_the_same(
    room: ViewedWorld, page: ViewerPage, other_browser: Chromium
) -> None:
    other = ViewerPage(other_browser)
    other.open(room.viewer.url)
    page.browser.drag(page.screen(2, -2), page.screen(3, 3))
    other_browser.until("flatland.state.worlds[0].models.crate.pose[1] > 2.9")
    other_browser.click("#pause")
    page.browser.until("flatland.state.worlds[0].paused")
    other_browser.until("flatland.state.worlds[0].paused")
    wait_until("the same time", lambda: page.time() == other.time() == time_of(room))
    assert page.models()["crate"]["pose"] == pytest.approx(other.models()["crate"]["pose"])
    assert other.models().keys() == page.models().keys()
    other_browser.open("about:blank")


def test_twenty_clients(room: ViewedWorld, page: ViewerPage) -> None:
    with ExitStack() as sockets:
        clients = [connect(room) for _ in range(19)]
        for client in clients:
            sockets.callback(client.close)
        for client in clients:
            hello = json.loads(client.recv())
            assert hello["type"] == "hello"
            client.send(json.dumps({"id": 1, "type": "look", "worlds": [0], "scans": True}))
        room.ask(lambda: room.world.command("/cmd_vel").set(Twist(angular_z=1.0)))
        for client in clients:
            while not isinstance(message := client.recv(), bytes) or message[0] != 3:
                pass  # until a scan
        turned = page.pose("robot")[2]
        page.browser.until("flatland.state.worlds[0].models.robot.pose[2] !== arguments[0]", turned)
    start = time_of(room)
    wait_until("the simulation continues", lambda: time_of(room) > start + 0.5)


def test_garbage_of_other_clients_does_not_disturb(room: ViewedWorld, page: ViewerPage) -> None:
    garbage: list[str | bytes] = [
        b"\x00\xff" * 500,
        "",
        "{",
        "[]",
        "null",
        '{"type": "pause"}{',
        '{"id": 1, "type": "nothing"}',
        '{"id": 1, "type": "move", "world": 0, "model": "robot", "pose": "everywhere"}',
        '{"id": 1, "type": "look", "worlds": [-1, 1e99, null]}',
        "[" * 100_000,
        "x" * 10_000_000,
    ]
    for data in garbage:
        client = connect(room)
        try:
            if isinstance(data, bytes):
                client.send_binary(data)
            else:
                client.send(data)
            while True:
                opcode, content = client.recv_data()
                if opcode == 8:
                    assert int.from_bytes(content[:2], "big") in (1003, 1007, 1008, 1009), data[:50]
                    break
        except OSError:
            pass  # closed while sending
        finally:
            client.close()
    assert not room.ask(lambda: room.world.paused)
    seen = page.time()
    page.browser.until("flatland.state.worlds[0].time > arguments[0]", seen)
    page.wait_for_connection("connected")


def test_a_sleeping_browser_does_not_hold_up_the_simulation(
    room: ViewedWorld, page: ViewerPage
) -> None:
    browser = page.browser
    room.ask(lambda: room.world.command("/cmd_vel").set(Twist(angular_z=1.0)))
    browser.freeze()
    try:
        start = time_of(room)
        wait_until("two seconds pass", lambda: time_of(room) > start + 2)
    finally:
        browser.thaw()
    browser.until("flatland.state.worlds[0].time > arguments[0]", start + 2)
    page.wait_for_connection("connected")


def test_a_hidden_tab_costs_no_scans(room: ViewedWorld, page: ViewerPage) -> None:
    wait_until("scans are wanted", room.scans_wanted)
    with page.browser.tab_in_front():
        wait_until("no scans are wanted", lambda: not room.scans_wanted())
        hidden = time_of(room)
        wait_until("time passes", lambda: time_of(room) > hidden + 0.5)
    wait_until("scans are wanted again", room.scans_wanted)
    page.browser.until("flatland.state.worlds[0].time > arguments[0]", hidden + 0.5)


# -- restarts ------------------------------------------------------------------------------


def test_the_page_survives_a_restart_of_the_simulator(browser: Chromium, tmp_path: Path) -> None:
    world = write_room(tmp_path)
    port = str(free_port())
    program = ViewProgram(world, "--port", port, "--paused")
    page = ViewerPage(browser)
    try:
        page.open(program.url)
        assert page.models().keys() == {"robot", "crate"}
        program.kill()
        page.wait_for_connection("reconnecting")
        text = world.read_text().replace("pose: [2, -2, 0]", "pose: [3, 3, 0]")
        world.write_text(text.replace("name: robot", "name: rover"))
        program = ViewProgram(world, "--port", port)
        page.wait_for_connection("connected")
        # Models may arrive in several messages.
        browser.until("(({rover, crate}) => rover && crate?.pose)(flatland.state.worlds[0].models)")
        assert page.models().keys() == {"rover", "crate"}
        assert page.pose("crate") == pytest.approx((3, 3, 0), abs=1e-6)
        seen = page.time()
        browser.until("flatland.state.worlds[0].time > arguments[0]", seen)
    finally:
        program.stop()
        browser.open("about:blank")
        browser.console()


def test_a_world_is_replaced(room: ViewedWorld, page: ViewerPage, tmp_path: Path) -> None:
    room.viewer.remove_world(room.handle)
    page.browser.until("!flatland.state.worlds[0] || document.body.innerText.match(/no world/i)")
    room.handle = room.viewer.add_world(room.world, simulation=room.simulation)
    page.browser.until("Boolean(flatland.state.worlds.at(-1)?.models?.robot)")
