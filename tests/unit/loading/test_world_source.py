"""The file of a world, and how all of its files are read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flatland
from flatland.errors import FlatlandError
from flatland.loading.world_source import WorldSource
from flatland.scene.description import describe_body


def test_the_result_of_save_is_restored() -> None:
    source = WorldSource()
    saved = source.save()
    source.map_layer, source.commands_received = "2d", 3
    source.inputs.note_file("/w/other.yaml")
    source.restore(saved)
    assert (source.map_layer, source.commands_received) == ("", 0)
    assert list(source.inputs.files) == []
    assert source.simplify_map == 0


def test_a_copy_is_independent() -> None:
    source = WorldSource(simplify_map=1)
    copy = source.copy()
    copy.grids["2d"] = None
    copy.map_layer = "2d"
    assert source.grids == {}
    assert source.map_layer == ""
    assert copy.simplify_map == 1
    assert copy.inputs is not source.inputs


MODEL = "bodies: [{name: base, footprints: [$include shape.yaml, $include shape.yaml]}]\n"
SHAPE = "{type: circle, radius: $eval math.random(), density: 1}\n"
MAP = "type: line_segments\ndata: walls.dat\nscale: 1.0\norigin: [0, 0, 0]\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    world = "{properties: {}, layers: [{name: 2d}]}"
    files = {
        "world.yaml": world,
        "m.yaml": MODEL,
        "shape.yaml": SHAPE,
        "map.yaml": MAP,
        "walls.dat": "0 0 1 0\n",
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def test_a_model_that_was_read_ahead_is_spawned_without_its_files(folder: Path) -> None:
    def radii(world: flatland.World) -> list[float]:
        return [shape.radius for shape in describe_body(world.models[0].bodies[0]).shapes]

    with flatland.World.from_yaml(folder / "world.yaml", seed=1) as world:
        world.spawn_model("m.yaml", "r")
        expected = radii(world)
        files = list(world.source.inputs.files)
    with flatland.World.from_yaml(folder / "world.yaml", seed=1) as world:
        store = world.source.read_models_ahead(["m.yaml"])
        assert list(world.source.inputs.files) == files[:1]
        for name in ("m.yaml", "shape.yaml"):
            (folder / name).unlink()
        with world.source.inputs.using(store):
            world.spawn_model("m.yaml", "r")
        # The expressions have the same random numbers.
        assert radii(world) == expected
        assert (
            list(world.source.inputs.files)
            == files
            == [
                str(folder / "world.yaml"),
                str(folder / "m.yaml"),
                str(folder / "shape.yaml"),
            ]
        )
        with pytest.raises(FlatlandError, match="does not exist"):
            world.spawn_model("m.yaml", "second")


def test_a_file_that_includes_itself_is_read_ahead_once(folder: Path) -> None:
    (folder / "m.yaml").write_text("bodies: $include m.yaml\n")
    with flatland.World.from_yaml(folder / "world.yaml") as world:
        store = world.source.read_models_ahead(["m.yaml"])
        assert list(store.documents) == [str(folder / "m.yaml")]


def test_at_most_1000_files_are_read_ahead(folder: Path) -> None:
    with flatland.World.from_yaml(folder / "world.yaml") as world:
        texts = [f"{{bodies: [], number: {number}}}" for number in range(1002)]
        assert len(world.source.read_models_ahead(texts).documents) == 1000


@pytest.mark.parametrize("text", ["bodies: [", "bodies: $include missing.yaml", "{}"])
def test_errors_are_those_of_a_spawn_that_reads_itself(folder: Path, text: str) -> None:
    (folder / "m.yaml").write_text(text)
    with flatland.World.from_yaml(folder / "world.yaml") as world:
        texts = []
        for path in ("m.yaml", "missing.yaml"):
            store = world.source.read_models_ahead([path])
            with pytest.raises(FlatlandError) as plain:
                world.spawn_model(path, "r")
            with pytest.raises(FlatlandError) as ahead, world.source.inputs.using(store):
                world.spawn_model(path, "r")
            texts.append((str(ahead.value), str(plain.value)))
        assert all(first == second for first, second in texts)


def test_files_outside_the_folders_are_not_read_ahead(folder: Path) -> None:
    allowed = folder / "allowed"
    allowed.mkdir()
    with flatland.World.from_yaml(folder / "world.yaml", model_path=[allowed]) as world:
        store = world.source.read_models_ahead(["m.yaml"])
        assert store.contents == {}
        with (
            pytest.raises(FlatlandError, match="outside the folders of model_path"),
            world.source.inputs.using(store),
        ):
            world.spawn_model("m.yaml", "r")


def test_a_map_that_was_read_ahead_replaces_a_map_without_its_files(
    folder: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO")
    with flatland.World.from_yaml(folder / "world.yaml") as world:
        caplog.clear()
        store = world.source.read_map_ahead("map.yaml")
        assert caplog.text == ""
        for name in ("map.yaml", "walls.dat"):
            (folder / name).unlink()
        with world.source.inputs.using(store):
            world.set_layer_map("2d", "map.yaml")
        assert world.layer("2d").edges.tolist() == [[0, 0, 1, 0]]
        assert caplog.text.count("1 edges from") == 1


def test_a_grid_that_was_converted_ahead_is_not_converted_again(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cells = np.zeros((4, 4), np.int8)
    cells[1, 1] = 100
    grid = flatland.OccupancyGrid((0.0, 0.0, 0.0), 0.5, cells)
    with flatland.World.from_yaml(folder / "world.yaml") as world:
        store = world.source.convert_grid_ahead(grid)
        expected = world.source.grid_map(grid).edges
        assert len(expected) > 0
        monkeypatch.setattr("flatland.loading.world_source.grid_map", None)
        with world.source.inputs.using(store):
            np.testing.assert_array_equal(world.source.grid_map(grid).edges, expected)
