"""RandomWall: positions of the new walls, and the choice of edges."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import flatland


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


LEFT = [(0, 1, 4, 1), (0, 0, 0, 1), (4, 0, 4, 1)]
RIGHT = [(0, -1, 4, -1), (0, 0, 0, -1), (4, 0, 4, -1)]


@pytest.mark.parametrize(
    ("edge", "robot", "entry", "expected"),
    [
        ("0 0 4 0", (2, 3), "num_of_walls: 1", LEFT),
        ("4 0 0 0", (2, 3), "num_of_walls: 1", LEFT),  # the direction does not matter
        ("0 0 4 0", (2, -3), "num_of_walls: 1", RIGHT),
        ("0 0 4 0", (2, 3), "num_of_walls: 1, double_wall: true", LEFT + RIGHT),
        ("0 0 4 0", (9, 0), "num_of_walls: 1, double_wall: true", LEFT + RIGHT),  # on the line
        ("0 0 4 0", (2, 3), "", []),
        # The reference offsets slanted edges along x and y at once, which is too far.
        (
            "0 0 4 3",
            (1.82, 1.74),  # 0.3 m to its left
            "num_of_walls: 1, wall_wall_dist: 0.5",
            [(-0.3, 0.4, 3.7, 3.4), (0, 0, -0.3, 0.4), (4, 3, 3.7, 3.4)],
        ),
        (
            "7 -5 11 -2",
            (8.82, -3.26),
            "num_of_walls: 1, wall_wall_dist: 0.5",
            [(6.7, -4.6, 10.7, -1.6), (7, -5, 6.7, -4.6), (11, -2, 10.7, -1.6)],
        ),
    ],
)
def test_new_walls(
    plugin_world: Any,
    files: Any,
    edge: str,
    robot: tuple[float, float],
    entry: str,
    expected: list[tuple[float, ...]],
) -> None:
    """The pose of the model determines the side, and not that of a body."""
    base = "- {name: base, pose: [0, -10, 0], footprints: []}"
    world = plugin_world(
        bodies=base, pose=(*robot, 0), layers=lines(files, edge), world_plugins=wall(entry)
    )
    assert edge_set(world.layer("2d").edges[:1]) == edge_set([list(map(float, edge.split()))])
    assert edge_set(world.layer("2d").edges[1:]) == edge_set(expected)


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
    changes: list[str] = []

    class Watcher(flatland.WorldObserver):
        world: Any = None

        def layer_changed(self, layer_name: str) -> None:
            changes.append(layer_name)

    plugin_world(
        pose=(2, 3, 0),
        layers=lines(files, "0 0 4 0"),
        world_plugins=wall("num_of_walls: 1"),
        observers=[Watcher()],
    )
    # One notification for each new layer, and one for the new wall.
    assert changes == ["2d", "3d", "2d"]


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
