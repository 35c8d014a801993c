"""Tools of the page: measure, screenshot, recording, plots, inspector."""

from __future__ import annotations

import math
import re

import cv2
import numpy as np
import pytest
from chromium import Image, mask
from viewed_world import ROBOT_COLOR, WALL_COLOR, ViewedWorld
from viewer_page import ViewerPage

from flatland import Twist

EBML = b"\x1a\x45\xdf\xa3"  # first bytes of WebM


def test_measure(page: ViewerPage) -> None:
    browser = page.browser
    browser.click("#measure")
    start, end = page.screen(-3, -3), page.screen(0, 1)
    browser.click(start)
    browser.mouse("Moved", end)
    browser.click(end)
    measured = browser.until(
        "(document.querySelector('#hint').textContent.match(/^4.9|^5.0/)?.input)"
    )
    length, dx, dy, angle = map(float, re.findall(r"-?\d+\.\d+", measured))
    assert (length, dx, dy) == pytest.approx((5, 3, 4), abs=0.05)
    assert angle == pytest.approx(math.degrees(math.atan2(4, 3)), abs=1)


def test_screenshot(page: ViewerPage) -> None:
    browser = page.browser
    browser.click("#screenshot")
    path = browser.downloaded("*.png")
    image = cv2.imread(str(path))
    path.unlink()
    assert image is not None
    assert min(image.shape[:2]) > 300
    for color in (ROBOT_COLOR, WALL_COLOR):
        assert np.count_nonzero(mask(image[:, :, ::-1], color)) > 50


def test_recording(room: ViewedWorld, page: ViewerPage) -> None:
    browser = page.browser
    room.ask(lambda: room.world.command("/cmd_vel").set(Twist(linear_x=1.0)))
    browser.click("#record")
    frames = browser.evaluate("flatland.frames")
    browser.until("flatland.frames > arguments[0] + 20", frames)
    browser.click("#record")
    path = browser.downloaded("*.webm")
    assert path.read_bytes()[:4] == EBML
    video = cv2.VideoCapture(str(path))
    images = []
    while True:
        found, image = video.read()
        if not found:
            break
        images.append(image[:, :, ::-1])
    video.release()
    path.unlink()
    assert len(images) >= 5
    first, last = (np.nonzero(mask(image, ROBOT_COLOR))[1] for image in (images[0], images[-1]))
    assert last.mean() > first.mean() + 5


def test_the_inspector_shows_the_values_of_the_model(room: ViewedWorld, page: ViewerPage) -> None:
    page.select("crate")
    mass = 1.6 * 0.6
    page.browser.until(
        "document.querySelector('#inspector').innerText.includes(arguments[0])", f"{mass:.2f}"
    )
    assert page.browser.evaluate("Number(document.querySelector('#pose-x').value)") == 2
    page.select("robot")
    for text in ("DiffDrive", "Laser", "/scan", "ranges: 311 values", "pub_rate"):
        page.browser.until(
            "document.querySelector('#inspector').textContent.includes(arguments[0])", text
        )


def test_the_inspector_shows_contacts(room: ViewedWorld, page: ViewerPage) -> None:
    room.ask(lambda: room.world.move_model("robot", (4.65, 2, 0)))
    page.browser.until("flatland.state.worlds[0].models.robot.pose[0] > 4")
    page.select("robot")
    page.browser.until("document.querySelector('#inspector').textContent.includes('walls')")


def test_plots_show_published_numbers(room: ViewedWorld, page: ViewerPage) -> None:
    browser = page.browser
    room.ask(lambda: room.world.command("/cmd_vel").set(Twist(angular_z=0.5)))
    browser.click("#plots-toggle")
    options = "[...document.querySelector('#plot-series').options].map((option) => option.value)"
    names = browser.until(f"{options}.length > 1 && {options}")
    name = "/odometry/ground_truth/twist/2"
    assert name in names
    # Each typed letter selects a number whose name begins with the letters so far.
    browser.type(name)
    browser.until("document.querySelector('#plot-series').value === arguments[0]", name)
    assert browser.evaluate("document.querySelectorAll('figure.plot').length") == 0
    browser.key("Enter")
    browser.until("document.querySelector('figure.plot')?.dataset.series === arguments[0]", name)
    assert browser.evaluate("document.querySelectorAll('figure.plot').length") == 1
    browser.until("parseFloat(document.querySelector('figure.plot output').textContent) === 0.5")
    box = browser.evaluate(
        "((b) => [b.x, b.y, b.width, b.height].map(Math.round))"
        "(document.querySelector('figure.plot canvas').getBoundingClientRect())"
    )
    x, y, width, height = box

    def curve(image: Image) -> bool:
        part = image[y : y + height, x : x + width].astype(int)
        return int((part.max(axis=-1) - part.min(axis=-1) > 60).sum()) > 20

    browser.picture_until("the curve", curve)
