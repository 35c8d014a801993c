"""World files: all entries, and maps outside the range of the physics."""

from __future__ import annotations

import gc
import logging
from collections import Counter

import numpy as np
import pytest

import flatland
from flatland import FlatlandError, YamlError


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"origin": "[1e30, 0, 0]"}, "pose must be finite and within"),
        ({"origin": "[0, 0, 1e30]"}, "pose angle must be finite and within"),
        ({"resolution": 1e30}, r"edges\[0, 0\] must be finite and within"),
    ],
)
def test_a_map_outside_the_range_of_the_physics(files, keys, text):
    files.write_map("map", ["   ", " # ", "   "], **keys)
    with pytest.raises(YamlError, match=rf'Invalid map in layer "L", {text} .* \[/.*map\.yaml\]$'):
        files.load("{properties: {}, layers: [{name: L, map: map.yaml}]}")


@pytest.mark.parametrize(
    ("origin", "warned"),
    [
        ("[500000, 5000000, 0]", "coordinates of 5000000 m are rounded to multiples of 0.5 m"),
        ("[-40000, 0, 0]", "coordinates of 40000 m are rounded to multiples of 0.00391 m"),
        ("[20000, -10000, 0]", ""),
    ],
)
def test_coordinates_that_are_rounded_are_named(files, caplog, origin, warned):
    files.write_map("map", ["   ", " # ", "   "], origin=origin)
    files.load("{properties: {}, layers: [{name: L, map: map.yaml}]}")
    if warned:
        (record,) = (each for each in caplog.records if each.levelno == logging.WARNING)
        assert f'Layer "L": {warned}, since' in record.getMessage()
        assert "map.yaml]" in record.getMessage()
        assert record.hint.startswith("subtract a common offset")
    else:
        assert "rounded" not in caplog.text


def test_paths_in_included_files_are_relative_to_the_world_file(files, monkeypatch):
    monkeypatch.chdir("/")
    files.write_map("map", ["###", "#.#", "###"])
    files.write("common/layers.yaml", "[{name: walls, map: map.yaml}]")
    files.write("common/models.yaml", "{name: m, model: minimal.model.yaml}")
    world = files.load(
        """
        properties: {}
        layers: $include common/layers.yaml
        models:
          - $[include] common/models.yaml
        """
    )
    assert len(world.layer("walls").edges) == 4 * 2
    path = str(files.folder / "minimal.model.yaml")
    assert world.model("m").path == world.spawn_model("minimal.model.yaml", "n").path == path


def test_world_plugins_of_one_type_can_have_different_names(files, caplog):
    caplog.set_level(logging.INFO, "flatland")
    world = files.load(
        "{properties: {}, layers: [], plugins: [{name: W, type: DummyWorldPlugin}, "
        "{name: V, type: DummyWorldPlugin}, {name: X, type: Nothing, enabled: false}]}"
    )
    assert [plugin.name for plugin in world.plugins] == ["W", "V"]
    assert 'world plugin "X" is disabled' in caplog.text


def test_default_properties(empty_world):
    assert empty_world.velocity_iterations == 10
    assert empty_world.position_iterations == 10
    assert empty_world.layers == []
    assert empty_world.models == []
    assert empty_world.time == 0.0


def test_layer_that_is_published_as_a_map(files, empty_world):
    assert empty_world.map_layer == ""
    layers = "layers: [{name: a}, {name: [b, c]}]"
    assert files.load(f"{{properties: {{publish_map: c}}, {layers}}}").map_layer == "c"
    assert flatland.World(seed=1).map_layer == ""


def test_entries_of_layers(files):
    files.write_map("map", ["   ", " # ", "   "], origin="[1, 2, 0.5]", resolution=0.5)
    world = files.load(
        """
        properties: {}
        layers:
          - {name: 2d, map: map.yaml, color: [1, 0, 0, 0.5],
             properties: {debug: {min_z: 0.5, max_z: 2}}}
          - {name: [a, b], properties: {floor: 2}}
          - {name: [1, 2]}
        models: []
        """
    )
    walls, aliases, numbers = world.layers
    assert (walls.name, walls.names) == ("2d", ["2d"])
    assert walls.color == (1, 0, 0, 0.5)
    assert walls.properties["debug"] == {"min_z": "0.5", "max_z": "2"}
    assert walls.body.pose == pytest.approx((1, 2, 0.5))
    assert walls.body.type == "static"
    expected = {(0.5, 0.5, 1, 0.5), (0.5, 1, 1, 1), (0.5, 0.5, 0.5, 1), (1, 0.5, 1, 1)}
    edges = walls.edges
    assert edges.shape == (4, 4)
    assert edges.dtype == np.float32
    ordered = np.where(
        (edges[:, :2].sum(1) > edges[:, 2:].sum(1))[:, None], np.roll(edges, 2, 1), edges
    )
    assert set(map(tuple, ordered.tolist())) == expected
    assert aliases.names == ["a", "b"]
    assert (aliases.properties, numbers.properties) == ({"floor": "2"}, {})
    assert aliases.edges.shape == (0, 4)
    assert aliases.color == (1, 1, 1, 1)
    assert numbers.names == ["1", "2"]
    bits = world.collision_filter
    assert [bits.layer_id(name) for name in ("2d", "a", "b", "1", "2", "x")] == [0, 1, 2, 3, 4, -1]
    assert bits.category_bits(["all"]) == 0xFFFF
    assert bits.category_bits([]) == 0
    assert bits.category_bits(["2d", "b"]) == 0b101
    assert aliases.category_bits == 0b110
    assert {fixture.category_bits for fixture in walls.body.fixtures} == {1}
    assert {fixture.mask_bits for fixture in walls.body.fixtures} == {1}
    assert walls.unknown_map_keys == aliases.unknown_map_keys == ()
    assert world.layer("b") is aliases
    with pytest.raises(flatland.WorldError, match='layer with name "x" does not exist'):
        world.layer("x")


