"""`World.set_layer_map`: maps from files and grids at run time, and layers that wait for a map."""

from __future__ import annotations

import logging
import math
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import flatland
from flatland import OccupancyGrid
from flatland.entities.layer import Layer

ROOM = "-5 -5 5 -5\n5 -5 5 5\n5 5 -5 5\n-5 5 -5 -5\n"
HALL = "-9 -9 9 -9\n9 -9 9 9\n9 9 -9 9\n-9 9 -9 -9\n"
ROBOT = """
bodies: [{name: b, footprints: [{type: circle, radius: 0.3, density: 1}]}]
plugins: [{type: Laser, name: eye, body: b, range: 20, angle: {min: 0, max: 3, increment: 1}}]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, segments in (("room", ROOM), ("hall", HALL)):
        (tmp_path / f"{name}.dat").write_text(segments)
        (tmp_path / f"{name}.yaml").write_text(
            f"type: line_segments\ndata: {name}.dat\nscale: 1\norigin: [0, 0, 0]\n"
        )
    (tmp_path / "robot.yaml").write_text(ROBOT)
    (tmp_path / "world.yaml").write_text(
        "properties: {}\nlayers: [{name: [2d, low], map: room.yaml, color: [1, 0, 0, 1],\n"
        "  material: {reflectance: 0.25}, class: building}]\n"
        "models: [{name: r, model: robot.yaml, pose: [1, 1, 0]}]\n"
    )
    (tmp_path / "waiting.yaml").write_text(
        'properties: {}\nlayers: [{name: 2d, map: "topic:///map"}]\n'
        "models: [{name: r, model: robot.yaml, pose: [1, 1, 0]}]\n"
    )
    return tmp_path


@pytest.fixture
def world(folder: Path, log: Any) -> Any:
    with flatland.World.from_yaml(folder / "world.yaml", seed=1, observers=[log]) as world:
        world.step(2)
        log.events.clear()
        yield world


def ahead(world: Any) -> float:
    """Returns the range of the first beam, along x."""
    scan = world.output("/scan")
    world.step()
    return float(scan.latest.ranges[0])


def grid(
    cells: Any, resolution: float = 1.0, origin: tuple[float, ...] = (0, 0, 0)
) -> OccupancyGrid:
    return OccupancyGrid(origin, resolution, cells)


def box(resolution: float = 0.5, origin: tuple[float, ...] = (0, 0, 0)) -> OccupancyGrid:
    """A grid of 9 by 9 cells, of which the outermost ones are occupied."""
    cells = np.full((9, 9), 100, np.int8)
    cells[1:-1, 1:-1] = 0
    return grid(cells, resolution, origin)


def test_a_map_file_replaces_the_walls(world: Any, log: Any) -> None:
    layer, old = world.layer("2d"), world.layer("2d").body
    assert ahead(world) == pytest.approx(4, abs=1e-5)
    world.set_layer_map("low", "hall.yaml")
    assert ahead(world) == pytest.approx(8, abs=1e-5)
    assert world.layer("2d") is layer
    assert (layer.names, layer.color) == (["2d", "low"], (1, 0, 0, 1))
    assert layer.map_path.endswith("hall.yaml")
    assert len(layer.edges) == 4
    assert not old.alive
    assert log.events == ["layer_changed 2d"]


def test_the_walls_collide(world: Any, folder: Path) -> None:
    world.set_layer_map("2d", "hall.yaml")
    world.model("r").bodies[0].set_velocity(10, 0, 0)
    world.step(400)
    assert world.model("r").pose[0] == pytest.approx(8.7, abs=0.01)


def test_a_grid_replaces_the_walls(world: Any) -> None:
    world.set_layer_map("2d", box())
    # The inner boundary of the wall is at 4 m.
    assert ahead(world) == pytest.approx(3, abs=1e-5)
    assert world.layer("2d").map_path == ""
    world.set_layer_map("2d", "room.yaml")
    assert world.layer("2d").grid is None
    assert ahead(world) == pytest.approx(4, abs=1e-5)


def test_unknown_keys_are_those_of_the_new_map(world: Any, folder: Path) -> None:
    with (folder / "hall.yaml").open("a") as file:
        file.write("author: nobody\n")
    world.set_layer_map("2d", "hall.yaml")
    assert world.layer("2d").unknown_map_keys == ("author",)


def test_the_appearance_of_the_walls_remains(world: Any) -> None:
    def appearance() -> tuple[Any, ...]:
        layer = world.layer("2d")
        return layer.names, layer.color, layer.material, layer.class_name, layer.category_bits

    before = appearance()
    assert before[3] == "building"
    for source in ("hall.yaml", box()):
        world.set_layer_map("2d", source)
        assert appearance() == before


def test_a_grid_equals_the_map_file_of_its_image(world: Any, folder: Path) -> None:
    rng = np.random.default_rng(5)
    cells = rng.choice(np.array([-1, 0, 30, 64, 65, 100], np.int8), size=(40, 30))
    # As map_saver writes it: unknown is 205, and occupied from 65 on.
    image = np.where(cells >= 65, 0, np.where(cells < 0, 205, 254)).astype(np.uint8)
    cv2.imwrite(str(folder / "grid.png"), image[::-1])
    (folder / "grid.yaml").write_text(
        "image: grid.png\nresolution: 0.1\norigin: [-2, 1, 0.4]\noccupied_thresh: 0.65\n"
    )
    world.set_layer_map("2d", "grid.yaml")
    expected = world.layer("2d").world_edges
    world.set_layer_map("2d", OccupancyGrid((-2, 1, 0.4), 0.1, cells))
    assert len(expected) > 100
    assert np.array_equal(world.layer("2d").world_edges, expected)


CELL = np.eye(2, dtype=np.int8) * 100


@pytest.mark.parametrize(
    ("source", "text"),
    [
        ("none.yaml", "File does not exist"),
        ("", "the path is empty"),
        ("bad.yaml", 'Entry "image" does not exist'),
        (grid(CELL, 0.0), "resolution of a grid must be"),
        (grid(CELL, math.nan), "resolution of a grid"),
        (grid(CELL, math.inf), "resolution of a grid"),
        (grid(CELL, origin=(0, math.nan, 0)), "must be finite"),
        (grid(CELL, origin=(0, 1e300, 0)), "must be finite"),
        (grid(CELL, 1e300), "invalid grid"),
        (grid(CELL, 1e12), "must be finite"),
        (grid(CELL[:0]), "must have cells"),
        (grid(CELL[0]), "must have cells"),
        (grid(np.zeros((2, 2))), "must be integers"),
    ],
)
def test_a_failure_leaves_the_old_map(
    world: Any, log: Any, folder: Path, source: Any, text: str
) -> None:
    (folder / "bad.yaml").write_text("resolution: 1\n")
    before, counts = world.state_hash(), world.physics.object_counts
    with pytest.raises(flatland.FlatlandError, match=text):
        world.set_layer_map("2d", source)
    assert world.physics.object_counts == counts
    assert world.state_hash() == before
    assert log.events == []
    assert ahead(world) == pytest.approx(4, abs=1e-5)


def test_other_errors_are_raised_unchanged(
    world: Any, log: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(layer: Any, edges: Any) -> None:
        raise MemoryError

    with monkeypatch.context() as patched:
        patched.setattr(Layer, "add_edges", fail)
        with pytest.raises(MemoryError):
            world.set_layer_map("2d", "hall.yaml")
    assert log.events == []
    assert ahead(world) == pytest.approx(4, abs=1e-5)


def test_an_unknown_layer_is_an_error(world: Any) -> None:
    with pytest.raises(flatland.WorldError, match='layer with name "3d" does not exist'):
        world.set_layer_map("3d", "hall.yaml")


def test_overlapped_models_are_logged(world: Any, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        world.set_layer_map("2d", box(resolution=0.4, origin=(-1, -1, 0)))
        assert not caplog.records
        world.set_layer_map("2d", box(resolution=0.1, origin=(0.8, 0.8, 0)))
    assert 'model "r" overlaps layer "2d" at (1.000, 1.000, 0.000)' in caplog.text


def test_new_walls_wake_models(world: Any) -> None:
    body = world.model("r").bodies[0]
    world.step(400)
    assert not body.awake
    world.set_layer_map("2d", "hall.yaml")
    assert body.awake


def test_a_changed_file_is_read_again(world: Any, folder: Path) -> None:
    world.set_layer_map("2d", "hall.yaml")
    (folder / "hall.dat").write_text(HALL.replace("9", "7"))
    world.set_layer_map("2d", "hall.yaml")
    assert ahead(world) == pytest.approx(6, abs=1e-5)


def test_a_reset_returns_to_the_map_of_the_file(world: Any) -> None:
    world.reset()
    loaded = world.state_hash()
    world.set_layer_map("2d", box())
    world.reset()
    assert world.state_hash() == loaded
    assert world.layer("2d").map_version == 0
    assert ahead(world) == pytest.approx(4, abs=1e-5)


def test_a_snapshot_restores_the_map(world: Any) -> None:
    snapshot = world.snapshot()
    world.set_layer_map("2d", box())
    world.restore(snapshot)
    assert ahead(world) == pytest.approx(4, abs=1e-5)
    world.set_layer_map("2d", box())
    with world.clone() as clone:
        assert len(clone.layer("2d").edges) == len(world.layer("2d").edges)


def test_a_map_of_a_clone_does_not_change_the_reset_of_the_original(folder: Path) -> None:
    with flatland.World.from_yaml(folder / "waiting.yaml", seed=1) as world, world.clone() as clone:
        clone.set_layer_map("2d", box())
        world.reset()
        assert not len(world.layer("2d").edges)
        clone.reset()
        assert len(clone.layer("2d").edges)


class TestTopic:
    def test_a_layer_is_empty_until_it_has_a_map(
        self, folder: Path, caplog: pytest.LogCaptureFixture
    ) -> None:
        with flatland.World.from_yaml(folder / "waiting.yaml", seed=1) as world:
            assert 'Layer "2d" is empty until a map is received from topic "/map"' in caplog.text
            layer = world.layer("2d")
            assert (layer.map_topic, layer.map_path, len(layer.edges)) == ("/map", "", 0)
            assert math.isnan(ahead(world))
            world.set_layer_map("2d", box())
            assert ahead(world) == pytest.approx(3, abs=1e-5)
            assert layer.map_topic == "/map"

    def test_a_reset_keeps_the_last_grid(self, folder: Path) -> None:
        with flatland.World.from_yaml(folder / "waiting.yaml", seed=1) as world:
            world.set_layer_map("2d", box())
            world.reset()
            first = world.state_hash()
            assert ahead(world) == pytest.approx(3, abs=1e-5)
            world.reset()
            assert world.state_hash() == first
