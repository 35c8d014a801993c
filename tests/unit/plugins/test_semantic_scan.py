"""SemanticScan: names, classes and layers of what beams hit."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

import flatland
from flatland import SemanticLabel

ANGLES = "angle: {min: -1.5707963, max: 1.5707963, increment: 1.5707963}"
SCAN = f"type: SemanticScan, name: eye, body: base, range: 5, {ANGLES}"
BODIES = "[{name: base, footprints: [{type: circle, radius: 0.2, density: 1, layers: []}]}]"
CHAIR = """
class: furniture
bodies:
  - {name: seat, type: static, footprints: [{type: circle, radius: 0.3, density: 0}]}
  - {name: leg, type: static, pose: [0, 2, 0], class: leg,
     footprints: [{type: circle, radius: 0.1, density: 0, layers: [2d, 3d]}]}
"""
PLANT = "bodies: [{name: pot, type: static, footprints: [{type: circle, radius: 0.3, density: 0}]}]"
NOTHING = SemanticLabel("", "", (), "")

Collect = Callable[[flatland.World, str], list[Any]]


@pytest.fixture
def scan_world(plugin_world: Any) -> Callable[..., flatland.World]:
    """Loads a world with a scanner that looks to the right, ahead and to the left."""

    def load(more: str = "", **options: Any) -> flatland.World:
        plugin_world.files.write("chair.model.yaml", CHAIR)
        plugin_world.files.write("plant.yaml", PLANT)
        return plugin_world(f"[{{{SCAN}{more}}}]", **{"bodies": BODIES, **options})

    return load


def labels(scan: Any) -> list[SemanticLabel]:
    """Returns the label of each beam."""
    return [scan.table[label] for label in scan.labels]


def test_models_bodies_layers_and_classes(scan_world: Any, files: Any) -> None:
    files.write_map("walls", ["......", "......", "#.....", "......"])
    world = scan_world(
        layers="[{name: [2d, low], map: walls.yaml, class: wall}, {name: 3d}]", pose=(2, 1.5, 0)
    )
    world.spawn_model("chair.model.yaml", "chair1", pose=(4, 1.5, 0))
    world.spawn_model("chair.model.yaml", "chair2", pose=(2, 1, 0))
    output = world.output("/semantic_scan")
    world.step()
    right, ahead, left = labels(output.latest)
    assert output.latest.ranges == pytest.approx([0.2, 1.7, 1.4], abs=1e-5)
    assert right == SemanticLabel("chair2", "seat", ("all",), "furniture")
    assert ahead == SemanticLabel("chair1", "seat", ("all",), "furniture")
    assert left == SemanticLabel("chair2", "leg", ("2d", "low", "3d")[::2], "leg")
    world.move_model("robot", (2, 1.5, math.pi))
    world.step()
    assert labels(output.latest)[1] == SemanticLabel("2d", "2d", ("2d", "low"), "wall")
    assert output.latest.table[0] == NOTHING


def test_the_beams_start_at_the_origin_in_its_direction(scan_world: Any) -> None:
    world = scan_world(", origin: [1, 0.5, 1.5707963]", pose=(2, 1.5, 0))
    world.spawn_model("plant.yaml", "p", pose=(3, 4, 0))  # ahead of (3, 2), to the left
    output = world.output("/semantic_scan")
    world.step()
    assert [label.name for label in labels(output.latest)] == ["", "p", ""]
    assert output.latest.ranges[1] == pytest.approx(1.7, abs=1e-5)


def test_defaults_of_classes(scan_world: Any, files: Any) -> None:
    files.write_map("walls", ["..#"])
    world = scan_world(layers="[{name: 2d, map: walls.yaml}, {name: 3d}]", pose=(0.5, 0.5, 0))
    output = world.output("/semantic_scan")
    world.step()
    assert labels(output.latest)[1].class_name == "2d"
    world.spawn_model("plant.yaml", "p1", pose=(1.5, 0.5, 0))
    text = "\n" + PLANT
    world.spawn_model(text, "p2", pose=(0.5, 1.5, 0))
    world.step()
    assert [label.class_name for label in labels(output.latest)[1:]] == ["plant", "p2"]


def test_people_are_persons(scan_world: Any) -> None:
    people = (
        "- {type: Pedestrians, name: people, "
        "groups: [{name: guest, count: 0, area: [-5, -5, 5, 5]}]}"
    )
    world = scan_world(world_plugins=people)
    world.plugins[0].spawn(poses=[(2.0, 0.0, 0.0)])
    output = world.output("/semantic_scan")
    world.step()
    assert labels(output.latest)[1] == SemanticLabel("guest_0", "body", ("all",), "person")


def test_classes_by_patterns_of_names(scan_world: Any) -> None:
    world = scan_world(", classes: {'chair*/leg': thin, 'chair1': red, 'chair*': other}")
    world.spawn_model("chair.model.yaml", "chair1", pose=(2, 0, 0))
    world.spawn_model("chair.model.yaml", "chair2", pose=(0, -1, 0))
    output = world.output("/semantic_scan")
    world.step()
    scan = output.latest
    assert [label.class_name for label in labels(scan)] == ["other", "red", "thin"]
    assert repr(scan).startswith("SemanticScan(3 beams, classes: other, red, thin, stamp")


def test_beams_without_a_hit_have_label_0(scan_world: Any) -> None:
    world = scan_world(", no_hit: inf, range_min: 1")
    world.spawn_model("plant.yaml", "near", pose=(0.5, 0, 0))
    output = world.output("/semantic_scan")
    world.step()
    assert output.latest.ranges.tolist() == [math.inf, -math.inf, math.inf]
    assert output.latest.labels.tolist() == [0, 0, 0]
    assert output.latest.table[0] == NOTHING


def test_ranges_are_those_of_a_laser(plugin_world: Any, files: Any, collect: Collect) -> None:
    files.write_map("walls", ["#######", "#..#..#", "#.....#", "#######"])
    more = "body: base, range: 5, noise_std_dev: 0, angle: {min: -3, max: 3, increment: 0.01}"
    world = plugin_world(
        f"[{{type: Laser, name: a, {more}}}, {{type: SemanticScan, name: b, {more}}}]",
        bodies=BODIES,
        layers="[{name: 2d, map: walls.yaml}, {name: 3d}]",
        pose=(2.2, 1.4, 0.3),
    )
    world.model("robot").body("base").set_velocity(0.2, 0.1, 0.5)
    scans, semantic = collect(world, "/scan"), collect(world, "/semantic_scan")
    world.step(20)
    for scan, other in zip(scans, semantic, strict=True):
        assert scan.stamp == other.stamp
        assert scan.ranges.tobytes() == other.ranges.tobytes()
        assert (other.labels == 1).all()


def test_models_that_are_deleted_and_spawned_again(scan_world: Any) -> None:
    world = scan_world()
    output = world.output("/semantic_scan")
    for name in ("a", "b"):
        world.spawn_model("plant.yaml", name, pose=(1, 0, 0))
        world.step()
        assert labels(output.latest)[1].name == name
        world.delete_model(name)
        world.step()
        assert labels(output.latest)[1] == NOTHING


def test_ranges_have_noise(scan_world: Any, collect: Collect) -> None:
    world = scan_world(", noise_std_dev: 0.1")
    world.spawn_model("plant.yaml", "plant", pose=(1, 0, 0))
    scans = collect(world, "/semantic_scan")
    world.step(5)
    assert len({float(scan.ranges[1]) for scan in scans} - {0.7}) == 5
