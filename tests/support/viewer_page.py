"""The page of the browser viewer, as a user operates it."""

from __future__ import annotations

import math
from typing import Any

from chromium import Chromium, Image, Point


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
        """Waits until the page is connected and has drawn the models of its first world."""
        self.browser.until("Boolean(window.flatland && flatland.state)")
        self.wait_for_connection("connected")
        self.browser.until(
            "Object.keys(flatland.state.worlds[0]?.models ?? {}).length > 0 && flatland.frames > 2"
        )

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
        """Waits until the page has drawn a frame with the current state."""
        frames = self.browser.evaluate("flatland.frames")
        self.browser.until("flatland.frames > arguments[0] + 1", frames)

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

    def select(self, name: str) -> None:
        """Selects a model with a click on it."""
        x, y, _ = self.pose(name)
        self.browser.click(self.screen(x, y))
        self.browser.until("document.querySelector('#inspector').checkVisibility()")
        self.browser.until(
            "document.querySelector('#inspector').innerText.includes(arguments[0])", name
        )

    def show(self, display: str, shown: bool) -> None:
        """Switches a display on or off: layers, models, scans, frames, names, trails."""
        selector = f'input[data-display="{display}"]'
        if self.browser.evaluate(f"document.querySelector('{selector}').checked") != shown:
            self.reach(selector)
            self.browser.click(selector)
        self.browser.until(f"document.querySelector('{selector}').checked === arguments[0]", shown)

    def reach(self, selector: str) -> None:
        """Opens the panel or menu that contains an element."""
        raise NotImplementedError
