"""Several worlds of one viewer, shown as a grid of small views."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from chromium import Chromium, Image, mask
from viewed_world import ROBOT_COLOR, ViewedWorld, write_room
from viewer_page import ViewerPage
from waiting import wait_until

from flatland import Twist
from flatland.web import WebViewer


@pytest.fixture
def rooms(tmp_path: Path) -> Iterator[list[ViewedWorld]]:
    """Four rooms of one viewer."""
    path = write_room(tmp_path)
    with WebViewer(port=0) as viewer:
        rooms = [ViewedWorld(viewer, path, name=f"room {i}") for i in range(4)]
        yield rooms
        for room in rooms:
            room.close()


def robots(page: ViewerPage, image: Image) -> int:
    """The number of connected areas of the colour of the robot."""
    found = mask(page.canvas(image), ROBOT_COLOR).astype(np.uint8)
    count, _, stats, _ = cv2.connectedComponentsWithStats(found)
    return sum(int(stats[i, cv2.CC_STAT_AREA]) > 20 for i in range(1, count))


def test_all_worlds_are_visible_and_one_is_enlarged(
    rooms: list[ViewedWorld], browser: Chromium
) -> None:
    page = ViewerPage(browser)
    browser.console()
    page.open(rooms[0].viewer.url)
    page.show("scans", False)  # which have the colour of the robots

    def wait_for_robots(number: int) -> None:
        browser.picture_until(f"{number} robots", lambda image: robots(page, image) == number)

    wait_for_robots(4)
    rooms[2].ask(lambda: rooms[2].world.command("/cmd_vel").set(Twist(linear_x=1.0)))
    browser.until("flatland.state.worlds[2].models.robot.pose[0] > -1")
    assert page.pose("robot", 1) == pytest.approx((-2, 1, 0))
    browser.click(".tile:nth-child(3)")
    browser.until("flatland.state.current === 2")
    wait_for_robots(1)
    browser.click("#pause")
    wait_until("that world is paused", lambda: rooms[2].ask(lambda: rooms[2].world.paused))
    assert not rooms[1].ask(lambda: rooms[1].world.paused)
    browser.click("#all-worlds")
    wait_for_robots(4)
    rooms.pop().close()
    wait_for_robots(3)
    rooms.append(ViewedWorld(rooms[0].viewer, Path(rooms[0].world.path), name="another"))
    wait_for_robots(4)
    assert browser.console() == []
    browser.open("about:blank")
