"""Accessibility, keyboard only, and phones."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest
from chromium import PHONE, Chromium, centroid
from viewed_world import ROBOT_COLOR, ViewedWorld
from viewer_page import ViewerPage
from waiting import wait_until


@pytest.mark.parametrize("view", ["light", "dark", "phone", "spawn dialog"])
def test_axe_finds_no_violation(
    room: ViewedWorld, page: ViewerPage, violations: Callable[[], list[Any]], view: str
) -> None:
    browser = page.browser
    page.select("robot")
    browser.until("document.querySelector('#inspector').textContent.includes('DiffDrive')")
    if view == "spawn dialog":
        browser.click("#spawn")
        browser.until("document.querySelector('#spawn-dialog').checkVisibility()")
        browser.evaluate(
            "((list) => { list.value = ''; list.dispatchEvent(new Event('change')); })"
            "(document.querySelector('#spawn-file'))"
        )
        assert browser.evaluate("document.querySelector('#spawn-path').checkVisibility()")
    elif view != "phone":
        browser.click("#plots-toggle")
        browser.type("twist")
        browser.until("document.querySelector('#plot-matches').checkVisibility()")
        browser.key("Enter")
        browser.type("twist")
        browser.until("document.querySelectorAll('.chart canvas').length > 0")
    # The page of a paused world draws nothing, and leaves the processor to axe.
    room.ask(room.world.pause)
    page.wait_for_pause()
    try:
        if view == "phone":
            browser.resize(*PHONE, touch=True)
        elif view != "spawn dialog":
            browser.prefer(prefers_color_scheme=view)
        page.wait_for_frame()
        assert violations() == []
    finally:
        browser.resize(1200, 800)
        browser.prefer()


def test_the_bar_of_the_time_is_not_crowded(page: ViewerPage) -> None:
    browser = page.browser
    try:
        for width in (1200, 960, 870, 830, 700, 641):
            browser.resize(width, 700)
            page.wait_for_frame()
            lines, overlapping, full = browser.evaluate(
                """(() => {
                  const size = (style) => parseFloat(style.lineHeight);
                  const lines = [...document.querySelectorAll(".bottom dt")].map((label) =>
                    Math.round(label.offsetHeight / size(getComputedStyle(label))));
                  const kinds = "button, dt, dd, input, output, p";
                  const boxes = [...document.querySelectorAll(`.bottom :is(${kinds})`)]
                    .map((e) => [e.id || e.innerText, e.getBoundingClientRect()]);
                  const overlapping = boxes.flatMap(([first, a], i) => boxes.slice(i + 1)
                    .filter(([, b]) => a.left < b.right && b.left < a.right
                      && a.top < b.bottom && b.top < a.bottom)
                    .map(([second]) => `${first}, ${second}`));
                  return [lines, overlapping, document.documentElement.scrollWidth];
                })()"""
            )
            assert (width, lines, overlapping, full) == (width, [1, 1], [], width)
    finally:
        browser.resize(1200, 800)


def test_light_and_dark(browser: Chromium, page: ViewerPage) -> None:
    page.show("scans", False)  # which have the colour of the robot
    brightness = {}
    for scheme in ("light", "dark"):
        browser.prefer(prefers_color_scheme=scheme)
        page.wait_for_frame()
        image = page.browser.picture()
        brightness[scheme] = float(image.mean())
        assert centroid(page.canvas(image), ROBOT_COLOR) == pytest.approx(page.screen(-2, 1), abs=3)
    browser.prefer()
    assert brightness["dark"] < 100 < 150 < brightness["light"]


def test_the_page_fits_a_phone(room: ViewedWorld, page: ViewerPage) -> None:
    browser = page.browser
    browser.resize(*PHONE, touch=True)
    try:
        browser.open(room.viewer.url)
        page.wait_until_shown()
        width, scroll = browser.evaluate("[innerWidth, document.documentElement.scrollWidth]")
        assert (width, scroll) == (PHONE[0], PHONE[0])
        x, y = page.screen(-2, 1)
        browser.touch("Start", (x, y))
        browser.touch("End")
        browser.until("flatland.state.selected === 'robot'")
        stick = "document.querySelector('#stick').checkVisibility()"
        assert browser.evaluate(stick)
        for shown in (False, True):
            x, y = browser.center("#drive-toggle")
            browser.touch("Start", (x, y))
            browser.touch("End")
            browser.until(f"{stick} === arguments[0]", shown)
        browser.click("#panel-toggle")
        browser.until("document.querySelector('#inspector').checkVisibility()")
        browser.until("document.querySelector('#inspector').innerText.includes('robot')")
        browser.click("#plots-toggle")
        browser.until("!document.querySelector('#plots').hidden")
        page.wait_for_frame()
        # The view keeps a part of the window, and the rest scrolls inside of the panels.
        assert browser.evaluate("document.querySelector('#canvas').clientHeight") > 150
        sizes = "[document.documentElement.scrollWidth, document.documentElement.scrollHeight]"
        assert browser.evaluate(sizes) == list(PHONE)
        browser.click("#plots-close")
        browser.click("#panel-toggle")
        assert browser.evaluate("document.querySelector('#pause').checkVisibility()")
        small = browser.evaluate(
            "[...document.querySelectorAll('button')].filter((b) => b.checkVisibility()"
            " && (b.offsetWidth < 24 || b.offsetHeight < 24)).map((b) => b.id || b.outerHTML)"
        )
        assert small == []
    finally:
        browser.resize(1200, 800)


def focus(browser: Chromium, selector: str) -> None:
    """Presses the tabulator until an element has the focus."""
    for _ in range(80):
        browser.key("Tab")
        if browser.evaluate("document.activeElement.matches(arguments[0])", selector):
            return
    pytest.fail(f"{selector} is not reached with the tabulator")


def test_a_model_is_spawned_moved_and_deleted_without_a_mouse(
    room: ViewedWorld, page: ViewerPage
) -> None:
    browser = page.browser
    focus(browser, "#pause")
    browser.key(" ")
    wait_until("the world is paused", lambda: room.ask(lambda: room.world.paused))
    browser.key(" ")
    focus(browser, "#spawn")
    for key in ("Enter", "Escape", "Enter"):  # Escape returns to the button
        browser.key(key)
        is_open = str(key == "Enter").lower()
        browser.until(f"document.querySelector('#spawn-dialog').checkVisibility() === {is_open}")
    browser.until("document.activeElement.id === 'spawn-file'")
    browser.until("document.querySelector('#spawn-name').value === 'crate'")
    focus(browser, "#spawn-ok")
    browser.key("Enter")
    browser.until("document.querySelector('#hint').textContent.includes('position')")
    for key in ("ArrowRight", "ArrowRight", "ArrowDown"):
        browser.key(key)
    view = browser.evaluate("flatland.state.view")
    browser.key("Enter")
    browser.until("document.querySelector('#hint').textContent.includes('heading')")
    browser.key("ArrowUp")
    browser.key("Enter")
    wait_until("the crate is spawned", lambda: "crate1" in room.names())
    assert view["x"] > 0 > view["y"], "the arrows have moved the view"
    assert room.pose("crate1") == pytest.approx((view["x"], view["y"], math.pi / 2), abs=1e-3)
    browser.until("flatland.state.selected === 'crate1'")
    browser.until("document.querySelector('#pose-x')?.value")
    focus(browser, "#pose-x")
    browser.type("-3")
    browser.key("Enter")
    wait_until("the crate is moved", lambda: room.pose("crate1")[0] == pytest.approx(-3, abs=1e-3))
    focus(browser, "[data-model=robot]")
    browser.key("Enter")
    browser.until("flatland.state.selected === 'robot'")
    focus(browser, "[data-model=crate]")
    browser.key("Enter")
    browser.until("flatland.state.selected === 'crate'")
    browser.key("Delete")
    wait_until("the crate is deleted", lambda: sorted(room.names()) == ["crate1", "robot"])
