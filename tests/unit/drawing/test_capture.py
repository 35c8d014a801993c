"""What is taken of a world to be drawn: where it is, and that taking it changes nothing."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import flatland
from flatland.drawing.capture import look_at

ROOM = ["##########", *["#........#"] * 8, "##########"]  # 1 m cells: walls at x, y = 1 and 9


def room_world(
    files: Any, plugins: str = "[]", bodies: str = "", joints: str = "[]", **options: Any
) -> flatland.World:
    """A room with a robot at (4, 3), heading along y."""
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


def laser(extra: str = "", increment: float = math.pi / 2) -> str:
    fan = f"{{min: 0, max: 4.8, increment: {increment}}}"
    return f"{{type: Laser, name: eye, body: base, range: 20, angle: {fan}, {extra}}}"


DRIVE = "{type: DiffDrive, name: drive, body: base}"
CROSS_HITS = [(4, 9), (1, 3), (4, 1), (9, 3)]  # ahead, left, behind, right


def hits(world: flatland.World) -> Any:
    (sweep,) = look_at(world, None, scans=True).sweeps
    return sweep.hits


def off_the_walls(points: Any) -> Any:
    """Distance from the walls of the room [m], shape (n,)."""
    return np.abs(np.abs(points - 5).max(axis=1) - 4)


def test_walls_are_in_the_world_frame(files):
    files.write_map("room", ["##", "#."], origin="[10, 20, 1.5707963267948966]")
    world = files.load("{properties: {}, layers: [{name: a, map: room.yaml}]}")
    (walls,) = look_at(world, None, scans=True).walls
    corners = {tuple(point) for point in walls.edges.reshape(-1, 2).round(6).tolist()}
    corners_in_map = [(0, 0), (1, 0), (1, 1), (2, 1), (2, 2), (0, 2)]
    assert corners == {(10 - y, 20 + x) for x, y in corners_in_map}  # turned by 90 degrees
    assert walls.color == (1, 1, 1, 1)


def test_layers_are_chosen_by_any_of_their_names(files):
    world = room_world(files)
    assert [len(w.edges) for w in look_at(world, None, scans=True).walls] == [8, 0]
    assert [len(w.edges) for w in look_at(world, ["3d", "walls"], scans=True).walls] == [8]
    assert look_at(world, [], scans=True).walls == []
    with pytest.raises(flatland.WorldError, match='layer with name "roof" does not exist'):
        look_at(world, ["walls", "roof"], scans=True)


def test_footprints_are_where_their_bodies_are(files):
    bodies = """[
      {name: base, color: [0, 0, 1, 1], footprints: [
        {type: polygon, points: [[0, 0], [2, 0], [2, 1], [0, 1]], density: 1}]},
      {name: arm, pose: [1, 0, 0], footprints: [
        {type: circle, radius: 0.25, center: [0.5, 0], density: 1, sensor: true}]}]"""
    scene = look_at(room_world(files, bodies=bodies), None, scans=True)
    (model,) = scene.figurines
    base, arm = model.outlines
    corners = {tuple(point) for point in base.points.round(4).tolist()}
    assert corners == {(4, 3), (4, 5), (3, 5), (3, 3)}
    assert (base.color, base.is_sensor) == ((0, 0, 1, 1), False)
    assert arm.is_sensor
    # Model and body turn it: 1.5 m ahead, which is along y.
    assert np.hypot(*(arm.points - (4, 4.5)).T) == pytest.approx(0.25, abs=1e-5)
    assert model.middle == pytest.approx((3.5, 4, math.pi / 2), abs=1e-5)
    assert model.breadth == pytest.approx(1)
    assert scene.box() == (0, 0, 10, 10), "walls and models"


def test_joints_lead_from_origin_to_origin(files):
    bodies = "[{name: a, footprints: []}, {name: b, pose: [2, 0, 0], footprints: []}]"
    ends = "[{name: a, anchor: [1.5, 0]}, {name: b, anchor: [-0.5, 0.1]}]"
    joint = f"{{type: revolute, name: j, bodies: {ends}, color: [0, 1, 0, 1]}}"
    scene = look_at(room_world(files, bodies=bodies, joints=f"[{joint}]"), None, scans=True)
    (link,) = scene.links
    assert link.points == pytest.approx(np.array([(4, 3), (4, 4.5), (3.9, 4.5), (4, 5)]), abs=1e-5)
    assert link.color == (0, 1, 0, 1)
    # Bodies without footprints have nothing to point with.
    assert scene.figurines[0].middle is None


class TestScans:
    def test_without_an_emitted_scan_the_laser_is_asked_without_its_noise(self, files):
        world = room_world(files, f"[{laser('noise_std_dev: 0.5')}]")
        assert hits(world) == pytest.approx(np.array(CROSS_HITS), abs=1e-4)
        (sweep,) = look_at(world, None, scans=True).sweeps
        assert sweep.area == pytest.approx(np.array([(4, 3), *CROSS_HITS]), abs=1e-4)

    def test_none_if_not_asked_for(self, files):
        assert look_at(room_world(files, f"[{laser()}]"), None, scans=False).sweeps == []

    def test_the_sensor_is_mounted_and_upside_down(self, files):
        world = room_world(files, f"[{laser('upside_down: true, origin: [1, 0, 0]')}]")
        expected = [(4, 9), (9, 4), (4, 1), (1, 4)]
        # The body's own circle of 0.5 m radius is behind the sensor.
        expected[2] = (4, 3.5)
        assert hits(world) == pytest.approx(np.array(expected), abs=1e-4)

    @pytest.mark.parametrize("no_hit", ["nan", "inf", "range"])
    def test_a_beam_that_hits_nothing_has_no_point(self, files, no_hit):
        world = room_world(files, f"[{laser(f'layers: [empty], no_hit: {no_hit}')}]")
        for _ in range(2):
            (sweep,) = look_at(world, None, scans=True).sweeps
            assert sweep.hits.shape == (0, 2)
            assert np.hypot(*(sweep.area[1:] - (4, 3)).T) == pytest.approx(20)
            world.output("/scan")
            world.step()

    def test_the_latest_scan_is_taken_with_its_noise(self, files):
        world = room_world(files, f"[{laser('noise_std_dev: 0.02', increment=0.01)}]")
        scan = world.output("/scan")
        world.step()
        (sweep,) = look_at(world, None, scans=True).sweeps
        ranges = np.hypot(*(sweep.hits - (4, 3)).T)
        assert ranges == pytest.approx(scan.latest.ranges, abs=1e-5)
        assert 0.005 < off_the_walls(sweep.hits).std() < 0.05

    def test_a_scan_is_drawn_from_where_it_was_taken(self, files):
        world = room_world(files, f"[{DRIVE}, {laser('update_rate: 20', increment=0.01)}]")
        scan = world.output("/scan")
        world.command("/cmd_vel").set(flatland.Twist(linear_x=1.0, angular_z=1.0))
        world.step(59)
        age = world.timekeeper.sim_time_ns - scan.latest.stamp
        assert age == 45_000_000, "a scan just due again is 45 mm and 45 mrad behind"
        (sweep,) = look_at(world, None, scans=True).sweeps
        ranges = np.hypot(*(sweep.hits - sweep.area[0]).T)
        assert ranges == pytest.approx(scan.latest.ranges, abs=1e-5)
        assert off_the_walls(sweep.hits).max() < 5e-3

    def test_a_scan_from_before_a_move_is_not_shown(self, files):
        world = room_world(files, f"[{laser('update_rate: 1', increment=0.01)}]")
        world.output("/scan")
        world.step()
        world.move_model("robot", (7, 6, 0.3))
        assert off_the_walls(hits(world)).max() < 1e-4

    def test_a_scan_of_long_ago_is_not_shown(self, files):
        world = room_world(files, f"[{laser('noise_std_dev: 0.02, update_rate: 50')}]")
        output = world.output("/scan")
        world.step()
        output.unwant(world)
        assert off_the_walls(hits(world)).max() > 1e-4
        world.step(10)
        assert off_the_walls(hits(world)).max() < 1e-4

    def test_a_scan_of_another_laser_on_the_topic_is_not_shown(self, files):
        """Two lasers of one frame and topic, which only the values tell apart."""
        other = laser("origin: [0, 0, 0.5], frame: eye").replace("name: eye", "name: other")
        world = room_world(files, f"[{laser()}, {other}]")
        world.output("/scan")
        world.step()
        first, second = look_at(world, None, scans=True).sweeps
        assert first.hits == pytest.approx(np.array(CROSS_HITS), abs=1e-4)
        assert off_the_walls(second.hits).max() < 1e-4
        assert np.abs(second.hits - first.hits).max() > 0.5


def test_looking_changes_nothing(files):
    plugins = f"[{DRIVE}, {laser('noise_std_dev: 0.1', increment=0.1)}]"

    def run(look: bool) -> tuple[Any, ...]:
        world = room_world(files, plugins, seed=5)
        plugin: Any = world.model("robot").plugin("eye")
        world.command("/cmd_vel").set(flatland.Twist(linear_x=0.5, angular_z=1.0))
        for _ in range(20):
            if look:
                look_at(world, None, scans=True)
            world.step(5)
        assert not world.ports.find_output("/scan").wanted
        body = world.models[0].bodies[0]
        return (
            body.pose,
            body.velocity,
            plugin.rng.bit_generator.state,
            plugin.intensities.tobytes(),
        )

    assert run(look=True) == run(look=False)


def test_a_closed_world_has_nothing_to_see(files):
    world = room_world(files)
    world.close()
    with pytest.raises(flatland.WorldError, match="the world is closed"):
        look_at(world, None, scans=True)
