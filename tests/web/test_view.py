"""What the page draws: the moving robot, displays, the view, and links to it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from chromium import Image, centroid, line, mask
from viewed_world import CRATE_COLOR, ROBOT_COLOR, WALL_COLOR, ViewedWorld
from viewer_page import ViewerPage
from waiting import wait_until

from flatland import Twist

FORWARD = Twist(linear_x=1.0)


def drive(room: ViewedWorld, twist: Twist) -> None:
    room.ask(lambda: room.world.command("/cmd_vel").set(twist))


def close_to(point: Any, tolerance: float = 3.0) -> Any:
    return pytest.approx(point, abs=tolerance)


def pixels(image: Image, color: tuple[int, int, int]) -> int:
    return int(np.count_nonzero(mask(image, color)))


def pause(room: ViewedWorld, page: ViewerPage) -> None:
    """Pauses the world and waits until the page has drawn its last state."""
    room.ask(room.world.pause)
    page.wait_for_pause()
    page.wait_for_poses({name: room.pose(name) for name in room.names()}, paused=True)


def test_the_world_is_drawn_where_it_is_while_the_robot_moves(
    room: ViewedWorld, page: ViewerPage
) -> None:
    page.show("scans", False)
    image = page.canvas(page.browser.picture())
    start = centroid(image, ROBOT_COLOR)
    assert start == close_to(page.screen(-2, 1))
    assert centroid(image, CRATE_COLOR) == close_to(page.screen(2, -2))
    rows, columns = np.nonzero(mask(image, WALL_COLOR))
    left, top = page.screen(-5, 5)
    right, bottom = page.screen(5, -5)
    limits = (columns.min(), columns.max(), rows.min(), rows.max())
    assert limits == close_to((left, right, top, bottom))

    drive(room, FORWARD)
    metre = page.scale()

    def moved(image: Image) -> bool:
        x, y = centroid(page.canvas(image), ROBOT_COLOR)
        assert y == close_to(start[1])
        return x > start[0] + metre

    page.browser.picture_until("the robot one metre further", moved)
    pause(room, page)
    x, y, _ = room.pose("robot")
    assert centroid(page.canvas(page.browser.picture()), ROBOT_COLOR) == close_to(page.screen(x, y))


def test_displays_are_switched_off_and_on(page: ViewerPage) -> None:
    page.show("scans", False)
    for display, color in (("layers", WALL_COLOR), ("models", CRATE_COLOR)):
        for shown in (True, False, True):
            page.show(display, shown)

            def is_right(image: Image, color: Any = color, shown: bool = shown) -> bool:
                found = pixels(page.canvas(image), color)
                return found > 100 if shown else found < 10

            page.browser.picture_until(f"{display}: {shown}", is_right)


def test_each_display_changes_the_picture(room: ViewedWorld, page: ViewerPage) -> None:
    displays = ("scans", "frames", "names", "trails")
    for display in displays:
        page.show(display, True)
    page.browser.until("flatland.state.worlds[0].scans === 1")
    drive(room, FORWARD)
    page.browser.until("flatland.state.worlds[0].models.robot.pose[0] > -1")
    pause(room, page)
    for display in displays:
        shown = page.canvas(page.browser.picture()).astype(int)
        page.show(display, False)

        def is_gone(image: Image, shown: Any = shown) -> bool:
            return int((np.abs(page.canvas(image) - shown).max(axis=-1) > 25).sum()) > 30

        page.browser.picture_until(f"{display} are not drawn", is_gone)
        page.wait_for_frame()


def test_wheel_drag_and_fingers_zoom_and_pan(page: ViewerPage) -> None:
    browser, before = page.browser, page.scale()
    ground = page.screen(0, 3)
    browser.wheel(ground, -240)
    browser.until("flatland.toScreen(1, 0)[0] - flatland.toScreen(0, 0)[0] > arguments[0]", before)
    assert page.world(ground) == close_to((0, 3), 0.3)
    start = page.screen(0, 3)
    end = (start[0] + 120, start[1] - 50)
    browser.drag(start, end)
    assert page.screen(0, 3) == close_to(end)

    browser.resize(1200, 800, touch=True)
    try:
        center, before = page.screen(0, 3), page.scale()
        near = [(center[0] - 40, center[1]), (center[0] + 40, center[1])]
        far = [(center[0] - 120, center[1]), (center[0] + 120, center[1])]
        browser.touch("Start", *near)
        for left, right in zip(line(near[0], far[0], 6), line(near[1], far[1], 6), strict=True):
            browser.touch("Move", left, right)
        browser.touch("End")
        assert page.scale() == pytest.approx(3 * before, rel=0.1)
        assert page.screen(0, 3) == close_to(center, 6)
    finally:
        browser.resize(1200, 800)


def test_the_view_follows_the_selected_robot(room: ViewedWorld, page: ViewerPage) -> None:
    page.select("robot")
    page.browser.click("#follow")
    page.browser.until("flatland.state.followed === 'robot'")
    drive(room, FORWARD)
    page.browser.until("flatland.state.worlds[0].models.robot.pose[0] > -1")
    pause(room, page)
    x, y, _ = room.pose("robot")
    box = page.browser.evaluate(
        "((b) => [b.x + b.width / 2, b.y + b.height / 2])"
        "(document.querySelector('#canvas').getBoundingClientRect())"
    )
    assert page.screen(x, y) == close_to(box)
    page.browser.drag(page.screen(0, 3), page.screen(1, 3))
    page.browser.until("flatland.state.followed === null")


def test_a_link_restores_the_view(page: ViewerPage) -> None:
    browser = page.browser
    browser.wheel(page.screen(1, 1), -360)
    browser.drag(page.screen(0, 2), page.screen(0.5, 2.5))
    page.show("names", False)
    page.menu("#share")
    browser.until("document.querySelector('#notices').innerText.startsWith('Link')")
    url = browser.until("location.hash.includes('zoom') && location.href")
    scale, point = page.scale(), page.screen(1, 1)
    page.open(url)
    assert page.scale() == pytest.approx(scale, rel=0.01)
    assert page.screen(1, 1) == close_to(point)
    assert not browser.evaluate("document.querySelector('[data-display=names]').checked")


def test_lasers_scan_only_for_visible_pages_that_show_scans(
    room: ViewedWorld, page: ViewerPage
) -> None:
    wait_until("the laser scans", room.scans_wanted)
    page.show("scans", False)
    wait_until("the laser rests", lambda: not room.scans_wanted())
    page.show("scans", True)
    wait_until("the laser scans again", room.scans_wanted)
    with page.browser.tab_in_front():
        wait_until("the laser rests for a hidden tab", lambda: not room.scans_wanted())
    wait_until("the laser scans for a visible tab", room.scans_wanted)
    page.browser.until("flatland.state.worlds[0].time > arguments[0]", room.time())
