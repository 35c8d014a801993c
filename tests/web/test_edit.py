"""Changes of the world through the page: drag, turn, spawn, delete, typed poses."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from chromium import Chromium, Image, line, mask
from viewed_world import CRATE_COLOR, ViewedWorld, viewed_room
from viewer_page import ViewerPage
from waiting import wait_until

from flatland import Twist
from flatland.web import commands


def close_to(pose: tuple[float, ...], tolerance: float = 0.1) -> object:
    return pytest.approx(pose, abs=tolerance)


def test_a_model_is_dragged_while_the_world_is_paused(room: ViewedWorld, page: ViewerPage) -> None:
    browser = page.browser
    start, end = page.screen(2, -2), page.screen(-1, -3)
    browser.press(start)
    browser.drag_over(line(start, end, 5))
    wait_until("the world is paused", lambda: room.ask(lambda: room.world.paused))
    browser.release(end)
    wait_until("the crate is there", lambda: room.pose("crate") == close_to((-1, -3, 0)))
    wait_until("the world runs again", lambda: not room.ask(lambda: room.world.paused))
    browser.until(
        "Math.hypot(flatland.state.worlds[0].models.crate.pose[0] + 1,"
        " flatland.state.worlds[0].models.crate.pose[1] + 3) < 0.1"
    )


def test_escape_ends_a_drag_without_effect(room: ViewedWorld, page: ViewerPage) -> None:
    browser = page.browser
    start, end = page.screen(2, -2), page.screen(-1, -3)
    browser.press(start)
    browser.drag_over(line(start, end, 5))
    wait_until("the world is paused", lambda: room.ask(lambda: room.world.paused))
    browser.key("Escape")
    wait_until("the world runs again", lambda: not room.ask(lambda: room.world.paused))
    browser.release(end)
    page.wait_for_frame()
    assert room.pose("crate") == close_to((2, -2, 0), 1e-6)


def test_a_paused_world_remains_paused_after_a_drag(room: ViewedWorld, page: ViewerPage) -> None:
    room.ask(room.world.pause)
    page.wait_for_pause()
    page.browser.drag(page.screen(2, -2), page.screen(3, 3))
    wait_until("the crate is there", lambda: room.pose("crate")[:2] == close_to((3, 3)))
    page.browser.evaluate("new Promise(requestAnimationFrame)")
    assert room.ask(lambda: room.world.paused)


def test_a_model_is_turned(room: ViewedWorld, page: ViewerPage) -> None:
    page.select("crate")
    radius = math.hypot(0.8, 0.3) + 14 / page.scale()  # of the ring around a selected model
    start, end = page.screen(2 + radius, -2), page.screen(2, -2 + radius)
    corner = page.screen(2 + radius, -2 + radius)
    page.browser.press(start)
    page.browser.drag_over([*line(start, corner, 4), *line(corner, end, 4)])
    wait_until("the world is paused", lambda: room.ask(lambda: room.world.paused))
    page.browser.release(end)
    wait_until(
        "the crate is turned by 90 degrees",
        lambda: room.pose("crate") == close_to((2, -2, math.pi / 2)),
    )
    wait_until("the world runs again", lambda: not room.ask(lambda: room.world.paused))


def test_a_world_runs_again_after_the_page_vanishes_in_a_drag(
    room: ViewedWorld, page: ViewerPage, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(commands, "HOLD_TIMEOUT", 1e6)
    start = page.screen(2, -2)
    page.browser.press(start)
    page.browser.drag_over(line(start, page.screen(0, -2), 3))
    wait_until("the world is paused", lambda: room.ask(lambda: room.world.paused))
    page.browser.open("about:blank")
    wait_until("the world runs again", lambda: not room.ask(lambda: room.world.paused))
    page.browser.release(start)
    page.browser.driver.back()
    page.wait_for_connection("connected")


def select_file(page: ViewerPage, name: str) -> None:
    """Opens the dialog and selects a model file with the keyboard."""
    browser = page.browser
    browser.click("#spawn")
    options = browser.until(
        "document.querySelector('#spawn-dialog').open &&"
        " [...document.querySelector('#spawn-file').options].map((option) => option.text)"
    )
    wanted = next(option for option in options if name in option)
    browser.evaluate("document.querySelector('#spawn-file').focus()")
    browser.type(wanted)
    browser.until(
        "document.querySelector('#spawn-file').selectedOptions[0].text === arguments[0]", wanted
    )


def test_a_model_is_spawned_with_a_preview(room: ViewedWorld, page: ViewerPage) -> None:
    browser = page.browser
    page.show("scans", False)
    page.show("names", False)

    def cyan(image: Image) -> int:
        return int(np.count_nonzero(mask(page.canvas(image), CRATE_COLOR)))

    before = cyan(browser.picture())
    select_file(page, "crate")
    browser.until("document.querySelector('#spawn-preview').ariaLabel.includes('1.60 by 0.60')")
    ratios = "((e) => [e.width / e.height, e.clientWidth / e.clientHeight])"
    drawn, shown = browser.evaluate(f"{ratios}(document.querySelector('#spawn-preview'))")
    assert drawn == pytest.approx(shown, rel=0.01), "the outline is not distorted"
    preview = browser.picture()
    assert cyan(preview) > before
    browser.fill("#spawn-name", "second")
    browser.click("#spawn-ok")
    place, ahead = page.screen(-3, -3), page.screen(-3, 2)
    still = browser.picture().astype(int)
    browser.mouse("Moved", place)

    def outline(image: Image) -> bool:
        x, y = map(int, place)
        reach = int(page.scale())
        area = slice(y - reach, y + reach), slice(x - reach, x + reach)
        return int((np.abs(image[area] - still[area]).max(axis=-1) > 40).sum()) > 100

    browser.picture_until("the outline follows the pointer", outline)
    browser.click(place)
    browser.mouse("Moved", ahead)
    assert "second" not in room.names()
    browser.click(ahead)
    wait_until("the model is in the world", lambda: "second" in room.names())
    assert room.pose("second") == close_to((-3, -3, math.pi / 2))
    browser.until("flatland.state.selected === 'second'")
    browser.picture_until("both crates are visible", lambda image: cyan(image) > 1.8 * before)


def test_a_model_is_spawned_at_typed_coordinates(room: ViewedWorld, page: ViewerPage) -> None:
    browser = page.browser
    select_file(page, "robot")
    browser.fill("#spawn-name", "second")
    browser.click("#spawn-by-numbers")
    for field, text in (("x", "3"), ("y", "1.5"), ("theta", "0.5")):
        browser.fill(f"#spawn-{field}", text)
    browser.click("#spawn-ok")
    wait_until("the model is in the world", lambda: "second" in room.names())
    assert room.pose("second") == close_to((3, 1.5, 0.5), 1e-6)
    room.ask(lambda: room.world.command("/second/cmd_vel"))


def test_a_model_is_spawned_from_a_typed_path(room: ViewedWorld, page: ViewerPage) -> None:
    browser = page.browser
    browser.click("#spawn")
    browser.until("document.querySelector('#spawn-dialog').open")
    browser.evaluate("document.querySelector('#spawn-file').focus()")
    browser.type("Other")
    browser.until("document.querySelector('#spawn-path').checkVisibility()")
    browser.click("#spawn-by-numbers")
    browser.click("#spawn-ok")
    error = "document.querySelector('#spawn-error').innerText"
    browser.until(f"{error}.includes('path')")
    browser.fill("#spawn-path", "missing.yaml")
    browser.click("#spawn-ok")
    browser.until(f"{error}.includes('missing.yaml')")
    assert browser.evaluate("document.querySelector('#spawn-dialog').open")
    browser.fill("#spawn-path", "crate.model.yaml")
    browser.key("Enter")
    browser.until("document.querySelector('#spawn-preview').ariaLabel.includes('1.60 by 0.60')")
    browser.until("document.querySelector('#spawn-name').value === 'crate'")
    browser.click("#spawn-ok")
    wait_until("the model is in the world", lambda: "crate1" in room.names())


def test_errors_of_the_simulator_are_shown(room: ViewedWorld, page: ViewerPage) -> None:
    browser = page.browser
    select_file(page, "crate")
    browser.fill("#spawn-name", "robot")
    browser.click("#spawn-number")
    browser.click("#spawn-by-numbers")
    browser.click("#spawn-ok")
    text = browser.until("document.querySelector('#notices [data-level=error]')?.innerText")
    assert "robot" in text
    assert sorted(room.names()) == ["crate", "robot"]


def test_a_model_is_deleted(room: ViewedWorld, page: ViewerPage) -> None:
    page.select("crate")
    page.browser.click("#delete")
    wait_until("the crate is deleted", lambda: room.names() == ["robot"])
    page.browser.until("!flatland.state.worlds[0].models.crate")
    page.show("scans", False)
    page.browser.picture_until(
        "no pixel of the crate is left",
        lambda image: not np.count_nonzero(mask(page.canvas(image), CRATE_COLOR)),
    )


def test_a_model_is_moved_to_typed_coordinates(room: ViewedWorld, page: ViewerPage) -> None:
    page.select("crate")
    page.browser.fill("#pose-x", "-1.5")
    page.browser.fill("#pose-y", "2.25")
    page.browser.fill("#pose-theta", "0.5")
    page.browser.click("#pose-apply")
    wait_until(
        "the crate is there",
        lambda: room.pose("crate") == close_to((-1.5, 2.25, 0.5), 1e-6),
    )


@pytest.fixture
def visited_room(browser: Chromium, tmp_path: Path) -> Iterator[tuple[ViewedWorld, ViewerPage]]:
    """A read-only viewer of a room, and its page."""
    with viewed_room(tmp_path, read_only=True) as room:
        page = ViewerPage(browser)
        page.open(room.viewer.url)
        yield room, page
        browser.open("about:blank")


def test_a_read_only_viewer_changes_nothing(
    visited_room: tuple[ViewedWorld, ViewerPage],
) -> None:
    room, page = visited_room
    browser = page.browser
    for selector in ("#pause", "#step", "#spawn", "#stick"):
        assert browser.evaluate(
            "((e) => !e || e.disabled || !e.checkVisibility({visibilityProperty: true})"
            " || e.getAttribute('aria-disabled') === 'true')"
            "(document.querySelector(arguments[0]))",
            selector,
        ), selector
    page.select("crate")
    browser.drag(page.screen(2, -2), page.screen(0, 0))
    browser.key("Delete")
    with_keys = room.ask(lambda: room.world.time)
    wait_until("time passes", lambda: room.ask(lambda: room.world.time) > with_keys + 0.2)
    assert room.pose("crate") == close_to((2, -2, 0), 1e-3)
    room.ask(lambda: room.world.command("/cmd_vel").set(Twist(linear_x=1.0)))
    page.browser.until("flatland.state.worlds[0].models.robot.pose[0] > -1.5")
