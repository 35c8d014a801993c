"""Undo, reset, copies and earlier states of the world through the page."""

from __future__ import annotations

import pytest
from viewed_world import ViewedWorld
from viewer_page import ViewerPage
from waiting import wait_until

from flatland import Twist, World

CTRL = 2  # modifier of a key


def test_the_user_returns_to_earlier_states(room: ViewedWorld, page: ViewerPage) -> None:
    browser = page.browser
    # A deletion is undone by the button of its notice.
    page.select("crate")
    browser.key("Delete")
    wait_until("the crate is gone", lambda: room.names() == ["robot"])
    browser.until("document.querySelector('#notices .outlined')?.textContent === 'Undo'")
    before = room.time()
    browser.click("#notices .outlined")
    wait_until("the crate is there again", lambda: "crate" in room.names())
    assert room.pose("crate") == pytest.approx((2, -2, 0), abs=1e-3)
    assert room.time() >= before

    # A copy is pasted at the pointer, and the paste is undone by keys.
    browser.until("'crate' in flatland.state.models")
    page.select("crate")
    browser.key("c", modifiers=CTRL)
    browser.mouse("Moved", page.screen(-3, -3))
    browser.key("v", modifiers=CTRL)
    wait_until("the copy is there", lambda: "crate_2" in room.names())
    assert room.pose("crate_2")[:2] == pytest.approx((-3, -3), abs=0.05)
    browser.key("z", modifiers=CTRL)
    wait_until("the copy is gone", lambda: "crate_2" not in room.names())

    # The world is shown as it was before the robot drove, and then as it is now.
    slider = "document.querySelector('#history-slider')"
    start = room.pose("robot")
    browser.until(f"{slider}.max >= 1 && !{slider}.disabled")
    room.ask(lambda: room.world.command("/cmd_vel").set(Twist(linear_x=1.0)))
    wait_until("the robot has driven", lambda: room.pose("robot")[0] > start[0] + 0.3)
    browser.evaluate(f"{slider}.focus()")
    browser.key("Home")
    wait_until("an earlier state", lambda: room.pose("robot") == pytest.approx(start, abs=1e-3))
    page.wait_for_pause()
    browser.until("!document.querySelector('#history-newest').disabled")
    browser.click("#history-newest")
    wait_until("the newest state", lambda: room.pose("robot")[0] > start[0] + 0.3)
    browser.until("document.querySelector('#history-newest').disabled")
    browser.click("#reset")
    wait_until("the first state", lambda: room.pose("robot") == pytest.approx((-2, 1, 0), abs=1e-3))


def test_the_world_is_saved_by_the_menu(room: ViewedWorld, page: ViewerPage) -> None:
    browser = page.browser
    browser.click("#pause")
    page.wait_for_pause()
    room.ask(lambda: room.world.move_model("crate", (1, 3, 0.5)))
    x, y = page.screen(-4, -4)
    browser.mouse("Pressed", (x, y), button="right")
    browser.mouse("Released", (x, y), button="right")
    browser.until("!document.querySelector('#menu').hidden")
    browser.click("#menu button:last-child")
    path = browser.downloaded("world_saved*.yaml")
    folder = room.ask(lambda: room.world.source.resolve("."))
    with World.from_yaml(path.rename(f"{folder}/{path.name}")) as world:
        assert world.model("crate").pose == pytest.approx((1, 3, 0.5), abs=1e-6)
