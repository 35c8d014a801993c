"""The page of the browser viewer, as a user operates it."""

from __future__ import annotations

import math
from typing import Any

from chromium import Chromium, Image, Point

# Returns to the first state of the page. The page listens for changes of its address first.
_RESET = """
const [done] = arguments;
for (const dialog of document.querySelectorAll("dialog[open]")) dialog.close();
for (const menu of document.querySelectorAll("[popover]")) menu.hidePopover();
for (const form of document.querySelectorAll("dialog form")) form.reset();
const buttons = document.querySelectorAll("figure.plot button, #notices [aria-label=Dismiss]");
for (const button of buttons) button.click();
document.querySelector("#plot-series").value = "";
if (!document.querySelector("#plots").hidden) document.querySelector("#plots-close").click();
if (document.body.dataset.panel === "closed") document.querySelector("#panel-toggle").click();
localStorage.clear();
document.querySelector("#tool-select").click();
document.activeElement.blur();
addEventListener("hashchange", () => done(), { once: true });
location.hash = `reset=${performance.now()}`;
"""


class ViewerPage:
    """The page in the current tab of a browser.

    Attributes:
        browser: The browser.
    """

    def __init__(self, browser: Chromium) -> None:
        self.browser = browser

    def open(self, url: str) -> None:
        """Loads the page and waits until it shows the world."""
        self.browser.open(url)
        self.wait_until_shown()

    def wait_until_shown(self) -> None:
        """Waits until the page is connected and has drawn the walls and models of all worlds."""
        self.browser.until("Boolean(window.flatland)")
        self.wait_for_connection("connected")
        self.browser.until(
            "((worlds) => worlds.length > 0 && worlds.every(({layers, models}) =>"
            " Object.keys(models).length > 0"
            " && layers.every(({edges}) => edges > 0)"
            " && Object.values(models).every(({pose}) => pose)))(flatland.state.worlds)"
        )
        self.wait_for_frame()  # which fits the view to the world

    def reset(self) -> None:
        """Returns to the state after loading: view, selection, displays, tools, plots, dialogs."""
        self.browser.run_async(_RESET)

    def wait_for_poses(
        self, poses: dict[str, tuple[float, float, float]], *, paused: bool = False
    ) -> None:
        """Waits until the page has drawn a world with exactly these models at these poses."""
        self.browser.until(
            "((expected, {paused, models}) => paused === arguments[1]"
            " && Object.keys(models).sort().join() === Object.keys(expected).sort().join()"
            " && Object.entries(expected).every(([name, pose]) =>"
            "   models[name].pose?.every((value, i) => Math.abs(value - pose[i]) < 1e-3)))"
            # Until the first message of a new connection, there is no world.
            "(arguments[0], flatland.state.worlds[0] ?? {paused: null})",
            poses,
            paused,
        )
        self.wait_for_frame()

    def wait_for_connection(self, text: str) -> None:
        """Waits for a state of the connection: connected, reconnecting."""
        self.browser.until(
            "(document.querySelector('#connection')?.textContent ?? '').toLowerCase()"
            ".includes(arguments[0])",
            text,
        )

    # -- the world as the page knows it ----------------------------------------------------

    def models(self, world: int = 0) -> dict[str, Any]:
        """Returns the models by name."""
        models = self.browser.evaluate("flatland.state.worlds[arguments[0]].models", world)
        return dict(models)

    def pose(self, name: str, world: int = 0) -> tuple[float, float, float]:
        """Returns the pose of a model: x, y [m], heading [rad]."""
        pose = self.models(world)[name]["pose"]
        return float(pose[0]), float(pose[1]), float(pose[2])

    def time(self) -> float:
        """Returns the simulated time that the page shows [s]."""
        return float(self.browser.evaluate("flatland.state.worlds[0].time"))

    # -- the view --------------------------------------------------------------------------

    def screen(self, x: float, y: float) -> Point:
        """Returns the point of the page of a point of the world [m]."""
        at = self.browser.evaluate("flatland.toScreen(arguments[0], arguments[1])", x, y)
        return float(at[0]), float(at[1])

    def world(self, at: Point) -> Point:
        """Returns the point of the world [m] of a point of the page."""
        point = self.browser.evaluate("flatland.toWorld(arguments[0], arguments[1])", *at)
        return float(point[0]), float(point[1])

    def scale(self) -> float:
        """Returns the scale of the view [pixels/m]."""
        (x0, y0), (x1, y1) = self.screen(0, 0), self.screen(1, 0)
        return math.hypot(x1 - x0, y1 - y0)

    def wait_for_frame(self) -> None:
        """Waits until the page has drawn what it has received."""
        # The page draws before the callbacks that are requested later.
        self.browser.run_async("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")

    def canvas(self, image: Image) -> Image:
        """Returns the part of a screenshot that is the canvas; the rest is black."""
        x, y, width, height = self.browser.evaluate(
            "((b) => [b.x, b.y, b.width, b.height])"
            "(document.querySelector('#canvas').getBoundingClientRect())"
        )
        part = image.copy()
        part[:] = 0
        rows, columns = slice(int(y), int(y + height)), slice(int(x), int(x + width))
        part[rows, columns] = image[rows, columns]
        return part

    # -- controls --------------------------------------------------------------------------

    def menu(self, item: str) -> None:
        """Clicks an item of the menu of pictures, link and theme, given by its CSS selector."""
        self.browser.click("#page-menu-toggle")
        self.browser.click(item)

    def select(self, name: str) -> None:
        """Selects a model with a click on it, and waits for its details."""
        x, y, _ = self.pose(name)
        self.browser.click(self.screen(x, y))
        self.browser.until("flatland.state.selected === arguments[0]", name)
        self.browser.until("document.querySelector('#details dl') !== null")

    def show(self, display: str, shown: bool) -> None:
        """Switches a display on or off: layers, models, scans, frames, names, trails."""
        if self.browser.evaluate("flatland.state.displays[arguments[0]]", display) != shown:
            self.browser.click(f'input[data-display="{display}"]')
        self.browser.until("flatland.state.displays[arguments[0]] === arguments[1]", display, shown)
        self.wait_for_frame()

    def wait_for_pause(self, paused: bool = True) -> None:
        """Waits until the page shows the world as paused, or as running."""
        self.browser.until("flatland.state.worlds[0].paused === arguments[0]", paused)