def test_walls_have_the_friction_of_box2d(files):
    files.write_map("image", ["   ", " # ", "   "])
    files.write("lines.dat", "0 0 4 0")
    files.write("lines.yaml", "{type: line_segments, data: lines.dat, scale: 1, origin: [0, 0, 0]}")
    world = files.load(
        "{properties: {}, layers: [{name: a, map: image.yaml}, {name: b, map: lines.yaml}]}"
    )
    for layer in world.layers:
        materials = {(wall.friction, wall.restitution) for wall in layer.body.fixtures}
        assert materials == {(float(np.float32(0.2)), 0.0)}, layer.name


def test_sixteen_layers_fit(files):
    names = ", ".join(f"l{i}" for i in range(16))
    world = files.load(f"{{properties: {{}}, layers: [{{name: [{names}]}}]}}")
    assert world.layers[0].category_bits == 0xFFFF


class Recorder(flatland.WorldObserver):
    """Counts the open outputs and commands by topic."""

    def __init__(self):
        self.open = Counter()

    def output_opened(self, port):
        self.open[port.topic] += 1

    def output_closed(self, port):
        self.open[port.topic] -= 1

    command_opened, command_closed = output_opened, output_closed


def test_a_failed_load_closes_all_topics_and_models(files):
    files.write(
        "driven.model.yaml",
        """
        bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
        plugins: [{name: drive, type: DiffDrive, body: base}]
        """,
    )
    recorder = Recorder()
    with pytest.raises(FlatlandError):
        files.load(
            """
            properties: {}
            layers: []
            models: [{name: good, model: driven.model.yaml}, {name: bad, model: nowhere.yaml}]
            """,
            observers=[recorder],
        )
    assert "/cmd_vel" in recorder.open
    assert not any(recorder.open.values())
    gc.collect()
    models = {each.name for each in gc.get_objects() if isinstance(each, flatland.Model)}
    assert models.isdisjoint({"good", "bad"})  # others may be of other tests


@pytest.mark.parametrize("value", [3, -1, True + 5, "0", None])
def test_simplify_map_out_of_range_is_rejected(files, value):
    with pytest.raises(ValueError, match="simplify_map must be 0, 1 or 2"):
        files.load("{properties: {}, layers: []}", simplify_map=value)


def test_a_random_seed_is_logged(files, caplog):
    caplog.set_level(logging.INFO, "flatland")
    world = files.load("{properties: {}, layers: []}", seed=None)
    assert f"seed {world.seed} drawn at random" in caplog.text


def test_expressions_depend_on_the_seed(files):
    text = "properties: {velocity_iterations: $eval math.random(1000)}\nlayers: []"
    first, again, other = (files.load(text, seed=seed).velocity_iterations for seed in (1, 1, 2))
    assert first == again != other


def test_a_layer_counts_its_edges_before_simplification(files):
    rows = ["#" * (k + 1) + "." * (12 - k) for k in range(12)]  # a flight of stairs
    files.write_map("stairs", rows)
    layers = "{properties: {}, layers: [{name: 2d, map: stairs.yaml}]}"
    exact = files.load(layers).layer("2d")
    simple = files.load(layers, simplify_map=2).layer("2d")
    assert simple.exact_edge_count == exact.exact_edge_count == len(exact.edges)
    assert len(simple.edges) < simple.exact_edge_count


def test_names_of_models_in_a_file(files):
    files.write("box.model.yaml", "bodies: [{name: b, footprints: []}]")
    world = "{{properties: {{}}, layers: [], models: [{{name: {}, model: box.model.yaml}}]}}"
    for name in ("my robot-1", "../x", "a/b", "ä" * 255):
        assert files.load(world.format(f'"{name}"')).models[0].name == name
    for name in (r"a\0b", r"a\nb", r"\e[2J", "x" * 256):
        with pytest.raises(flatland.YamlError, match=r"its name must have at most .*yaml:1\]$"):
            files.load(world.format(f'"{name}"'))
