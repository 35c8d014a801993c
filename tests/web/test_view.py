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


def test_lasers_scan_only_for_visible_pages_that_show_scans(
    room: ViewedWorld, page: ViewerPage
) -> None:
    wait_until("the laser scans", room.scans_wanted)
    page.show("scans", False)
    wait_until("the laser rests", lambda: not room.scans_wanted())
    page.show("scans", True)
    wait_until("the laser scans again", room.scans_wanted)
    with page.browser.minimized():
        wait_until("the laser rests for a hidden page", lambda: not room.scans_wanted())
    wait_until("the laser scans for a visible page", room.scans_wanted)
    page.browser.until("flatland.state.worlds[0].time > arguments[0]", room.time())
