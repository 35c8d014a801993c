"""Captures the images and the recording of the viewer in the browser in README.md and docs/.

Requires the environment of setup.bash, with tests/support on PYTHONPATH.
The page runs in a headless Chromium, which is operated as by a user. The recording is made in
lockstep, because screenshots take longer than its frames. It contains a mouse pointer, which
screenshots of the browser lack.
"""

from __future__ import annotations

import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from chromium import PHONE, Chromium, line, missing_programs
from picture_folder import picture_folder
from PIL import Image, ImageDraw
from viewer_page import ViewerPage

import flatland.gym
from flatland import World
from flatland.geometry import Pose
from flatland.gym import live_view
from flatland.simulation import Simulation
from flatland.web import WebViewer

Point = tuple[float, float]

_CHECKOUT = Path(__file__).resolve().parent.parent
_OFFICE = _CHECKOUT / "worlds" / "office"
_SIZE = (1200, 760)  # of the page [px]
_RECORDING_SIZE = (1080, 640)
_FRAME_STEPS = 20  # of the world
_FRAME_PERIOD = 0.1  # s of simulated time, and of the recording
_DRAWN_TIMEOUT = 20.0  # s
_QUALITY = 60  # of the frames, 0 to 100
# Name of the model file, pose (x, y [m], yaw [rad]).
_FURNITURE = (("box", (3.4, -4.9, 0.4)), ("chair", (1.5, -6.2, 2.0)), ("chair", (5.5, -5.2, 0.0)))
_CURSOR = ((0, 0), (0, 17), (4, 13), (7, 20), (10, 19), (7, 12), (12, 12))
_ROBOT_VIEW = "#x=1.5&y=-4.2&zoom=62&select=robot"


def main(arguments: list[str]) -> int:
    """Captures all images."""
    folder = picture_folder(str(__doc__), arguments)
    missing = missing_programs()
    if missing:
        print(f"not installed: {', '.join(missing)} (make setup-dev installs them)")
        return 1
    with tempfile.TemporaryDirectory() as downloads, Chromium(Path(downloads)) as browser:
        with _office(_FURNITURE, lockstep=True) as (url, simulation):
            _record(browser, url, simulation, folder / "browser.webp")
        with _office(_FURNITURE) as (url, _):
            _capture_desktop(browser, url, folder / "browser.png")
            _capture_phone(browser, url, folder / "browser_phone.png")
        _capture_grid(browser, folder / "browser_grid.png")
    return 0


@contextmanager
def _office(
    furniture: Sequence[tuple[str, Pose]], *, lockstep: bool = False
) -> Iterator[tuple[str, Simulation]]:
    """Runs the office with furniture; returns the address of its page, and the simulation."""
    with World.from_yaml(_OFFICE / "world.yaml", seed=1) as world, WebViewer(port=0) as viewer:
        for number, (kind, pose) in enumerate(furniture, start=1):
            world.spawn_model(f"{kind}.model.yaml", f"{kind}_{number}", pose=pose)
        simulation = Simulation(world, lockstep=lockstep)
        viewer.add_world(world, "office", simulation)
        thread = threading.Thread(target=simulation.run)
        thread.start()
        try:
            yield viewer.url, simulation
        finally:
            simulation.stop()
            thread.join()


def _capture_desktop(browser: Chromium, url: str, path: Path) -> None:
    """Captures the robot in the inspector while it is driven, with plots and trails."""
    browser.resize(*_SIZE)
    page = ViewerPage(browser)
    page.open(f"{url}{_ROBOT_VIEW}&show=trails")
    browser.click("#plots-toggle")
    _choose_series(browser, ("/odometry/filtered/twist/0", "/odometry/filtered/twist/2"))
    browser.run(
        "const list = document.querySelector('#plot-window'); list.value = '10';"
        "list.dispatchEvent(new Event('change')); document.activeElement.blur();"
    )
    time.sleep(2.0)  # of the plots
    # A slalom between the walls of the corridor.
    browser.key_down("w")
    time.sleep(1.2)
    for key, seconds in (("a", 0.4), ("d", 0.9)):
        _drive(browser, key, seconds)
        time.sleep(0.4)
    browser.key_down("a")
    time.sleep(0.5)
    _save(browser, path)
    browser.key_up("a")
    browser.key_up("w")


def _choose_series(browser: Chromium, wanted: Sequence[str]) -> None:
    """Adds numbers to the plots."""
    for name in wanted:
        browser.fill("#plot-series", name)
        browser.until(
            "document.querySelector('#plot-matches li')?.dataset.name === arguments[0]", name
        )
        browser.key("Enter")


def _drive(browser: Chromium, keys: str, seconds: float) -> None:
    """Holds keys that drive the selected robot."""
    for key in keys:
        browser.key_down(key)
    time.sleep(seconds)
    for key in keys:
        browser.key_up(key)


def _capture_phone(browser: Chromium, url: str, path: Path) -> None:
    """Captures the page in the dark theme on a phone."""
    browser.prefer(prefers_color_scheme="dark")
    browser.resize(*PHONE, touch=True)
    page = ViewerPage(browser)
    page.open(f"{url}#x=0.5&y=-4.5&zoom=48&select=robot")
    time.sleep(1.0)
    _save(browser, path)
    browser.prefer()
    browser.resize(*_SIZE)


