"""World files that describe the present models of a world."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from flatland import OccupancyGrid, World, WorldError
from flatland.loading.saved_world import SavedWorld

WORLD = """
properties: {velocity_iterations: 7}
layers:
  - {name: [walls, "010"], map: room.yaml, color: [1, 0, 0, 1], properties: {note: "null"}}
  - {name: other, map: room.yaml}
models:
  - {name: box, model: box.model.yaml, pose: [3, $eval return 2 + math.random(), 0]}
  - {name: turned, model: sub/turned.model.yaml, pose: [6, 6, 1], namespace: a/b}
plugins: $include plugins.inc.yaml
"""
BOX = "bodies: [{name: b, footprints: [{type: circle, radius: 0.3, density: 1}]}]"
TURNED = """
bodies: [{name: b, pose: [0.3, -0.2, 0.7], footprints: [{type: circle, radius: 0.3, density: 1}]}]
"""


@pytest.fixture
def world(files: Any) -> World:
    files.write_map("room", ["##########", *["#........#"] * 8, "##########"])
    files.write("box.model.yaml", BOX)
    (files.folder / "sub").mkdir()
    files.write("sub/turned.model.yaml", TURNED)
    wall = "{type: RandomWall, name: w, layer: walls, robot_name: box, num_of_walls: 2}"
    files.write("plugins.inc.yaml", f"[{wall}]")
    return files.load(WORLD)  # type: ignore[no-any-return]


def reload(files: Any, world: World) -> tuple[World, list[str]]:
    saved = SavedWorld(world)
    text, notes = saved.file()
    assert saved.folder == str(files.folder)
    path = files.folder / saved.name
    path.write_text(text)
    return World.from_yaml(path, seed=1), notes


def test_a_saved_world_has_the_same_models_at_the_same_poses(world: World, files: Any) -> None:
    world.spawn_model("box.model.yaml", "1e3", "x", pose=(5, 3, 100))
    world.spawn_model(files.folder / "box.model.yaml", "gone")
    world.delete_model("gone")
    for model in world.models:
        model.bodies[0].set_velocity(0.3, 0.1, 2.0)
    world.step(123)
    before = world.source.inputs.save()
    again, notes = reload(files, world)
    with again:
        assert notes == []
        assert world.source.inputs.save() == before
        described = [[(m.name, m.namespace, m.path) for m in w.models] for w in (world, again)]
        assert described[0] == described[1]
        np.testing.assert_allclose(again.state().poses, world.state().poses, rtol=0, atol=1e-9)
        assert again.velocity_iterations == 7
        assert [layer.names for layer in again.layers] == [["walls", "010"], ["other"]]
        assert again.layers[0].color == (1, 0, 0, 1)
        assert again.layers[0].properties == {"note": "null"}
        assert [plugin.name for plugin in again.plugins] == ["w"]


def test_a_saved_world_is_as_readable_as_its_source(files: Any) -> None:
    files.write_map("room", ["####", "#..#", "####"])
    world = files.load(
        "properties: {velocity_iterations: 7}\n"
        "layers:\n"
        "  - {name: a, map: room.yaml, color: &red [1, 0, 0, 1]}\n"
        "  - {name: b, map: room.yaml, color: *red}\n"
        "models: []\n"
    )
    text, _ = SavedWorld(world).file()
    assert "{velocity_iterations: 7}" in text
    assert text.count("[1, 0, 0, 1]") == 2


def test_a_saved_world_has_the_present_maps(world: World, files: Any) -> None:
    files.write_map("hall", ["######", "#....#", "######"])
    world.set_layer_map("other", "hall.yaml")
    grid = OccupancyGrid((0.0, 0.0, 0.0), 0.5, np.zeros((4, 4), np.int8))
    world.set_layer_map("walls", grid)
    again, notes = reload(files, world)
    with again:
        assert [layer.map_path for layer in again.layers] == [
            str(files.folder / name) for name in ("room.yaml", "hall.yaml")
        ]
    assert len(notes) == 1
    assert '"walls"' in notes[0]


def test_models_without_a_file_are_named(world: World, files: Any) -> None:
    world.spawn_model("\nbodies: [{name: b, footprints: []}]", 'a "text" x', pose=(4, 4, 0))
    again, notes = reload(files, world)
    with again:
        assert [model.name for model in again.models] == ["box", "turned"]
    assert r'"a \"text\" x"' in notes[0]


@pytest.mark.parametrize(("count", "end"), [(5, '"m4". '), (6, '"m4", .... ')])
def test_five_models_without_a_file_are_named(world: World, count: int, end: str) -> None:
    for number in range(count):
        world.spawn_model("\nbodies: [{name: b, footprints: []}]", f"m{number}", pose=(4, 4, 0))
    [note] = SavedWorld(world).file()[1]
    assert f'not included: "m0", "m1", "m2", "m3", {end}' in note


def test_a_world_without_a_file_is_an_error() -> None:
    with World() as world, pytest.raises(WorldError, match="loaded from a file"):
        SavedWorld(world)
