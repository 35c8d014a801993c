"""Connections: access, a simulator that halts, and one that starts again."""

from __future__ import annotations

import signal
from pathlib import Path

from chromium import Chromium
from free_ports import free_port
from viewed_world import ViewProgram, viewed_room, write_room
from viewer_page import ViewerPage


def test_the_page_requires_the_token(browser: Chromium, tmp_path: Path) -> None:
    with viewed_room(tmp_path, token="the-secret-token") as room:
        url = room.viewer.url
        assert "the-secret-token" in url
        page = ViewerPage(browser)
        page.open(url)
        browser.open(url.replace("the-secret-token", "another-token"))
        browser.until("document.querySelector('#message').innerText.includes('token')")
        assert browser.evaluate("flatland.state.worlds") == []
        browser.open("about:blank")
    browser.console()


def test_the_page_survives_a_halt_and_a_restart_of_the_simulator(
    browser: Chromium, tmp_path: Path
) -> None:
    world = write_room(tmp_path)
    # A port of the system's range could be that of an attempt of the browser to reconnect.
    port = str(free_port())
    program = ViewProgram(world, "--port", port, "--paused")
    page = ViewerPage(browser)
    try:
        page.open(program.url)
        assert page.models().keys() == {"robot", "crate"}
        program.process.send_signal(signal.SIGSTOP)
        page.wait_for_connection("no response")
        assert browser.evaluate("document.querySelector('#message').checkVisibility()")
        browser.until("getComputedStyle(document.querySelector('#canvas')).opacity < 0.5")
        program.process.send_signal(signal.SIGCONT)
        page.wait_for_connection("connected")
        browser.until("getComputedStyle(document.querySelector('#canvas')).opacity === '1'")
        program.kill()
        page.wait_for_connection("reconnecting")
        text = world.read_text().replace("pose: [2, -2, 0]", "pose: [3, 3, 0]")
        world.write_text(text.replace("name: robot", "name: rover"))
        program = ViewProgram(world, "--port", port)
        page.wait_for_connection("connected")
        page.wait_for_poses({"rover": (-2, 1, 0), "crate": (3, 3, 0)})
        seen = page.time()
        browser.until("flatland.state.worlds[0].time > arguments[0]", seen)
    finally:
        program.process.send_signal(signal.SIGCONT)
        program.stop()
        browser.open("about:blank")
        browser.console()
