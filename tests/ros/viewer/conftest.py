"""Fixtures: a virtual screen, a viewer whose widgets can be queried, and screenshots."""

from __future__ import annotations

import contextlib
import importlib.util
import json
import shutil
import socket
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import cv2
import numpy as np
import pytest
from waiting import TIMEOUT, wait_until

MAGENTA = (255, 0, 255)  # the walls
_LEAST_STRENGTH = 45  # of 255
BODY = "name: base, color: [0, 0, 1, 1], footprints: [{type: circle, radius: 0.4, density: 1}]"
ROBOT = f"""
bodies: [{{{BODY}}}]
plugins:
  - {{type: DiffDrive, name: drive, body: base, pub_rate: 50, odom_frame_id: map}}
  - {{type: Laser, name: laser, body: base, range: 20, update_rate: 10,
     angle: {{min: -3.1, max: 3.1, increment: 0.1}}}}
"""
CRATE = """
bodies:
  - name: box
    color: [0, 1, 1, 1]
    footprints: [{type: polygon, density: 1, points: [[-0.5, -0.25], [0.5, -0.25], [0.5, 0.25],
                  [-0.5, 0.25]]}]
"""


def _load(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def screen(checkout: Path) -> Iterator[Any]:
    """A virtual screen; skips the test if a required program or module is missing."""
    virtual_screen = _load(checkout / "tools" / "virtual_screen.py")
    missing = virtual_screen.missing_programs()
    if shutil.which("rviz") is None:
        missing.append("rviz")
    for module in ("PyQt5.QtWidgets", "rviz.librviz_sip"):
        try:
            importlib.import_module(module)
        except ImportError:
            missing.append(f"Python's {module}")
    if missing:
        pytest.skip(
            f"not installed: {', '.join(missing)} (make setup-dev installs them on Debian 12; RViz "
            "of Debian 13 has no Python bindings that can be imported)"
        )
    screen = virtual_screen.VirtualScreen()
    yield screen
    screen.close()


@pytest.fixture(scope="module")
def drawing_launcher(module_launcher: Any, screen: Any) -> Any:
    """Starts programs on the virtual screen; they end with the last test of the file."""
    module_launcher.environment = {**module_launcher.environment, **screen.environment}
    return module_launcher


@pytest.fixture
def on_screen(launcher: Any, screen: Any) -> Any:
    """Starts programs on the virtual screen; they end with the test."""
    launcher.environment = {**launcher.environment, **screen.environment}
    return launcher


@pytest.fixture(scope="session")
def room(write_world: Callable[..., Path]) -> Path:
    """A magenta room of 10 m by 10 m with a blue robot at (-2, 1)."""
    path = write_world(
        "[{name: robot, model: robot.model.yaml, pose: [-2, 1, 0]}]", robot=ROBOT, crate=CRATE
    )
    path.write_text(path.read_text().replace("map: map.yaml", "map: map.yaml, color: [1, 0, 1, 1]"))
    return path


@pytest.fixture(scope="module")
def room_server(drawing_launcher: Any, room: Path) -> Any:
    """A simulator of the room, with markers."""
    return drawing_launcher.server(room, show_viz=True)


class Viewer:
    """A running viewer, inspected through a socket and controlled by mouse and keys."""

    def __init__(self, launcher: Any, screen: Any, folder: Path) -> None:
        script = Path(__file__).parent / "inspected_viewer.py"
        self._path = str(folder / "viewer")
        self._starts = 0
        self.screen = screen
        self.process = launcher.program(sys.executable, str(script), self._path)
        self._connect()

    def _connect(self) -> None:
        self._starts += 1
        wait_until(
            f"start {self._starts} of the viewer",
            lambda: self.process.output.count("the window is up") >= self._starts,
        )
        connection = socket.socket(socket.AF_UNIX)
        connection.settimeout(TIMEOUT)
        connection.connect(self._path)
        self._stream = connection.makefile("rw")
        connection.close()

    def close(self) -> None:
        """Closes the connection."""
        self._stream.close()

    def widgets(self, name: str) -> list[dict[str, Any]]:
        """Returns the visible widgets with a name or a class."""
        with contextlib.suppress(OSError):
            print(name, file=self._stream, flush=True)
            if line := self._stream.readline():
                return list(json.loads(line))
        # RViz has crashed, and the viewer starts again.
        self._connect()
        return self.widgets(name)

    def widget(self, name: str) -> dict[str, Any]:
        """Waits for the only widget of a name or class."""
        return self.until(name, lambda widget: True)

    def until(self, name: str, accept: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """Waits until the only widget of a name or class is accepted."""

        def accepted() -> dict[str, Any] | None:
            found = self.widgets(name)
            assert len(found) == 1, f"widgets of that name: {found}"
            assert accept(found[0]), found[0]
            return found[0]

        widget: dict[str, Any] = wait_until(f"widget {name}", accepted, poll_period=0.02)
        return widget

    def click(self, name: str) -> None:
        """Clicks on a widget."""
        widget = self.widget(name)
        self.screen.click(widget["x"] + widget["width"] / 2, widget["y"] + widget["height"] / 2)

    def fill_in(self, name: str, text: str) -> None:
        """Replaces the text of a field."""
        field = self.widget(name)
        self.screen.click(field["x"] + 20, field["y"] + field["height"] / 2)
        self.until(name, lambda widget: widget["focus"])
        self.screen.key("ctrl+a")
        self.screen.type(text)
        self.until(name, lambda widget: widget["text"] == text)


@pytest.fixture
def early_viewer(on_screen: Any, screen: Any, tmp_path: Path) -> Iterator[Viewer]:
    """A viewer without a simulator; it ends with the test."""
    viewer = Viewer(on_screen, screen, tmp_path)
    yield viewer
    viewer.close()


@pytest.fixture(scope="module")
def viewer(
    room_server: Any, drawing_launcher: Any, screen: Any, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Viewer]:
    """A viewer of the room; it ends with the last test of the file."""
    viewer = Viewer(drawing_launcher, screen, tmp_path_factory.mktemp("socket"))
    yield viewer
    viewer.close()


class Picture:
    """A screenshot in the coordinates of the room [m], which it derives from the magenta walls.

    Attributes:
        image: The colours, shape (height, width, 3).
        pixels_per_metre: Scale.
        center: Pixel (column, row) at the centre of the room.
    """

    def __init__(self, image: Any, area: Mapping[str, int] | None = None) -> None:
        left, top = (area["x"], area["y"]) if area else (0, 0)
        bottom, right = (top + area["height"], left + area["width"]) if area else image.shape[:2]
        self.image = image
        # Most pixels are grey, so that only the hues of the others are computed.
        red, green, blue = (image[top:bottom, left:right, channel] for channel in range(3))
        lowest = np.minimum(np.minimum(red, green), blue)
        strength = np.maximum(np.maximum(red, green), blue) - lowest
        rows, columns = np.nonzero(strength > _LEAST_STRENGTH)
        colors = image[rows + top, columns + left] - lowest[rows, columns, None].astype(float)
        self._hues = colors / strength[rows, columns, None]
        self._rows, self._columns = rows + top, columns + left
        rows, columns = self.pixels(MAGENTA)
        assert len(columns) > 50, "the walls of the room are not visible"
        left, right, top, bottom = columns.min(), columns.max(), rows.min(), rows.max()
        self.pixels_per_metre = (right - left) / 10.0
        self.center = ((left + right) / 2.0, (top + bottom) / 2.0)
        assert (bottom - top) / 10.0 == pytest.approx(self.pixels_per_metre, abs=0.2)

    def pixels(self, color: tuple[int, int, int]) -> tuple[Any, Any]:
        """Returns rows and columns with the hue of a colour; thin lines blend with the ground."""
        wanted = np.array(color, float) - min(color)
        found = np.abs(self._hues - wanted / wanted.max()).max(axis=1) < 0.15
        return self._rows[found], self._columns[found]

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Returns the pixel (column, row) at a point of the room [m]."""
        return (
            self.center[0] + x * self.pixels_per_metre,
            self.center[1] - y * self.pixels_per_metre,
        )

    def places(self, color: tuple[int, int, int]) -> Any:
        """Returns the points of the room [m] that have a colour, shape (n, 2)."""
        rows, columns = self.pixels(color)
        x = (columns - self.center[0]) / self.pixels_per_metre
        y = (self.center[1] - rows) / self.pixels_per_metre
        return np.column_stack([x, y])

    def near(self, color: tuple[int, int, int], x: float, y: float, distance: float) -> Any:
        """Returns the points of the room [m] that have a colour, within a distance of (x, y)."""
        places = self.places(color)
        return places[np.hypot(places[:, 0] - x, places[:, 1] - y) < distance]


@pytest.fixture
def screenshot(screen: Any, tmp_path: Path) -> Callable[..., Picture | None]:
    """Takes screenshots until one is accepted, and returns it; the check may assert.

    Returns None if the program has ended, which is asked before each screenshot.
    """

    def screenshot(
        accept: Callable[[Picture], Any],
        area: Mapping[str, int] | None = None,
        *,
        has_ended: Callable[[], bool] = lambda: False,
    ) -> Picture | None:
        image = None
        accepted: Picture | None = None

        def is_done() -> bool:
            nonlocal image, accepted
            if has_ended():
                return True
            image = screen.picture()
            picture = Picture(image, area)
            accepted = picture if accept(picture) else None
            return accepted is not None

        path = tmp_path / "screen.png"
        try:
            wait_until(f"the picture {path}", is_done, poll_period=0.1)
        except pytest.fail.Exception:
            cv2.imwrite(str(path), image[:, :, ::-1])
            raise
        return accepted

    return screenshot
