"""Topics of other programs on the page: what is drawn, and the tools that publish poses."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from chromium import Chromium, Image, centroid, mask
from viewed_world import write_room
from viewer_page import ViewerPage
from waiting import wait_until

from flatland import World
from flatland.web import WebViewer
from flatland.web.foreign_topics import Grid, Marks, Topic, TopicDemand, TopicUpdate

# Hues that neither the page nor the room uses.
PATH_COLOR = (255, 128, 0)
AREA_COLOR = (0, 255, 0)
INSCRIBED_COLOR = (0, 255, 255)


def path() -> Marks:
    """Returns a line with the centre (-2, -4), and a triangle with the centre (3, 3)."""
    return Marks(
        np.array([[-4, -4, 0, -4, 0.3]], np.float32),
        np.array([[*PATH_COLOR, 255]], np.uint8),
        np.array([[2, 2, 5, 2, 2, 5]], np.float32),
        np.array([[*AREA_COLOR, 255]], np.uint8),
    )


def costmap() -> Grid:
    """Returns cells of which the right half, with the centre (-2.5, 4), costs 99."""
    cells = np.zeros((10, 10), np.int8)
    cells[:, 5:] = 99
    return Grid((-4.0, 3.0, 0.0), 0.2, cells)


class Source:
    """A path, a costmap and a topic without a transform.

    Attributes:
        poses: The poses that the page has published.
    """

    def __init__(self) -> None:
        self.poses: list[Any] = []
        self._drawn: frozenset[str] = frozenset()

    def update(self, demand: TopicDemand) -> TopicUpdate:
        new, self._drawn = demand.drawn - self._drawn, demand.drawn
        drawings: dict[str, Any] = {"/plan": path(), "/costmap": costmap()}
        topics = [
            Topic("/plan", "nav_msgs/Path", "marks"),
            Topic("/costmap", "nav_msgs/OccupancyGrid", "grid"),
            Topic("/lost", "nav_msgs/Path", "marks", 'no transform from "odom" to "map"'),
        ]
        shown = {name: each for name, each in drawings.items() if name in new}
        return TopicUpdate(topics, {"goal": ["/goal"], "initial_pose": ["/initialpose"]}, shown)

    def suspend(self) -> None:
        self._drawn = frozenset()

    def publish_pose(self, kind: str, topic: str, pose: Any) -> bool:
        self.poses.append((kind, topic, pose))
        return True


@pytest.fixture
def source() -> Source:
    return Source()


@pytest.fixture
def page(tmp_path: Path, browser: Chromium, source: Source) -> Iterator[ViewerPage]:
    """The page with a paused room and the topics; the test fails if the page logs an error."""
    world = World.from_yaml(write_room(tmp_path), seed=1)
    with WebViewer(port=0) as viewer, world:
        world.pause()
        viewer.add_world(world, foreign_topics=source)
        browser.console()
        page = ViewerPage(browser)
        page.open(viewer.url)
        browser.until("document.querySelectorAll('[data-topic]').length === 3")
        yield page
        errors = browser.console()
        # Otherwise the page would report that it cannot reconnect, in the next test.
        browser.open("about:blank")
        assert errors == []


def found(image: Image, color: tuple[int, int, int]) -> int:
    return int(np.count_nonzero(mask(image, color)))


def test_marks_and_a_costmap_are_drawn_where_they_are(page: ViewerPage) -> None:
    page.show("scans", False)
    page.show("models", False)
    expected = {
        "/plan": [(PATH_COLOR, (-2, -4)), (AREA_COLOR, (3, 3))],
        "/costmap": [(INSCRIBED_COLOR, (-2.5, 4))],
    }
    for topic, parts in expected.items():
        page.browser.click(f'[data-topic="{topic}"]')

        def is_drawn(image: Image, parts: Any = parts) -> bool:
            part = page.canvas(image)
            if any(found(part, color) < 100 for color, _ in parts):
                return False
            for color, at in parts:
                assert centroid(part, color) == pytest.approx(page.screen(*at), abs=4)
            return True

        page.browser.picture_until(f"{topic} is drawn", is_drawn)
        page.browser.click(f'[data-topic="{topic}"]')
        page.browser.picture_until(
            f"{topic} is removed",
            lambda image, parts=parts: all(
                found(page.canvas(image), color) < 10 for color, _ in parts
            ),
        )
    status = page.browser.evaluate("document.querySelector('.status:not([hidden])').textContent")
    assert status == 'no transform from "odom" to "map"'


def test_the_tools_fit_all_widths(page: ViewerPage) -> None:
    browser = page.browser
    labels = {1600: True, 1260: True, 1259: False, 1080: False, 800: False, 641: False, 390: False}
    try:
        for width, has_labels in labels.items():
            browser.resize(width, 800)
            page.wait_for_frame()
            shown, outside, rows, visible = browser.evaluate(
                """(() => {
                  const buttons = [...document.querySelectorAll(".top button")]
                    .filter((each) => each.checkVisibility());
                  const boxes = buttons.map((each) => each.getBoundingClientRect());
                  return [
                    [...document.querySelectorAll(".tools .text")].some((e) => e.checkVisibility()),
                    buttons.filter((_, i) => boxes[i].left < 0 || boxes[i].right > innerWidth)
                      .map((each) => each.id),
                    new Set(boxes.map(({top}) => Math.round(top))).size,
                    document.querySelector("#tool-goal").checkVisibility(),
                  ];
                })()"""
            )
            rows_allowed = 1 if width > 640 else 2
            expected = (width, has_labels, [], rows_allowed, True)
            assert (width, shown, outside, rows, visible) == expected
    finally:
        browser.resize(1200, 800)


def test_a_drag_publishes_a_goal(page: ViewerPage, source: Source) -> None:
    page.browser.key("o")
    page.browser.drag(page.screen(1, 1), page.screen(1, 3))
    wait_until("a pose", lambda: source.poses)
    ((kind, topic, pose),) = source.poses
    assert (kind, topic) == ("goal", "/goal")
    assert pose == pytest.approx((1, 1, np.pi / 2), abs=0.05)