def _capture_grid(browser: Chromium, path: Path) -> None:
    """Captures a vector of environments."""
    browser.resize(*_SIZE)
    envs = flatland.gym.make_vec(
        "flatland/Corridor-v0", num_envs=6, render_mode="human", web_port=0
    )
    envs.reset(seed=3)
    viewer: Any = live_view.SHARED._viewer
    browser.open(viewer.url)
    for _ in range(25):
        envs.step(np.tile(np.array([0.6, 0.1], np.float32), (6, 1)))
    _save(browser, path)
    envs.close()


def _save(browser: Chromium, path: Path) -> None:
    Image.fromarray(browser.picture()).quantize(256, dither=Image.Dither.NONE).save(
        path, optimize=True
    )
    print(f"{path}: {path.stat().st_size // 1000} kB")


# -- the recording -------------------------------------------------------------------------


class Recording:
    """Screenshots of the page with a mouse pointer, each with its duration."""

    def __init__(self, browser: Chromium, simulation: Simulation) -> None:
        """Starts with the pointer at the lower edge of the page."""
        self._browser = browser
        self._simulation = simulation
        self._frames: list[Image.Image] = []
        self._at: Point = (0.4 * _RECORDING_SIZE[0], 0.85 * _RECORDING_SIZE[1])

    def frame(self) -> None:
        """Adds the state of the page after the simulated time of a frame, unless it is paused."""
        if not self._simulation.world.paused:
            # Commands of the page arrive before the steps.
            time.sleep(_FRAME_PERIOD)
            after = self._simulation.request_steps(_FRAME_STEPS).result(_DRAWN_TIMEOUT)
            self._browser.until("flatland.state.worlds[0].time > arguments[0]", 1e-9 * after - 1e-6)
        self._browser.run_async(
            "const [done] = arguments; requestAnimationFrame(() => requestAnimationFrame(done));"
        )
        image = Image.fromarray(self._browser.picture())
        outline = [(self._at[0] + x, self._at[1] + y) for x, y in _CURSOR]
        ImageDraw.Draw(image).polygon(outline, fill="white", outline="black")
        self._frames.append(image)

    def wait(self, seconds: float) -> None:
        """Records for some time [s]."""
        for _ in range(round(seconds / _FRAME_PERIOD)):
            self.frame()

    def move(self, to: Point, *, steps: int = 6, held: bool = False) -> None:
        """Moves the mouse."""
        for point in line(self._at, to, steps):
            self._at = point
            self._browser.mouse("Moved", point, button="left" if held else "none", held=int(held))
            self.frame()

    def click(self, at: Point | str) -> None:
        """Moves to a point or an element, and clicks."""
        self.move(self._browser.center(at) if isinstance(at, str) else at)
        self._browser.click(self._at)
        self.frame()

    def drag(self, start: Point, *ends: Point) -> None:
        """Drags over points."""
        self.move(start)
        self._browser.press(start)
        for end in ends:
            self.move(end, steps=9, held=True)
        self._browser.release(self._at)
        self.frame()

    def save(self, path: Path) -> None:
        """Writes an animated image that repeats."""
        durations = [round(1000 * _FRAME_PERIOD)] * len(self._frames)
        durations[-1] = 1500
        first, *rest = self._frames
        first.save(
            path,
            save_all=True,
            append_images=rest,
            duration=durations,
            loop=0,
            quality=_QUALITY,
            method=4,
            minimize_size=True,
        )
        print(f"{path}: {len(durations)} frames, {path.stat().st_size // 1000} kB")


def _record(browser: Chromium, url: str, simulation: Simulation, path: Path) -> None:
    """Records a short session: drive a robot, drag a model, spawn another one."""
    browser.resize(*_RECORDING_SIZE)
    page = ViewerPage(browser)
    page.open(f"{url}#x=0.6&y=-4.6&zoom=64")
    recording = Recording(browser, simulation)
    recording.wait(0.5)
    recording.click(page.screen(*page.pose("robot")[:2]))
    _drive_recorded(browser, recording, "w", 2.2)
    _drive_recorded(browser, recording, "wa", 0.6)
    recording.drag(page.screen(*page.pose("box_1")[:2]), page.screen(1.7, -4.8))
    recording.wait(0.5)
    recording.click("#spawn")
    recording.wait(0.3)
    _choose_file(browser, "chair")
    recording.wait(0.6)
    recording.click("#spawn-ok")
    for place in (page.screen(-0.7, -3.9), page.screen(-0.2, -3.5)):
        recording.move(place)
        browser.click(place)
    recording.wait(0.5)
    recording.click(page.screen(*page.pose("robot")[:2]))
    _drive_recorded(browser, recording, "wd", 0.9)
    _drive_recorded(browser, recording, "w", 1.2)
    recording.wait(0.4)
    recording.save(path)


def _choose_file(browser: Chromium, name: str) -> None:
    """Selects a model file in the dialog to spawn models."""
    browser.run(
        "const list = document.querySelector('#spawn-file');"
        "const found = [...list.options].find((option) => option.text.includes(arguments[0]));"
        "list.value = found.value; list.dispatchEvent(new Event('change', {bubbles: true}));",
        name,
    )


def _drive_recorded(browser: Chromium, recording: Recording, keys: str, seconds: float) -> None:
    """Holds keys that drive the selected robot."""
    for key in keys:
        browser.key_down(key)
    recording.wait(seconds)
    for key in keys:
        browser.key_up(key)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
