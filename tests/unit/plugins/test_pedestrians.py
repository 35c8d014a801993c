"""The plugin Pedestrians: formulas, ways, behaviour and parameters."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import flatland
from flatland.errors import PluginError, WorldError
from flatland.physics.crowd import (
    HalfPlane,
    avoid,
    leg_offset,
    nearest_point,
    repulsion,
    step_length,
    wall_repulsion,
)
from flatland.plugins.pedestrians import Pedestrians
from tests.unit.conftest import WorldFiles

ROOM = ["##########", "#        #", "#        #", "#        #", "#        #", "##########"]


def people_of(world: flatland.World) -> Pedestrians:
    plugin = world.plugins[0]
    assert isinstance(plugin, Pedestrians)
    return plugin


def load(
    files: WorldFiles, groups: str, options: str = "", walls: list[str] | None = None, **more: Any
) -> flatland.World:
    """Loads a world with a map, by default a room of 8 m by 4 m, and people."""
    files.write_map("room", ROOM if walls is None else walls)
    text = (
        "properties: {}\n"
        "layers: [{name: [2d, body], map: room.yaml}]\n"
        f"plugins: [{{name: people, type: Pedestrians, {options}groups: {groups}}}]\n"
    )
    return files.load(text, **more)


ONE = "[{name: a, count: 0, radius: 0.2, speed: 1.2, speed_deviation: 0, waypoints: [{at: %s}]}]"
CALM = "fluctuation: 0, "


# -- formulas ------------------------------------------------------------------------------


def test_a_person_who_stands_repels_with_the_gradient_of_a_round_potential() -> None:
    # V0 / sigma exp(-d / sigma), away from the other person.
    x, y = repulsion((0.6, 0.8), (0.0, 0.0), strength=2.1, range=0.3)
    assert math.hypot(x, y) == pytest.approx(7.0 * math.exp(-1.0 / 0.3))
    assert y / x == pytest.approx(0.8 / 0.6)


def test_the_repulsion_is_the_gradient_of_the_elliptic_potential() -> None:
    velocity, look_ahead, strength, sigma = (0.5, -0.3), 1.5, 2.0, 0.4

    def potential(x: float, y: float) -> float:
        sx, sy = look_ahead * velocity[0], look_ahead * velocity[1]
        total = math.hypot(x, y) + math.hypot(x - sx, y - sy)
        return strength * math.exp(-0.5 * math.sqrt(total**2 - sx**2 - sy**2) / sigma)

    x, y, h = 0.9, 0.4, 1e-6
    expected = (
        -(potential(x + h, y) - potential(x - h, y)) / (2 * h),
        -(potential(x, y + h) - potential(x, y - h)) / (2 * h),
    )
    numbers = {"strength": strength, "range": sigma, "look_ahead": look_ahead}
    assert repulsion((x, y), velocity, **numbers) == pytest.approx(expected, rel=1e-6)


def test_a_wall_repels_exponentially_with_the_distance_from_the_circumference() -> None:
    x, y = wall_repulsion((0.0, -0.5), 0.2, wall_strength=5.0, wall_range=0.1)
    assert (x, y) == pytest.approx((0.0, -5.0 * math.exp(-3.0)))


def test_two_discs_share_the_change_of_velocity_that_avoids_a_head_on_collision() -> None:
    # Both move at 1 m/s; the gap of 3 m lasts for the horizon of 2 s at a relative speed of 1.5.
    left = ((0.0, 0.0), (1.0, 0.0), 0.5)
    right = ((4.0, 0.0), (-1.0, 0.0), 0.5)
    plane = avoid(left, right, horizon=2.0, share=0.5, dt=0.05)
    mirrored = avoid(right, left, horizon=2.0, share=0.5, dt=0.05)
    # The nearest velocity outside the cone touches its side, at asin(r / d) from its axis.
    half_angle = math.asin(1.0 / 4.0)
    assert abs(plane.normal[1]) == pytest.approx(math.cos(half_angle))
    assert plane.normal[0] == pytest.approx(-math.sin(half_angle))
    change = 2.0 * math.sin(half_angle)  # of the relative velocity, which lies on the axis
    assert plane.offset == pytest.approx(plane.normal[0] * 1.0 + change / 2)
    # Point-symmetric: both move to their right, or both to their left.
    assert mirrored.normal == pytest.approx((-plane.normal[0], -plane.normal[1]))
    assert mirrored.offset == pytest.approx(plane.offset)


def test_discs_that_stand_apart_need_no_change() -> None:
    plane = avoid(
        ((0.0, 0.0), (0.0, 0.0), 0.2), ((2.0, 0.0), (0.0, 0.0), 0.2), horizon=2.0, share=0.5, dt=0.1
    )
    # At rest, half of the gap may be closed within the horizon.
    assert plane.normal == (-1.0, 0.0)
    assert plane.offset == pytest.approx(-(1.6 / 2.0) / 2)


def test_the_nearest_point_of_half_planes_is_that_of_an_exhaustive_search() -> None:
    rng = np.random.default_rng(4)
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, 401)] * 2), axis=-1).reshape(-1, 2)
    grid = grid[np.hypot(*grid.T) <= 1.0]
    feasible = 0
    for _ in range(60):
        angles = rng.uniform(0, 2 * np.pi, 4)
        normals = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        offsets = rng.uniform(-0.6, 0.3, 4)
        planes = [
            HalfPlane((float(n[0]), float(n[1])), float(o))
            for n, o in zip(normals, offsets, strict=True)
        ]
        preferred = rng.uniform(-1, 1, 2)
        found = np.array(nearest_point(planes, (preferred[0], preferred[1]), radius=1.0))
        assert np.hypot(*found) <= 1.0 + 1e-9
        slack = grid @ normals.T - offsets
        inside = grid[(slack >= 0).all(axis=1)]
        if len(inside):
            feasible += 1
            assert (normals @ found >= offsets - 1e-9).all()
            best = np.hypot(*(inside - preferred).T).min()
            assert np.hypot(*(found - preferred)) <= best + 1e-9
        else:  # the greatest violation is minimal
            assert (offsets - normals @ found).max() <= (-slack).max(axis=1).min() + 1e-9
    assert 10 < feasible < 60


def test_a_standing_leg_does_not_move_over_the_ground() -> None:
    speed, length = 1.34, step_length(1.34)
    assert length == pytest.approx(0.64, abs=0.01)
    for phase in np.linspace(0.0, 0.49, 20):  # the left leg stands
        walked = 2.0 * length * phase
        assert walked + leg_offset(phase, speed) == pytest.approx(length / 2)
    assert leg_offset(0.75, speed) == pytest.approx(0.0)  # it swings
    assert leg_offset(0.3, 0.0) == 0.0


# -- motion --------------------------------------------------------------------------------


def test_the_speed_relaxes_exponentially(files: WorldFiles) -> None:
    options = CALM + "update_rate: 200, social_force: {relaxation_time: 0.5, wall_strength: 0}, "
    long = ["#" * 32, *["#" + " " * 30 + "#"] * 4, "#" * 32]
    world = load(files, ONE % "[30, 3]", options, long)
    people = people_of(world)
    people.spawn(poses=[(2.0, 3.0, 0.0)])
    world.step(1 + 200)  # velocities change at the start of each of 201 steps
    speed = math.hypot(*people.people.velocities[0, :2])
    # Explicit Euler steps of v' = (1.2 - v) / 0.5.
    assert speed == pytest.approx(1.2 * (1.0 - (1.0 - 0.005 / 0.5) ** 201), rel=1e-3)


@pytest.mark.parametrize("model", ["social_force", "orca"])
def test_two_people_avoid_each_other_symmetrically(files: WorldFiles, model: str) -> None:
    groups = (
        "[{name: a, count: 0, speed_deviation: 0, waypoints: [{at: [8.4, 2.9]}]},"
        " {name: b, count: 0, speed_deviation: 0, waypoints: [{at: [1.6, 3.1]}]}]"
    )
    world = load(files, groups, CALM + f"model: {model}, ")
    people = people_of(world)
    people.spawn("a", poses=[(2.0, 2.9, 0.0)])
    people.spawn("b", poses=[(8.0, 3.1, math.pi)])
    closest = math.inf
    for _ in range(100):
        world.step(10)
        (ax, ay, _), (bx, by, _) = people.people.poses
        closest = min(closest, math.hypot(ax - bx, ay - by))
        # The room is symmetric about its center.
        assert (ax + bx, ay + by) == pytest.approx((10.0, 6.0), abs=0.05)
    assert ax > 6.0  # they have passed each other
    assert closest >= 0.4


@pytest.mark.parametrize("model", ["social_force", "orca"])
def test_people_in_a_crowd_touch_neither_walls_nor_each_other(
    files: WorldFiles, model: str
) -> None:
    groups = (
        "[{name: a, count: 24, waypoints: [{at: [2, 2]}, {at: [8.5, 4.5]}], order: back_and_forth}]"
    )
    walls = ["##########", "#        #", "#   ## # #", "#        #", "#        #", "##########"]
    world = load(files, groups, f"model: {model}, ", walls)
    people = people_of(world)
    edges = world.layers[0].world_edges
    along = edges[:, 2:] - edges[:, :2]
    moved = 0.0
    for _ in range(150):
        before = people.people.poses[:, :2]
        world.step(20)
        places = people.people.poses[:, :2]
        moved += float(np.hypot(*(places - before).T).sum())
        offset = places[:, np.newaxis] - edges[:, :2]
        t = np.clip(np.sum(offset * along, axis=2) / np.sum(along**2, axis=1), 0, 1)
        assert np.hypot(*(offset - t[..., np.newaxis] * along).transpose(2, 0, 1)).min() > 0.1999
        between = np.hypot(*(places[:, np.newaxis] - places).transpose(2, 0, 1))
        assert between[~np.eye(len(places), dtype=bool)].min() > 0.3999
    assert moved > 24 * 3.0


def test_ways_lead_through_doors(files: WorldFiles) -> None:
    walls = [
        "##########",
        "#   #    #",
        "#   #    #",
        "#   #    #",
        "#        #",
        "##########",
    ]
    world = load(files, ONE % "[8, 4.5]", CALM, walls)
    people = people_of(world)
    people.spawn(poses=[(2.0, 4.5, 0.0)])
    world.step(2400)
    assert people.people.poses[0, :2] == pytest.approx((8.0, 4.5), abs=0.6)


@pytest.mark.parametrize("model", ["social_force", "orca"])
def test_opposite_streams_pass_a_door(files: WorldFiles, model: str) -> None:
    walls = [
        "#############",
        "#     #     #",
        "#     #     #",
        "#           #",
        "#     #     #",
        "#     #     #",
        "#############",
    ]  # with a door of 1 m at x = 6.5
    groups = (
        "[{name: right, count: 10, area: [1.2, 1.2, 5.5, 5.8], order: once, waypoints:"
        " [{area: [8, 1.4, 11.6, 5.6]}]},"
        " {name: left, count: 10, area: [7.5, 1.2, 11.8, 5.8], order: once, waypoints:"
        " [{area: [1.4, 1.4, 5, 5.6]}]}]"
    )
    world = load(files, groups, f"model: {model}, ", walls)
    people = people_of(world)
    is_right = np.array([group == "right" for group in people.people.groups])
    for _ in range(120):
        world.step(200)
        if ((people.people.poses[:, 0] > 6.5) == is_right).all():
            break
    assert ((people.people.poses[:, 0] > 6.5) == is_right).all()


def test_a_place_holds_more_people_than_fit_within_its_radius(files: WorldFiles) -> None:
    groups = "[{name: a, count: 12, order: once, waypoints: [{at: [5, 3], radius: 0.3}]}]"
    world = load(files, groups)
    people = people_of(world)
    world.step(8000)
    assert people.people.standing.all()
    assert np.hypot(*(people.people.poses[:, :2] - (5.0, 3.0)).T).max() < 2.0


def test_people_follow_a_map_that_is_replaced(files: WorldFiles) -> None:
    world = load(files, ONE % "[8, 4.5]", CALM)
    people = people_of(world)
    people.spawn(poses=[(2.0, 4.5, 0.0)])
    world.step(10)
    closed = [row[:4] + "#" + row[5:] for row in ROOM]
    world.set_layer_map("2d", files.write_map("closed", closed))
    world.step(2000)
    assert people.people.poses[0, 0] < 4.0  # there is no way any more


def test_members_of_a_party_stay_together(files: WorldFiles) -> None:
    group = (
        "[{name: a, count: 2, together: 2, area: [1.5, 1.5, 3, 4.5],"
        " waypoints: [{at: [8, 3]}, {at: [2, 3]}]}]"
    )
    world = load(files, group)
    people = people_of(world)
    for _ in range(20):
        world.step(200)
        (ax, ay, _), (bx, by, _) = people.people.poses
        assert math.hypot(ax - bx, ay - by) < 2.0


def test_people_queue_and_are_served_one_by_one(files: WorldFiles) -> None:
    group = (
        "[{name: a, count: 4, area: [1.5, 1.5, 4, 4.5], order: once, waypoints:"
        " [{at: [6, 3], queue: true, wait: [4, 4]}, {area: [7.5, 1.2, 8.8, 4.8]}]}]"
    )
    world = load(files, group)
    people = people_of(world)
    served: list[float] = []
    waiting = 0
    for tick in range(300):
        world.step(20)
        states = people.people
        gone = int((states.poses[:, 0] > 7.4).sum())
        served += [0.1 * tick] * (gone - len(served))
        waiting = max(waiting, int((states.standing & (states.poses[:, 0] < 7.0)).sum()))
    assert len(served) == 4
    assert min(np.diff(served)) > 3.5
    assert waiting >= 3


def test_people_wait_at_waypoints_and_stop_on_the_way(files: WorldFiles) -> None:
    group = (
        "[{name: a, count: 8, stops: {every: 5, time: [2, 4]},"
        " waypoints: [{at: [2, 3], wait: [1, 2]}, {at: [8, 3]}]}]"
    )
    world = load(files, group)
    people = people_of(world)
    shares = []
    for _ in range(40):
        world.step(100)
        states = people.people
        shares.append(states.standing.mean())
    # On average 5 s of walking, then 3 s of standing.
    assert 0.2 < np.mean(shares[10:]) < 0.65


@pytest.mark.parametrize(("awareness", "is_hit"), [(1, False), (0, True)])
def test_robots_are_avoided_by_those_who_are_aware_of_them(
    files: WorldFiles, awareness: int, is_hit: bool
) -> None:
    world = load(files, ONE % "[8, 3]", CALM + f"robot_awareness: {awareness}, ")
    robot = world.spawn_model("minimal.model.yaml", "robot", pose=(5.0, 3.05, 0.0))
    assert robot is not None
    people_of(world).spawn(poses=[(2.0, 3.0, 0.0)])
    world.step(1000)
    assert people_of(world).people.poses[0, 0] > 6.0
    assert (math.hypot(robot.pose[0] - 5.0, robot.pose[1] - 3.05) > 0.05) == is_hit


def test_a_closed_door_stops_people_until_it_opens(files: WorldFiles) -> None:
    walls = ["##########", "#   #    #", "#   #    #", "#        #", "#   #    #", "##########"]
    files.write(
        "door.model.yaml",
        "bodies:\n  - name: door\n    type: kinematic\n    footprints:\n"
        "      - {type: polygon, density: 0, points:"
        " [[-0.1, -0.5], [0.1, -0.5], [0.1, 0.5], [-0.1, 0.5]]}\n",
    )
    world = load(files, ONE % "[8, 2.5]", "robot_awareness: 0, ", walls)
    world.spawn_model("door.model.yaml", "door", pose=(4.5, 2.5, 0.0))
    people = people_of(world)
    people.spawn(poses=[(2.0, 2.5, 0.0)])
    world.step(1200)
    assert people.people.poses[0, 0] < 4.4 - 0.19
    world.delete_model("door")
    world.step(1200)
    assert people.people.poses[0, 0] > 7.0


def test_dynamic_people_can_be_pushed(files: WorldFiles) -> None:
    moved = {}
    for body_type in ("kinematic", "dynamic"):
        world = load(files, ONE % "[2, 3]", CALM + f"body_type: {body_type}, robot_awareness: 0, ")
        robot = world.spawn_model("minimal.model.yaml", "robot", pose=(3.5, 3.0, 0.0))
        assert robot is not None
        people = people_of(world)
        [name] = people.spawn(poses=[(4.0, 3.0, 0.0)])
        people.stop([name])
        for _ in range(400):
            robot.bodies[0].physics.apply_force((20.0, 0.0), robot.pose[:2])
            world.step()
        moved[body_type] = people.people.poses[0, 0] - 4.0
    assert moved["kinematic"] == pytest.approx(0.0, abs=1e-6)
    assert moved["dynamic"] > 0.02


def test_lasers_see_the_legs_in_their_layer(files: WorldFiles) -> None:
    options = CALM + "layers: [body], legs: {layers: [2d], radius: 0.07, spacing: 0.2}, "
    world = load(files, ONE % "[8, 3]", options)
    people = people_of(world)
    [name] = people.spawn(poses=[(4.0, 3.0, 0.0)])
    people.stop([name])
    world.step(20)
    legs = [body for body in world.model(name).bodies if body.name != "body"]
    assert [body.pose[:2] for body in legs] == [
        pytest.approx((4.0, 3.1), abs=1e-3),
        pytest.approx((4.0, 2.9), abs=1e-3),
    ]
    bits = {layer: world.collision_filter.category_bits([layer]) for layer in ("2d", "body")}
    ends = np.array([[4.0, 0.1], [4.0, 0.0]], dtype=np.float32)
    seen = {
        layer: world.physics.cast_rays((2.0, 3.0, 0.0), ends, mask)[0] * 4.0
        for layer, mask in bits.items()
    }
    # The first ray passes the center of the left leg at 0.05 m, the second one between the legs.
    assert seen["2d"][0] == pytest.approx(2.0 - math.sqrt(0.07**2 - 0.05**2), abs=0.005)
    assert np.isnan(seen["2d"][1])
    assert seen["body"] == pytest.approx([1.8, 1.8], abs=0.03)


# -- requests and states -------------------------------------------------------------------

CROWD = (
    "[{name: a, count: 6, stops: {every: 10, time: [1, 2]}},"
    " {name: b, count: 4, together: 2, waypoints: [{at: [2, 2], wait: [1, 2]}, {at: [8, 4]}],"
    " order: random}, {name: c, count: 2, waypoints: [{at: [5, 3], queue: true, wait: [1, 2]},"
    " {at: [8, 2]}]}]"
)
FULL = "layers: [body], legs: {layers: [2d]}, "


@pytest.mark.parametrize("options", [FULL, FULL + "model: orca, ", FULL + "body_type: dynamic, "])
def test_runs_with_one_seed_are_equal(files: WorldFiles, options: str) -> None:
    hashes = []
    for seed, listens in ((1, False), (1, True), (2, False)):
        world = load(files, CROWD, options, seed=seed)
        if listens:
            world.output("/people")
            world.output("/people/states")
        world.step(700)
        if listens:
            for _ in range(300):
                world.step()
        else:
            world.step(300)
        hashes.append(world.state_hash())
    assert hashes[0] == hashes[1] != hashes[2]


@pytest.mark.parametrize("options", [FULL, FULL + "body_type: dynamic, "])
def test_snapshots_clones_and_resets_repeat_the_run(files: WorldFiles, options: str) -> None:
    world = load(files, CROWD, options)
    start = world.state_hash()
    world.step(333)
    snapshot = world.snapshot()
    with world.clone() as clone:
        world.step(700)
        later = world.state_hash()
        clone.step(700)
        assert clone.state_hash() == later
        assert people_of(clone).people.names == people_of(world).people.names
    people_of(world).spawn("a", 1)
    people_of(world).remove(["b_0"])
    world.step(50)
    world.restore(snapshot)
    assert "b_0" in people_of(world).people.names
    world.step(700)
    assert world.state_hash() == later
    world.reset()
    assert world.state_hash() == start


def test_a_recording_repeats_spawned_and_directed_people(files: WorldFiles, tmp_path: Any) -> None:
    from flatland.recording import Replay

    world = load(files, CROWD, FULL)
    recorder = world.record(tmp_path / "run.log")
    try:
        people = people_of(world)
        world.step(100)
        names = people.spawn("b", 2)
        people.send(names[:1], (8.0, 3.0))
        people.stop(["a_1"])
        world.step(100)
        people.remove(["a_0", names[1]])
        people.resume()
        world.move_model("a_2", (5.0, 4.0, 0.0))
        world.delete_model("a_3")
        world.step(250)
    finally:
        recorder.close()
    replay = Replay(tmp_path / "run.log")
    assert replay.run() is None
    assert people_of(replay.world).people.names == people_of(world).people.names
    replay.close()


def test_people_are_sent_stopped_and_resumed(files: WorldFiles) -> None:
    world = load(files, ONE % "[8, 2]", CALM)
    people = people_of(world)
    [name] = people.spawn(poses=[(2.0, 2.0, 0.0)])
    people.send([name], (2.0, 4.0))
    world.step(1000)
    assert people.people.poses[0, :2] == pytest.approx((2.0, 4.0), abs=0.35)
    assert people.people.standing[0]
    people.resume()
    world.step(200)
    assert not people.people.standing[0]
    people.stop()
    world.step(600)
    before = people.people.poses[0, :2]
    world.step(200)
    assert people.people.poses[0, :2] == pytest.approx(before, abs=0.01)


def test_pause_drag_and_deletion_of_people(files: WorldFiles) -> None:
    world = load(files, CROWD, FULL)
    people = people_of(world)
    world.step(100)
    before = world.state_hash()
    world.pause()
    world.step(100)
    assert world.state_hash() == before
    world.resume()
    world.move_model("a_0", (3.0, 3.0, 0.0), if_blocked="allow")
    world.step(10)
    index = people.people.names.index("a_0")
    assert people.people.poses[index, :2] == pytest.approx((3.0, 3.0), abs=0.3)
    world.delete_model("a_0")
    world.step(10)
    assert "a_0" not in people.people.names
    people.remove()
    world.step(10)
    assert people.people.names == ()
    assert people.spawn("a", 2) == ["a_6", "a_7"]


def test_the_outputs_carry_the_people(files: WorldFiles) -> None:
    world = load(files, CROWD, "pub_rate: 5, ")
    output, states = world.output("/people"), world.output("/people/states")
    times: list[int] = []
    output.subscribe(lambda value: times.append(value.stamp))
    world.step(200)
    assert times == [200_000_000 * k for k in range(1, 6)]
    assert output.latest is not None
    assert states.latest is not None
    assert output.latest.poses.shape == (12, 3)
    assert states.latest.groups == ("a",) * 6 + ("b",) * 4 + ("c",) * 2
    assert states.latest.velocities.shape == (12, 3)


def test_failed_requests_change_nothing(files: WorldFiles) -> None:
    world = load(files, CROWD)
    people = people_of(world)
    before = [model.name for model in world.models]
    for request, text in (
        (lambda: people.spawn("x"), 'group "x" does not exist; groups: a, b, c'),
        (lambda: people.spawn("a", 5000), "free places"),
        (lambda: people.remove(["a_0", "nobody"]), 'there is no person "nobody"'),
        (lambda: people.send(["a_0"], (100.0, 100.0)), "there is no way for"),
        (lambda: people.spawn("a", poses=[(2, 2, 0), (math.nan, 0, 0)]), "finite"),
    ):
        with pytest.raises((WorldError, ValueError), match=text):
            request()
    assert [model.name for model in world.models] == before
    with pytest.raises(WorldError, match="does not exist"):
        world.call_plugin(people, "on_shutdown", {})


@pytest.mark.parametrize(
    ("groups", "options", "text"),
    [
        ("[]", "", 'Invalid "groups", must be a list of at least one group'),
        ("[{name: a}]", "", "count"),
        ("[{name: a, count: 1}, {name: a, count: 1}]", "", 'Group with name "a" already exists'),
        ("[{name: a, count: -1}]", "", "from 0 to 10000"),
        ("[{name: a, count: 1, radius: 0}]", "", 'Invalid "radius", must be finite and greater'),
        ("[{name: a, count: 1, order: loop}]", "", 'Invalid "order", must be wander'),
        ("[{name: a, count: 1, area: [2, 2, 1, 3]}]", "", 'Invalid "area"'),
        ("[{name: a, count: 1, waypoints: [{radius: 1}]}]", "", "A waypoint requires either at"),
        (
            "[{name: a, count: 1, waypoints: [{at: [1.0, 1.0], radius: 0.1}]}]",
            "",
            "A waypoint is not in the free space",
        ),
        ("[{name: a, count: 1, waypoints: [{at: [2, 2], wait: [3, 1]}]}]", "", 'Invalid "wait"'),
        ("[{name: a, count: 900}]", "", 'group "a": found only'),
        ("[{name: a, count: 1, colour: 1}]", "", "colour"),
        ("[{name: a, count: 1}]", "model: sfm, ", 'must be one of: social_force, orca, got "sfm"'),
        ("[{name: a, count: 1}]", "robot_awareness: 2, ", "from 0 to 1"),
        ("[{name: a, count: 1}]", "layers: [x], ", "layer(s) does not exist"),
        ("[{name: a, count: 1}]", "social_force: {mass: 1}, ", "mass"),
        ("[{name: a, count: 1}]", "orca: {horizon: 0}, ", 'Invalid "horizon"'),
        (
            "[{name: a, count: 1}]",
            "layers: [2d], legs: {layers: [2d]}, ",
            "bodies and legs must not be in the same layer",
        ),
        (
            "[{name: a, count: 1}]",
            "body_type: dynamic, legs: {layers: [2d]}, ",
            'dynamic people with legs require "layers"',
        ),
    ],
)
def test_invalid_parameters_are_reported_with_their_place(
    files: WorldFiles, groups: str, options: str, text: str
) -> None:
    with pytest.raises(PluginError) as error:
        load(files, groups, options)
    assert text in str(error.value)
    assert "world.yaml" in str(error.value)
