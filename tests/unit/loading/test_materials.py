"""The entries `material` and `class` of layers, models, bodies and footprints."""

from __future__ import annotations

from typing import Any

import flatland
from flatland import Material

WORLD = "properties: {{}}\nlayers: [{{name: 2d{}}}]\n"
MODEL = "{}bodies: [{{name: base{}, footprints: [{{type: circle, radius: 0.2, density: 1{}}}]}}]\n"


def model(files: Any, top: str = "", body: str = "", footprint: str = "") -> flatland.Model:
    files.write("thing.model.yaml", MODEL.format(top, body, footprint))
    world = files.load(WORLD.format(""))
    spawned = world.spawn_model("thing.model.yaml", "thing1")
    assert isinstance(spawned, flatland.Model)
    return spawned


def test_materials_of_footprints(files: Any) -> None:
    found = model(files, footprint=", material: {transmission: 0.25}")
    assert found.bodies[0].fixtures[0].material == Material(0.5, 0.25, 0.0)
    plain = model(files)
    assert plain.bodies[0].fixtures[0].material is None
    assert not plain.world.physics.has_materials


def test_materials_of_layers(files: Any) -> None:
    files.write_map("walls", ["..#"])
    text = ", map: walls.yaml, material: {reflectance: 0.75, specular: 0.5}"
    world = files.load(WORLD.format(text))
    layer = world.layer("2d")
    assert layer.material == Material(0.75, 0.0, 0.5)
    assert {fixture.material for fixture in layer.body.fixtures} == {layer.material}
    layer.add_edges([[0, 0, 1, 1]])
    assert layer.body.fixtures[-1].material == layer.material
    files.write_map("other", ["#.#"])
    world.set_layer_map("2d", "other.yaml")
    assert {fixture.material for fixture in layer.body.fixtures} == {layer.material}
    world.reset()
    assert {fixture.material for fixture in world.layer("2d").body.fixtures} == {layer.material}


def test_classes(files: Any) -> None:
    assert model(files).class_name == "thing"
    found = model(files, top="class: chair\n", body=", class: leg")
    assert (found.class_name, found.bodies[0].class_name) == ("chair", "leg")
    assert model(files, top="class: chair\n").bodies[0].class_name == "chair"
    world = files.load(WORLD.format(", class: wall"))
    assert world.layer("2d").class_name == "wall"
    assert files.load(WORLD.format("")).layer("2d").body.class_name == "2d"
