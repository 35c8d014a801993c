"""Pause, steps and the rate; driving with keys and the stick."""

from __future__ import annotations

import math

import pytest
from chromium import Chromium, keys_held, line
from viewed_world import ViewedWorld
from viewer_page import ViewerPage
from waiting import wait_until


def time_of(room: ViewedWorld) -> int:
    return room.ask(lambda: room.world.timekeeper.sim_time_ns)


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


# -- time ----------------------------------------------------------------------------------


def test_pause_and_resume(room: ViewedWorld, page: ViewerPage) -> None:
    page.browser.click("#pause")
    wait_until("the world is paused", lambda: is_paused(room))
    page.wait_for_pause()
    shown = page.browser.until("document.querySelector('#time').textContent")
    assert any(character.isdigit() for character in shown)
    page.browser.click("#pause")
    wait_until("the world runs", lambda: not is_paused(room))
    page.browser.until("document.querySelector('#time').textContent !== arguments[0]", shown)


def test_a_single_step(room: ViewedWorld, page: ViewerPage) -> None:
    page.browser.click("#pause")
    wait_until("the world is paused", lambda: is_paused(room))
    before = time_of(room)
    page.browser.click("#step")
    wait_until("one step", lambda: time_of(room) > before)
    assert time_of(room) - before == room.world.timekeeper.step_size_ns
    assert is_paused(room)


def test_a_pause_by_another_program_is_displayed(room: ViewedWorld, page: ViewerPage) -> None:
    label = page.browser.evaluate("document.querySelector('#pause').outerHTML")
    room.ask(room.world.pause)
    page.browser.until("document.querySelector('#pause').outerHTML !== arguments[0]", label)


def test_the_rate_and_the_real_time_factor(room: ViewedWorld, page: ViewerPage) -> None:
    browser = page.browser
    factor = "parseFloat(document.querySelector('#rtf').textContent)"
    browser.until(f"Math.abs({factor} - 1) < 0.1")
    browser.evaluate("document.querySelector('#rate').focus()")
    browser.key("Home")
    wait_until("a lower rate", lambda: room.ask(lambda: room.simulation.rate) == 10)
    browser.until("document.querySelector('#rate-text').textContent.startsWith('10 Hz')")
    browser.until(f"Math.abs({factor} - 0.05) < 0.02")
    browser.key("End")
    wait_until("no limit", lambda: room.ask(lambda: room.simulation.rate) == math.inf)
    browser.until(f"{factor} > 2")


# -- driving -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("key", "forward", "turn"),
    [("ArrowUp", 1, 0), ("s", -1, 0), ("ArrowLeft", 0, 1), ("d", 0, -1)],
)
def test_keys_drive_the_selected_robot(
    room: ViewedWorld, page: ViewerPage, key: str, forward: int, turn: int
) -> None:
    page.select("robot")

    def drives() -> bool:
        v, w = speed(room)
        return (abs(v) < 0.01 if forward == 0 else v * forward > 0.1) and (
            abs(w) < 0.01 if turn == 0 else w * turn > 0.1
        )

    with keys_held(page.browser, key):
        wait_until(f"the robot drives with {key}", drives)
    wait_until("the robot stands", lambda: speed(room) == pytest.approx((0, 0), abs=1e-3))


def test_two_keys_drive_a_curve(room: ViewedWorld, page: ViewerPage) -> None:
    page.select("robot")
    with keys_held(page.browser, "w", "a"):
        wait_until("a curve", lambda: speed(room)[0] > 0.1 and speed(room)[1] > 0.1)
    wait_until("the robot stands", lambda: speed(room) == pytest.approx((0, 0), abs=1e-3))


def test_the_stick_drives_with_mouse_and_finger(room: ViewedWorld, page: ViewerPage) -> None:
    browser = page.browser
    page.select("robot")
    x, y = browser.center("#stick")
    browser.press((x, y))
    browser.drag_over(line((x, y), (x, y - 40), 3))
    wait_until("the robot drives", lambda: speed(room)[0] > 0.1)
    browser.release((x, y - 40))
    wait_until("the robot stands", lambda: speed(room) == pytest.approx((0, 0), abs=1e-3))
    browser.touch("Start", (x, y))
    browser.touch("Move", (x - 40, y))
    wait_until("the robot turns", lambda: speed(room)[1] > 0.1)
    browser.touch("End")
    wait_until("the robot stands", lambda: speed(room) == pytest.approx((0, 0), abs=1e-3))


def test_the_robot_stops_if_the_window_loses_the_focus(room: ViewedWorld, page: ViewerPage) -> None:
    page.select("robot")
    page.browser.key_down("w")
    wait_until("the robot drives", lambda: speed(room)[0] > 0.1)
    page.browser.evaluate("window.dispatchEvent(new Event('blur'))")
    wait_until("the robot stands", lambda: speed(room) == pytest.approx((0, 0), abs=1e-3))
    page.browser.key_up("w")


def test_the_robot_stops_if_the_tab_is_hidden(room: ViewedWorld, page: ViewerPage) -> None:
    page.select("robot")
    x, y = page.browser.center("#stick")
    page.browser.touch("Start", (x, y))
    page.browser.touch("Move", (x, y - 40))
    wait_until("the robot drives", lambda: speed(room)[0] > 0.1)
    with page.browser.tab_in_front():
        wait_until("the robot stands", lambda: speed(room) == pytest.approx((0, 0), abs=1e-3))
    page.browser.touch("Cancel")


def test_the_robot_stops_if_the_tab_is_closed(room: ViewedWorld, browser: Chromium) -> None:
    first = browser.driver.current_window_handle
    browser.new_tab()
    try:
        page = ViewerPage(browser)
        page.open(room.viewer.url)
        page.select("robot")
        browser.key_down("w")
        wait_until("the robot drives", lambda: speed(room)[0] > 0.1)
        browser.driver.close()
    finally:
        browser.driver.switch_to.window(first)
    wait_until("the robot stands", lambda: speed(room) == pytest.approx((0, 0), abs=1e-3))
