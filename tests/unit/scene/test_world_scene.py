"""The description of a world: geometry, scans, and that the world is not modified."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import flatland
from flatland.drawing.footprints import footprints_of, scene_bounds
from flatland.plugins.laser import compute_scans
from flatland.scene.scans import LaserDescription
from flatland.scene.world_scene import describe_world

ROOM = ["##########", *["#........#"] * 8, "##########"]  # 1 m cells: walls at x, y = 1 and 9


def room_world(
    files: Any, plugins: str = "[]", bodies: str = "", joints: str = "[]", **options: Any
) -> flatland.World:
    """A room with a robot at (4, 3), heading along the y axis."""
    files.write_map("room", ROOM)
    default = "[{name: base, footprints: [{type: circle, radius: 0.5, density: 1}]}]"
    files.write(
        "robot.model.yaml",
        f"{{bodies: {bodies or default}, joints: {joints}, plugins: {plugins}}}",
    )
    return files.load(
        """
        properties: {}
        layers: [{name: [walls, 3d], map: room.yaml, color: [1, 0, 0, 1]}, {name: empty}]
        models: [{name: robot, model: robot.model.yaml, pose: [4, 3, 1.5707963267948966]}]
        """,
        **options,
    )


def laser_yaml(extra: str = "", increment: float = math.pi / 2) -> str:
    fan = f"{{min: 0, max: 4.8, increment: {increment}}}"
    return f"{{type: Laser, name: eye, body: base, range: 20, angle: {fan}, {extra}}}"


DRIVE = "{type: DiffDrive, name: drive, body: base}"
CROSS_HITS = [(4, 9), (1, 3), (4, 1), (9, 3)]  # front, left, back, right


def described_laser(world: flatland.World) -> LaserDescription:
    (laser,) = describe_world(world, None, scans=True).lasers
    return laser


def hits(world: flatland.World) -> Any:
    """End points of the beams that hit something, world frame [m], shape (n, 2)."""
    laser = described_laser(world)
    return laser.ends()[laser.hits()]


def eye(world: flatland.World) -> Any:
    return world.model("robot").plugin("eye")


def distance_from_walls(points: Any) -> Any:
    """Distance from the walls of the room [m], shape (n,)."""
    return np.abs(np.abs(points - 5).max(axis=1) - 4)


def test_walls_are_in_the_world_frame(files):
    files.write_map("room", ["##", "#."], origin="[10, 20, 1.5707963267948966]")
    world = files.load("{properties: {}, layers: [{name: a, map: room.yaml}]}")
    (layer,) = describe_world(world, None, scans=True).layers
    corners = {tuple(point) for point in layer.world_edges().reshape(-1, 2).round(6).tolist()}
    corners_in_map = [(0, 0), (1, 0), (1, 1), (2, 1), (2, 2), (0, 2)]
    assert corners == {(10 - y, 20 + x) for x, y in corners_in_map}  # rotated by 90 degrees
    assert layer.color == (1, 1, 1, 1)


def test_layers_are_selected_by_any_of_their_names(files):
    world = room_world(files)
    assert [len(each.edges) for each in describe_world(world, None, scans=True).layers] == [8, 0]
    (layer,) = describe_world(world, ["3d", "walls"], scans=True).layers
    assert len(layer.edges) == 8
    assert describe_world(world, [], scans=True).layers == []
    with pytest.raises(flatland.WorldError, match='layer with name "roof" does not exist'):
        describe_world(world, ["walls", "roof"], scans=True)


def test_footprints_have_the_pose_of_their_body(files):
    bodies = """[
      {name: base, color: [0, 0, 1, 1], footprints: [
        {type: polygon, points: [[0, 0], [2, 0], [2, 1], [0, 1]], density: 1}]},
      {name: arm, pose: [1, 0, 0], footprints: [
        {type: circle, radius: 0.25, center: [0.5, 0], density: 1, sensor: true}]}]"""
    scene = describe_world(room_world(files, bodies=bodies), None, scans=True)
    model = footprints_of(scene.models[0])
    base, arm = model.outlines
    corners = {tuple(point) for point in base.points.round(4).tolist()}
    assert corners == {(4, 3), (4, 5), (3, 5), (3, 3)}
    assert (base.color, base.is_sensor) == ((0, 0, 1, 1), False)
    assert arm.is_sensor
    # 1.5 m in front of the model, which heads along the y axis.
    assert np.hypot(*(arm.points - (4, 4.5)).T) == pytest.approx(0.25, abs=1e-5)
    assert model.center == pytest.approx((3.5, 4, math.pi / 2), abs=1e-5)
    assert model.width == pytest.approx(1)
    assert scene_bounds(scene) == (0, 0, 10, 10)


def test_joint_connects_origins_and_anchors(files):
    bodies = "[{name: a, footprints: []}, {name: b, pose: [2, 0, 0], footprints: []}]"
    ends = "[{name: a, anchor: [1.5, 0]}, {name: b, anchor: [-0.5, 0.1]}]"
    joint = f"{{type: revolute, name: j, bodies: {ends}, color: [0, 1, 0, 1]}}"
    scene = describe_world(room_world(files, bodies=bodies, joints=f"[{joint}]"), None, scans=True)
    (model,) = scene.models
    (described,) = model.joints
    points = described.points(*(body.pose for body in model.bodies))
    assert np.array(points) == pytest.approx(
        np.array([(4, 3), (4, 4.5), (4, 5), (3.9, 4.5)]), abs=1e-5
    )
    assert described.color == (0, 1, 0, 1)
    # A body without footprints has no heading triangle.
    assert footprints_of(model).center is None


class TestScans:
    def test_laser_without_a_scan_is_drawn_without_noise(self, files):
        world = room_world(files, f"[{laser_yaml('noise_std_dev: 0.5')}]")
        assert hits(world) == pytest.approx(np.array(CROSS_HITS), abs=1e-4)
        laser = described_laser(world)
        assert laser.scan.pose[:2] == pytest.approx((4, 3))
        assert eye(world).last_scan is None

    def test_mounting_pose_and_upside_down(self, files):
        world = room_world(files, f"[{laser_yaml('upside_down: true, origin: [1, 0, 0]')}]")
        expected = [(4, 9), (9, 4), (4, 1), (1, 4)]
        # The circle of the body itself, with a radius of 0.5 m, is behind the sensor.
        expected[2] = (4, 3.5)
        assert hits(world) == pytest.approx(np.array(expected), abs=1e-4)

    @pytest.mark.parametrize("no_hit", ["nan", "inf", "range"])
    def test_beam_without_a_hit_has_no_point(self, files, no_hit):
        world = room_world(files, f"[{laser_yaml(f'layers: [empty], no_hit: {no_hit}')}]")
        for _ in range(2):  # without and with a scan
            laser = described_laser(world)
            assert not laser.hits().any()
            assert np.hypot(*(laser.ends() - (4, 3)).T) == pytest.approx(20)
            world.output("/scan")
            world.step()
        assert eye(world).last_scan is not None

    def test_hit_that_is_too_close_is_at_the_sensor(self, files):
        world = room_world(files, f"[{laser_yaml('range_min: 2.5, always_publish: true')}]")
        world.step()
        laser = described_laser(world)
        assert laser.ends()[2] == pytest.approx((4, 3))  # 2 m to the back
        assert laser.hits().sum() == 3

    def test_last_scan_is_drawn_with_its_noise(self, files):
        world = room_world(files, f"[{laser_yaml('noise_std_dev: 0.02', increment=0.01)}]")
        output = world.output("/scan")
        world.step()
        laser = described_laser(world)
        ranges = np.hypot(*(laser.ends() - (4, 3)).T)
        assert ranges == pytest.approx(output.latest.ranges, abs=1e-5)
        assert laser.hits().all()
        assert 0.005 < distance_from_walls(laser.ends()).std() < 0.05

    def test_last_scan_is_drawn_at_the_pose_of_the_sensor_at_that_time(self, files):
        world = room_world(files, f"[{DRIVE}, {laser_yaml('update_rate: 20', increment=0.01)}]")
        output = world.output("/scan")
        world.command("/cmd_vel").set(flatland.Twist(linear_x=1.0, angular_z=1.0))
        world.step(59)
        assert world.timekeeper.sim_time_ns - output.latest.stamp == 45_000_000
        laser = described_laser(world)
        position = laser.scan.pose[:2]
        ranges = np.hypot(*(laser.ends() - position).T)
        assert ranges == pytest.approx(output.latest.ranges, abs=1e-5)
        assert distance_from_walls(laser.ends()).max() < 1e-4
        # Within 45 ms the robot has driven 45 mm.
        assert math.dist(position, world.models[0].pose[:2]) == pytest.approx(0.045, abs=5e-3)

    def test_lasers_with_the_same_topic_and_frame_are_drawn_separately(self, files):
        other = laser_yaml("origin: [0, 0, 0.5], frame: eye").replace("name: eye", "name: other")
        world = room_world(files, f"[{laser_yaml()}, {other}]")
        world.output("/scan")
        world.step()
        first, second = (each.ends() for each in describe_world(world, None, scans=True).lasers)
        assert first == pytest.approx(np.array(CROSS_HITS), abs=1e-4)
        assert distance_from_walls(second).max() < 1e-4
        assert np.abs(second - first).max() > 0.5

    def test_a_scan_is_a_copy_of_an_array_that_its_caller_overwrites(self, files):
        world = room_world(files, f"[{laser_yaml()}]")
        out = np.empty((1, eye(world).angles.count), np.float32)
        (ranges,) = compute_scans([eye(world)], out)
        scan, before = described_laser(world).scan, ranges.copy()
        out[:] = 0
        assert (scan.ranges == before).all()
