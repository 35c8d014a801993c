"""Changes of the world through the page: drag, spawn, typed poses, pause, drive."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from chromium import Chromium, Image, keys_held, line, mask
from viewed_world import CRATE_COLOR, ViewedWorld, viewed_room
from viewer_page import ViewerPage
from waiting import wait_until

from flatland import Twist


def close_to(pose: tuple[float, ...], tolerance: float = 0.1) -> object:
    return pytest.approx(pose, abs=tolerance)


def is_paused(room: ViewedWorld) -> bool:
    return room.ask(lambda: room.world.paused)


def speed(room: ViewedWorld) -> tuple[float, float]:
    """The forward velocity [m/s] and the angular velocity [rad/s] of the robot."""

    def read() -> tuple[float, float]:
        state = room.world.state()
        i = state.names.index("robot")
        vx, vy, angular = map(float, state.velocities[i])
        theta = float(state.poses[i][2])
        return vx * math.cos(theta) + vy * math.sin(theta), angular

    return room.ask(read)


def wait_until_it_stands(room: ViewedWorld) -> None:
    wait_until("the robot stands", lambda: speed(room) == pytest.approx((0, 0), abs=1e-3))


# -- models --------------------------------------------------------------------------------


def test_a_model_is_dragged_while_the_world_is_paused(room: ViewedWorld, page: ViewerPage) -> None:
    browser = page.browser
    start, end = page.screen(2, -2), page.screen(-1, -3)
    browser.press(start)
    browser.drag_over(line(start, end, 5))
    wait_until("the world is paused", lambda: is_paused(room))
    browser.release(end)
    wait_until("the crate is there", lambda: room.pose("crate") == close_to((-1, -3, 0)))
    wait_until("the world runs again", lambda: not is_paused(room))
    page.wait_for_poses({"robot": room.pose("robot"), "crate": room.pose("crate")})


def test_a_model_is_spawned_with_a_preview(room: ViewedWorld, page: ViewerPage) -> None:
    browser = page.browser
    page.show("scans", False)
    page.show("names", False)

    def cyan(image: Image) -> int:
        return int(np.count_nonzero(mask(page.canvas(image), CRATE_COLOR)))

    before = cyan(browser.picture())
    browser.click("#spawn")
    browser.until("document.querySelector('#spawn-dialog').open")
    browser.evaluate("document.querySelector('#spawn-file').focus()")
    browser.type("crate")
    browser.until("document.querySelector('#spawn-preview').ariaLabel.includes('1.60 by 0.60')")
    ratios = "((e) => [e.width / e.height, e.clientWidth / e.clientHeight])"
    drawn, shown = browser.evaluate(f"{ratios}(document.querySelector('#spawn-preview'))")
    assert drawn == pytest.approx(shown, rel=0.01), "the outline is not distorted"
    assert cyan(browser.picture()) > before
    browser.fill("#spawn-name", "second")
    browser.click("#spawn-ok")
    browser.until("document.querySelector('#hint').textContent.includes('position')")
    place, ahead = page.screen(-3, -3), page.screen(-3, 2)
    page.wait_for_frame()
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
    browser.picture_until("both crates are visible", lambda image: cyan(image) > 1.6 * before)


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
    for selector in ("#pause", "#step", "#spawn", "#stick", "#undo", "#reset", "#history"):
        assert not browser.evaluate(
            "document.querySelector(arguments[0]).checkVisibility({visibilityProperty: true})",
            selector,
        ), selector
    page.select("crate")
    browser.drag(page.screen(2, -2), page.screen(0, 0))
    browser.key("Delete")
    # The server handles messages of a client in their order; the selection is the last one.
    page.select("robot")
    assert room.pose("crate") == close_to((2, -2, 0), 1e-3)
    room.ask(lambda: room.world.command("/cmd_vel").set(Twist(linear_x=1.0)))
    page.browser.until("flatland.state.worlds[0].models.robot.pose[0] > -1.5")


# -- time ----------------------------------------------------------------------------------


def test_pause_step_and_resume(room: ViewedWorld, page: ViewerPage) -> None:
    browser = page.browser
    browser.click("#pause")
    wait_until("the world is paused", lambda: is_paused(room))
    page.wait_for_pause()
    before = room.time()
    browser.click("#step")
    wait_until("one step", lambda: room.time() == pytest.approx(before + 0.005, abs=1e-6))
    assert is_paused(room)
    browser.click("#pause")
    wait_until("the world runs", lambda: not is_paused(room))
    shown = "document.querySelector('#time').textContent"
    browser.until(f"parseFloat({shown}) > arguments[0]", before + 0.1)


# -- driving -------------------------------------------------------------------------------


def test_keys_drive_the_selected_robot(room: ViewedWorld, page: ViewerPage) -> None:
    page.select("robot")
    with keys_held(page.browser, "w", "a"):
        wait_until("a curve", lambda: speed(room)[0] > 0.1 and speed(room)[1] > 0.1)
    wait_until_it_stands(room)
