"""RandomWall: positions of the new walls, and the choice of edges."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import flatland

ROOM = ["#######", "#.....#", "#.....#", "#.....#", "#######"]


def wall(entry: str = "") -> str:
    return f"[{{type: RandomWall, name: walls, layer: 2d, robot_name: robot, {entry}}}]".replace(
        ", }", "}"
    )


def lines(files: Any, *segments: str, origin: str = "[0, 0, 0]") -> str:
    """Writes a map of line segments and returns the YAML of the layers."""
    files.write("lines.dat", "\n".join(segments))
    path = files.write(
        "lines.yaml", f"{{type: line_segments, data: lines.dat, scale: 1, origin: {origin}}}"
    )
    return f"[{{name: [2d, floor], map: {path}}}, {{name: 3d}}]"


def edge_set(edges: Any) -> set[tuple[tuple[float, float], ...]]:
    """Returns rounded edges without order or direction."""
    return {
        tuple(sorted(((round(x1, 4), round(y1, 4)), (round(x2, 4), round(y2, 4)))))
        for x1, y1, x2, y2 in np.asarray(edges, dtype=float).tolist()
    }


def test_wall_is_on_the_side_of_the_robot(plugin_world: Any, files: Any) -> None:
    layers = lines(files, "0 0 4 0")
    world = plugin_world(
        pose=(2, 3, 0), layers=layers, world_plugins=wall("num_of_walls: 1, wall_wall_dist: 0.5")
    )
    assert edge_set(world.layer("2d").edges) == edge_set(
        [(0, 0, 4, 0), (0, 0.5, 4, 0.5), (0, 0, 0, 0.5), (4, 0, 4, 0.5)]
    )


def test_wall_is_on_the_other_side_if_the_robot_is_there(plugin_world: Any, files: Any) -> None:
    layers = lines(files, "0 0 4 0")
    world = plugin_world(
        pose=(2, -3, 0), layers=layers, world_plugins=wall("num_of_walls: 1, wall_wall_dist: 0.5")
    )
    assert edge_set(world.layer("2d").edges[1:]) == edge_set(
        [(0, -0.5, 4, -0.5), (0, 0, 0, -0.5), (4, 0, 4, -0.5)]
    )


def test_direction_of_the_edge_does_not_matter(plugin_world: Any, files: Any) -> None:
    layers = lines(files, "4 0 0 0")
    world = plugin_world(
        pose=(2, 3, 0), layers=layers, world_plugins=wall("num_of_walls: 1, wall_wall_dist: 0.5")
    )
    assert ((0.0, 0.5), (4.0, 0.5)) in edge_set(world.layer("2d").edges)


def test_default_distance_is_one_metre_and_default_count_zero(
    plugin_world: Any, files: Any
) -> None:
    layers = lines(files, "0 0 4 0")
    world = plugin_world(pose=(2, 3, 0), layers=layers, world_plugins=wall("num_of_walls: 1"))
    assert ((0.0, 1.0), (4.0, 1.0)) in edge_set(world.layer("2d").edges)
    world = plugin_world(pose=(2, 3, 0), layers=layers, world_plugins=wall())
    assert len(world.layer("2d").edges) == 1


def test_double_wall_adds_walls_on_both_sides(plugin_world: Any, files: Any) -> None:
    layers = lines(files, "0 0 4 0")
    world = plugin_world(
        pose=(2, 3, 0), layers=layers, world_plugins=wall("num_of_walls: 1, double_wall: true")
    )
    assert edge_set(world.layer("2d").edges[1:]) == edge_set(
        [
            *[(0, 1, 4, 1), (0, 0, 0, 1), (4, 0, 4, 1)],
            *[(0, -1, 4, -1), (0, 0, 0, -1), (4, 0, 4, -1)],
        ]
    )


@pytest.mark.parametrize(("x", "y"), [(0, 0), (7, -5)])
def test_walls_of_slanted_edges_have_the_configured_distance(
    plugin_world: Any, files: Any, x: int, y: int
) -> None:
    # The reference offsets slanted edges along x and y at once, which is too far.
    layers = lines(files, f"{x} {y} {x + 4} {y + 3}")
    world = plugin_world(
        pose=(x + 1.82, y + 1.74, 0),  # 0.3 m to its left
        layers=layers,
        world_plugins=wall("num_of_walls: 1, wall_wall_dist: 0.5"),
    )
    expected = [(-0.3, 0.4, 3.7, 3.4), (0, 0, -0.3, 0.4), (4, 3, 3.7, 3.4)]
    assert edge_set(world.layer("2d").edges[1:]) == edge_set(np.add(expected, [x, y, x, y]))


def test_side_of_the_robot_is_determined_in_the_layer_frame(plugin_world: Any, files: Any) -> None:
    # Rotated by 90 degrees and translated, the edge is from (10, 0) to (10, 4).
    layers = lines(files, "0 0 4 0", origin=f"[10, 0, {math.pi / 2}]")
    world = plugin_world(
        pose=(11, 2, 0), layers=layers, world_plugins=wall("num_of_walls: 1, wall_wall_dist: 0.5")
    )
    # East of the edge, where the robot is, is to its right.
    assert ((0.0, -0.5), (4.0, -0.5)) in edge_set(world.layer("2d").edges)
    robot = world.model("robot").body("base")
    hit = world.physics.ray_cast(robot.pose[:2], (0.0, 2.0), world.layer("2d").category_bits)
    assert hit is not None
    assert hit.point == pytest.approx((10.5, 2.0), abs=1e-5)


def test_the_pose_of_the_model_determines_the_side(plugin_world: Any, files: Any) -> None:
    body = """
    - name: base
      pose: [0, -10, 0]
      footprints: [{type: circle, radius: 0.2, density: 1}]
    """
    world = plugin_world(
        bodies=body,
        pose=(2, 3, 0),
        layers=lines(files, "0 0 4 0"),
        world_plugins=wall("num_of_walls: 1"),
    )
    assert ((0.0, 1.0), (4.0, 1.0)) in edge_set(world.layer("2d").edges)


def test_new_walls_have_the_friction_of_the_layer_and_its_bits(
    plugin_world: Any, files: Any
) -> None:
    world = plugin_world(
        pose=(2, 3, 0), layers=lines(files, "0 0 4 0"), world_plugins=wall("num_of_walls: 1")
    )
    layer = world.layer("2d")
    assert layer.category_bits == 0b11
    assert len(layer.body.fixtures) == 4
    assert {(f.category_bits, f.mask_bits) for f in layer.body.fixtures} == {(0b11, 0b11)}
    assert {f.friction for f in layer.body.fixtures} == {float(np.float32(0.2))}
    assert world.physics.ray_cast((2.0, 3.0), (2.0, 0.5), 0b10) is not None
    assert world.physics.ray_cast((2.0, 3.0), (2.0, 0.5), 0b100) is None


def test_observers_are_notified(plugin_world: Any, files: Any) -> None:
    class Watcher(flatland.WorldObserver):
        def __init__(self) -> None:
            self.changes: list[tuple[str, int]] = []
            self.world: Any = None

        def layer_changed(self, layer_name: str) -> None:
            self.changes.append(layer_name)

    watcher = Watcher()
    plugin_world(
        pose=(2, 3, 0),
        layers=lines(files, "0 0 4 0"),
        world_plugins=wall("num_of_walls: 1"),
        observers=[watcher],
    )
    # One notification for each new layer, and one for the new wall.
    assert watcher.changes == ["2d", "3d", "2d"]


def pick(plugin_world: Any, files: Any, count: int, seed: int) -> set[int]:
    """Returns which of twelve parallel edges have a new wall."""
    layers = lines(files, *(f"{10 * i} 0 {10 * i + 1} 0" for i in range(12)))
    world = plugin_world(
        pose=(0, 3, 0), layers=layers, world_plugins=wall(f"num_of_walls: {count}"), seed=seed
    )
    new = world.layer("2d").edges[12:]
    assert len(new) == 3 * count
    return {int(edge[0] // 10) for edge in new}


def test_picked_edges_are_distinct(plugin_world: Any, files: Any) -> None:
    assert pick(plugin_world, files, 12, 1) == set(range(12))
    for seed in range(5):
        assert len(pick(plugin_world, files, 6, seed)) == 6


def test_picked_edges_are_determined_by_the_seed(plugin_world: Any, files: Any) -> None:
    picked = [pick(plugin_world, files, 4, seed) for seed in (1, 1, 2, 3)]
    assert picked[0] == picked[1]
    assert len({frozenset(p) for p in picked}) > 1


def test_edges_of_image_maps_can_be_picked(plugin_world: Any, files: Any) -> None:
    path = files.write_map("room", ROOM)
    world = plugin_world(
        pose=(3.3, 2.2, 0),
        layers=f"[{{name: 2d, map: {path}}}]",
        world_plugins=wall("num_of_walls: 3, wall_wall_dist: 0.25"),
    )
    exact = world.layer("2d").exact_edge_count
    assert len(world.layer("2d").edges) == exact + 9


@pytest.mark.parametrize(
    ("plugin", "text"),
    [
        ("layer: 2d, robot_name: rob", 'robot "rob" does not exist'),
        (
            "layer: 2d, robot_name: robot, num_of_walls: 3",
            'num_of_walls is 3, but layer "2d" has only 2 edges',
        ),
        (
            "layer: 2d, robot_name: robot, num_of_walls: 2",
            'robot "robot" is on the line through the wall from (0, 0) to (4, 0) of layer "2d"',
        ),
        ("layer: 2d, robot_name: robot, num_of_walls: -1", '"num_of_walls", must not be negative'),
        ("layer: 2d, robot_name: robot, wall_wall_dist: 0", '"wall_wall_dist", must be greater'),
    ],
)
def test_invalid_parameters_are_errors(
    plugin_world: Any, files: Any, plugin: str, text: str
) -> None:
    layers = lines(files, "0 0 4 0", "0 1 4 1")
    with pytest.raises(flatland.PluginError) as caught:
        plugin_world(
            pose=(9, 0, 0),
            layers=layers,
            world_plugins=f"[{{type: RandomWall, name: walls, {plugin}}}]",
        )
    assert text in str(caught.value)
    assert 'World Plugin "walls" type "RandomWall"' in str(caught.value)


def test_a_robot_on_the_line_is_allowed_with_double_wall(plugin_world: Any, files: Any) -> None:
    world = plugin_world(
        pose=(9, 0, 0),
        layers=lines(files, "0 0 4 0"),
        world_plugins=wall("num_of_walls: 1, double_wall: true"),
    )
    assert len(world.layer("2d").edges) == 7
