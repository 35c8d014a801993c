"""Screenshots, recordings, plots and the inspector."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from chromium import Image, mask
from viewed_world import ROBOT_COLOR, WALL_COLOR, ViewedWorld
from viewer_page import ViewerPage

from flatland import Twist
from flatland.web.server import PAGE

EBML = b"\x1a\x45\xdf\xa3"  # first bytes of WebM


def test_screenshot(page: ViewerPage) -> None:
    browser = page.browser
    page.menu("#screenshot")
    path = browser.downloaded("flatland-*.png")
    image = cv2.imread(str(path))
    path.unlink()
    assert image is not None
    assert min(image.shape[:2]) > 300
    for color in (ROBOT_COLOR, WALL_COLOR):
        assert np.count_nonzero(mask(image[:, :, ::-1], color)) > 50


def test_recording(room: ViewedWorld, page: ViewerPage) -> None:
    browser = page.browser
    page.show("scans", False)  # which have the colour of the robot
    browser.resize(700, 500)  # which is encoded faster
    page.wait_for_frame()
    page.menu("#record")
    browser.until("document.querySelector('#notices').innerText.includes('Recording')")
    before = page.pose("robot")
    room.ask(lambda: room.world.command("/cmd_vel").set(Twist(linear_x=1.0)))
    frames = browser.evaluate("flatland.frames")
    browser.until(
        "flatland.frames > arguments[0] + 10 &&"
        " flatland.state.worlds[0].models.robot.pose[0] > arguments[1] + 1",
        frames,
        before[0],
    )
    page.menu("#record")
    path = browser.downloaded("flatland-*.webm")
    browser.resize(1200, 800)
    assert path.read_bytes()[:4] == EBML
    video = cv2.VideoCapture(str(path))
    places = []
    while True:
        found, image = video.read()
        if not found:
            break
        places.append(np.nonzero(mask(image[:, :, ::-1], ROBOT_COLOR))[1].mean())
    video.release()
    path.unlink()
    assert len(places) >= 2
    assert max(places) > min(places) + 5, "the robot moves"


@pytest.mark.skipif(
    not (PAGE / "vendor" / "uplot").is_dir(),
    reason="uPlot is not installed (make setup installs it)",
)
def test_plots_show_published_numbers(room: ViewedWorld, page: ViewerPage) -> None:
    browser = page.browser
    room.ask(lambda: room.world.command("/cmd_vel").set(Twist(angular_z=0.5)))
    browser.click("#plots-toggle")
    name = "/odometry/ground_truth/twist/2"
    browser.type("twist 2 truth")
    browser.until("document.querySelector('#plot-matches li')?.dataset.name === arguments[0]", name)
    browser.key("Enter")
    browser.until("document.querySelector('figure.plot')?.dataset.series === arguments[0]", name)
    browser.until("parseFloat(document.querySelector('figure.plot output').textContent) === 0.5")
    browser.until("document.querySelector('figure.plot canvas') !== null")
    x, y, width, height = browser.evaluate(
        "((b) => [b.x, b.y, b.width, b.height].map(Math.round))"
        "(document.querySelector('figure.plot canvas').getBoundingClientRect())"
    )

    def curve(image: Image) -> bool:
        part = image[y : y + height, x : x + width].astype(int)
        return int((part.max(axis=-1) - part.min(axis=-1) > 60).sum()) > 20

    browser.picture_until("the curve", curve)
    page.select("robot")
    browser.click(".plot-number[data-series='/odometry/ground_truth/twist/0']")
    browser.until("document.querySelectorAll('.chart canvas').length === 2")
