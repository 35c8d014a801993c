"""Fixtures of the simulation core: worlds from generated files, and a simulated clock."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from textwrap import dedent
from typing import Any

import numpy as np
import pytest
from PIL import Image
from plugin_manifests import manifest
from waiting import TIMEOUT

import flatland
from flatland.config import inputs
from flatland.config.files import read_regular

MINIMAL_MODEL = """
bodies:
  - name: base
    footprints: [{type: circle, radius: 0.2, density: 1}]
"""


class WorldFiles:
    """A folder in which world, model and map files are written, and worlds loaded from it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._open: list[flatland.World] = []

    def write(self, name: str, text: str) -> str:
        """Writes a file and returns its path; the text is dedented."""
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(dedent(text))
        return str(path)

    def write_map(self, name: str, rows: list[str], **keys: object) -> str:
        """Writes a map file and its image, drawn from text; `#` is a wall. Returns the path."""
        pixels = np.array([[0 if c == "#" else 255 for c in row] for row in rows], np.uint8)
        Image.fromarray(pixels).save(self.folder / f"{name}.png")
        values: dict[str, object] = {
            "image": f"{name}.png",
            "resolution": 1.0,
            "origin": "[0, 0, 0]",
            "occupied_thresh": 0.65,
            **keys,
        }
        return self.write(f"{name}.yaml", "\n".join(f"{k}: {v}" for k, v in values.items()))

    def load(self, text: str, **options: Any) -> flatland.World:
        """Writes `world.yaml` and loads it; the fixture closes the world after the test."""
        world = flatland.World.from_yaml(self.write("world.yaml", text), **{"seed": 1, **options})
        self._open.append(world)
        return world

    def load_model(self, model: str, **options: Any) -> flatland.World:
        """Loads a world with the layers `2d` and `3d` and a model `robot` with the given text."""
        self.write("robot.model.yaml", model)
        return self.load(
            """
            properties: {}
            layers: [{name: 2d}, {name: 3d}]
            models: [{name: robot, model: robot.model.yaml}]
            """,
            **options,
        )

    def close(self) -> None:
        """Closes all worlds."""
        for world in self._open:
            world.close()


@pytest.fixture
def files(tmp_path: Path) -> Iterator[WorldFiles]:
    """A folder for world files; worlds that are loaded from it are closed after the test."""
    world_files = WorldFiles(tmp_path)
    world_files.write("minimal.model.yaml", MINIMAL_MODEL)
    yield world_files
    world_files.close()


@pytest.fixture
def declare_plugins(files: WorldFiles, monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Declares classes of the test as plugins, named `test::CLASS`."""

    def declare(*classes: type) -> None:
        bases = {
            f"{each.__module__}.{each.__name__}": "Model"
            if issubclass(each, flatland.ModelPlugin)
            else "World"
            for each in classes
        }
        path = files.write("declared_plugins.xml", manifest(bases))
        monkeypatch.setenv("FLATLAND_PLUGIN_PATH", path)

    return declare


@pytest.fixture
def empty_world(files: WorldFiles) -> flatland.World:
    """A world without layers and models."""
    return files.load("{properties: {}, layers: []}")


class FakeTime:
    """A wall clock that advances only in `wait` and `spend`."""

    def __init__(self) -> None:
        self.now = 1024.0

    def clock(self) -> float:
        return self.now

    def wait(self, event: threading.Event, seconds: float) -> bool:
        assert seconds > 0
        if not event.is_set():
            self.now += seconds
        return event.is_set()

    def spend(self, seconds: float) -> None:
        self.now += seconds


@pytest.fixture
def fake_time() -> FakeTime:
    """A clock and a wait function for a `Simulation`, controlled by the test."""
    return FakeTime()


@pytest.fixture
def block_file(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str], threading.Event]]:
    """Makes reading a file of a name last until the returned event is set, or the test ends."""
    events: list[threading.Event] = []

    def block(name: str) -> threading.Event:
        released = threading.Event()
        events.append(released)

        def read(path: str) -> bytes:
            if Path(path).name == name:
                assert released.wait(TIMEOUT)
            return read_regular(path)

        monkeypatch.setattr(inputs, "read_regular", read)
        return released

    yield block
    for event in events:
        event.set()
