"""How people of the plugin Pedestrians move."""

from __future__ import annotations

import math

import numpy as np
import pytest
from rooms_with_people import CALM, DOOR, ONE, ROOM, SHELF, load, people_of

from flatland import Body, World
from flatland._core import crowd_repulsion
from flatland.errors import PluginError, WorldError
from tests.unit.conftest import WorldFiles


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


@pytest.mark.parametrize(("wall_range", "is_pushed"), [(0.5, True), (0.1, False)])
def test_walls_repel_at_the_distance_that_follows_from_the_range(
    files: WorldFiles, wall_range: float, is_pushed: bool
) -> None:
    # At a gap of 1.3 m, the repulsion is 0.37 m/s² with a range of 0.5 m, negligible with 0.1 m.
    hall = ["#" * 22, *["#" + " " * 20 + "#"] * 20, "#" * 22]
    world = load(
        files, ONE % "[18, 2.5]", CALM + f"social_force: {{wall_range: {wall_range}}}, ", hall
    )
    people = people_of(world)
    people.spawn(poses=[(6.0, 2.5, 0.0)])
    world.step(200)
    assert (people.people.poses[0, 1] > 2.52) == is_pushed


@pytest.mark.parametrize("relative", [1.0, 0.3])
def test_people_repel_each_other_according_to_their_velocities(
    files: WorldFiles, relative: float
) -> None:
    numbers = {"strength": 1.5, "range": 0.3, "look_ahead": 1.0}
    forces = f"relative: {relative}, behind: 1, wall_strength: 0, strength: 1.5, look_ahead: 1"
    hall = ["#" * 42, *["#" + " " * 40 + "#"] * 20, "#" * 42]
    world = load(files, ONE % "[39, 10]", CALM + f"social_force: {{{forces}}}, ", hall)
    people = people_of(world)
    people.spawn(poses=[(4.0, 10.2, 0.0), (4.6, 9.8, 0.0)])
    for _ in range(4):
        world.step(10)
        places, before = people.people.poses[:, :2], people.people.velocities[:, :2]
        world.step(1)  # with an update
        changes = (people.people.velocities[:, :2] - before) / 0.05
        for i, j in ((0, 1), (1, 0)):
            way = np.array([39.0, 10.0]) - places[i]
            driving = (1.2 * way / np.hypot(*way) - before[i]) / 0.5
            velocity = before[j] - relative * before[i]
            push = crowd_repulsion(tuple(places[i] - places[j]), tuple(velocity), numbers)
            assert changes[i] == pytest.approx(driving + push, abs=0.03)
            assert math.hypot(*push) > 0.09
        world.step(9)


def two_people(files: WorldFiles, left_y: float, right_y: float, options: str = "") -> World:
    """A world with two people who walk towards each other."""
    groups = (
        f"[{{name: a, count: 0, speed_deviation: 0, waypoints: [{{at: [8.4, {left_y}]}}]}},"
        f" {{name: b, count: 0, speed_deviation: 0, waypoints: [{{at: [1.6, {right_y}]}}]}}]"
    )
    world = load(files, groups, CALM + options)
    people_of(world).spawn("a", poses=[(2.0, left_y, 0.0)])
    people_of(world).spawn("b", poses=[(8.0, right_y, math.pi)])
    return world


@pytest.mark.parametrize("model", ["social_force", "orca"])
def test_two_people_avoid_each_other_symmetrically(files: WorldFiles, model: str) -> None:
    world = two_people(files, 2.9, 3.1, f"model: {model}, ")
    closest = math.inf
    for _ in range(100):
        world.step(10)
        (ax, ay, _), (bx, by, _) = people_of(world).people.poses
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


@pytest.mark.parametrize(
    ("model", "documented"),
    [
        (
            "social_force",
            "relaxation_time: 0.5, strength: 1.5, range: 0.3, look_ahead: 1, relative: 1, "
            "behind: 0.1, wall_strength: 5, wall_range: 0.1, gaze: 4, cohesion: 3, spacing: 1",
        ),
        ("orca", "horizon: 2, wall_horizon: 0.5"),
    ],
)
def test_the_default_parameters_are_those_of_the_documentation(
    files: WorldFiles, model: str, documented: str
) -> None:
    groups = (
        "[{name: a, count: 12, together: 3, waypoints: [{at: [2, 2]}, {at: [8.5, 4.5]}],"
        " order: back_and_forth}]"
    )
    worlds = [
        load(files, groups, f"model: {model}, {options}")
        for options in ("", f"{model}: {{{documented}}}, ")
    ]
    for world in worlds:
        world.step(2000)
    default, explicit = (people_of(world).people.poses for world in worlds)
    assert default.tolist() == explicit.tolist()


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
    shared = 0
    for _ in range(1200):
        world.step(20)
        poses = people.people.poses
        inside = (np.abs(poses[:, 0] - 6.5) < 0.5) & (np.abs(poses[:, 1] - 3.5) < 0.5)
        shared += bool((inside & is_right).any() and (inside & ~is_right).any())
        if ((poses[:, 0] > 6.5) == is_right).all():
            break
    assert ((poses[:, 0] > 6.5) == is_right).all()
    assert shared < 30  # of up to 1200: those who want to enter let the others come out


def test_people_keep_right_of_those_who_come_towards_them(files: WorldFiles) -> None:
    world = two_people(files, 3.0, 3.0)
    people = people_of(world)
    while people.people.poses[0, 0] < people.people.poses[1, 0]:
        world.step(10)
        assert world.time < 10.0
    (_, a, _), (_, b, _) = people.people.poses
    assert a < 2.8
    assert b > 3.2


@pytest.mark.parametrize("model", ["social_force", "orca"])
def test_those_who_wander_turn_away_from_a_closed_door(files: WorldFiles, model: str) -> None:
    walls = ["##########", "#    #   #", "#        #", "#    #   #", "#    #   #", "##########"]
    files.write("door.model.yaml", DOOR)
    world = load(files, "[{name: a, count: 6, places: 8}]", f"model: {model}, ", walls)
    people = people_of(world)
    sides = people.people.poses[:, 0] > 5.5
    world.spawn_model("door.model.yaml", "door", pose=(5.5, 3.5, 0.0), if_blocked="allow")
    walked = np.zeros(6)
    for tick in range(40):
        before = people.people.poses[:, :2]
        world.step(200)
        if tick >= 10:
            walked += np.hypot(*(people.people.poses[:, :2] - before).T)
    assert ((people.people.poses[:, 0] > 5.5) == sides).all()
    assert walked.min() > 3.0  # between the places on this side, although half are on the other one


def load_lines(files: WorldFiles, lines: str, groups: str, options: str = "") -> World:
    """Loads a world with walls of line segments and people."""
    files.write("walls.lines", lines)
    files.write(
        "walls.yaml", "{type: line_segments, data: walls.lines, scale: 1, origin: [0, 0, 0]}\n"
    )
    return files.load(
        "properties: {}\nlayers: [{name: 2d, map: walls.yaml}]\n"
        f"plugins: [{{name: people, type: Pedestrians, {options}groups: {groups}}}]\n"
    )


def test_those_who_wander_need_two_places_with_a_way_between_them(files: WorldFiles) -> None:
    # Each of 100 rooms has space for one person, so that the places are in different ones.
    lines = "".join(f"{i} 0 {i} 10\n0 {i} 10 {i}\n" for i in range(11))
    with pytest.raises(PluginError, match="there are no two free places with a way between them"):
        load_lines(files, lines, "[{name: a, count: 1, places: 2, radius: 0.4}]")


def test_nobody_is_added_inside_of_furniture(files: WorldFiles) -> None:
    lines = "0 0 9 0\n9 0 9 6\n9 6 0 6\n0 6 0 0\n" + SHELF
    groups = "[{name: a, count: 0, area: [3, 1, 3.5, 5], waypoints: [{at: [8, 3]}]}]"
    world = load_lines(files, lines, groups)
    with pytest.raises(WorldError, match="found only 0 of 1 free places with a way"):
        people_of(world).spawn("a", 1)


@pytest.mark.parametrize("model", ["social_force", "orca"])
@pytest.mark.parametrize(
    ("width", "start", "goal"), [(1.4, 9.0, 1.0), (0.49, 6.55, 6.55)], ids=["oncoming", "standing"]
)
def test_people_do_not_react_to_those_behind_a_wall(
    files: WorldFiles, model: str, width: float, start: float, goal: float
) -> None:
    top, a, b = 2.0 * width, 1.5 * width, 0.5 * width
    lanes = f"0 0 12 0\n12 0 12 {top}\n12 {top} 0 {top}\n0 {top} 0 0\n0 {width} 12 {width}\n"
    person = "count: 0, radius: 0.2, speed: 1.2, speed_deviation: 0"
    groups = (
        f"[{{name: a, {person}, waypoints: [{{at: [11, {a}]}}]}},"
        f" {{name: b, {person}, waypoints: [{{at: [{goal}, {b}]}}]}}]"
    )
    files.write(
        "obstacle.model.yaml",
        "bodies:\n  - name: post\n    type: kinematic\n"
        "    footprints: [{type: circle, density: 0, radius: 0.2}]\n",
    )
    starts = {"a": (3.0, a, 0.0), "b": (start, b, math.pi)}
    tracks = {}
    for present in ("a", "b", "ab"):
        world = load_lines(files, lanes, groups, f"{CALM}model: {model}, robot_awareness: 0, ")
        world.spawn_model("obstacle.model.yaml", "obstacle", pose=(6.8, a, 0.0))
        people = people_of(world)
        for name in present:
            people.spawn(name, poses=[starts[name]])
        track = []
        for _ in range(100):
            world.step(20)
            track.append(people.people.poses[:, :2])
        tracks[present] = np.array(track)
    assert tracks["ab"][:, 0].tolist() == tracks["a"][:, 0].tolist()
    assert tracks["ab"][:, 1].tolist() == tracks["b"][:, 0].tolist()
    # They come so close that they would react without the wall.
    assert np.hypot(*(tracks["ab"][:, 0] - tracks["ab"][:, 1]).T).min() < 1.1 * width


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


@pytest.mark.parametrize("spacing", [0.7, 1.2])
def test_the_distance_of_people_in_a_queue_is_its_spacing(
    files: WorldFiles, spacing: float
) -> None:
    group = (
        "[{name: a, count: 3, area: [1.5, 2, 4, 4], order: once, waypoints:"
        f" [{{at: [8, 3], queue: true, spacing: {spacing}, wait: [50, 50]}}]}}]"
    )
    world = load(files, group, CALM)
    world.step(4000)
    people = people_of(world).people
    assert people.standing.all()
    along = np.sort(np.hypot(*(people.poses[:, :2] - (8.0, 3.0)).T))
    assert np.diff(along) == pytest.approx([spacing] * 2, abs=0.15)


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
    files.write("door.model.yaml", DOOR)
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


def legs_of(world: World, x: float, y: float) -> list[Body]:
    """Adds a person who stands, and returns the legs."""
    people = people_of(world)
    [name] = people.spawn(poses=[(x, y, 0.0)])
    people.stop([name])
    world.step(100)
    return [body for body in world.model(name).bodies if body.name != "body"]


@pytest.mark.parametrize(("radius", "offset"), [(0.2, 0.25), (0.3, 0.125)])
def test_legs_keep_their_radius_from_walls(files: WorldFiles, radius: float, offset: float) -> None:
    """In a passage of 1 m, wide legs are closer to each other."""
    options = CALM + f"layers: [body], legs: {{layers: [2d], radius: {radius}, spacing: 0.5}}, "
    passage = ["##########", "#        #", "##########"]
    legs = legs_of(load(files, ONE % "[8, 1.5]", options, passage), 4.0, 1.5)
    assert [body.pose[1] for body in legs] == pytest.approx([1.5 + offset, 1.5 - offset], abs=1e-3)


@pytest.mark.parametrize(("body_type", "collides"), [("kinematic", True), ("dynamic", False)])
def test_legs_collide_unless_the_body_can_be_pushed(
    files: WorldFiles, body_type: str, collides: bool
) -> None:
    options = CALM + f"layers: [body], legs: {{layers: [2d]}}, body_type: {body_type}, "
    legs = legs_of(load(files, ONE % "[8, 3]", options), 4.0, 3.0)
    assert [bool(leg.fixtures[0].mask_bits) for leg in legs] == [collides] * 2


def test_lasers_see_the_legs_in_their_layer(files: WorldFiles) -> None:
    options = CALM + "layers: [body], legs: {layers: [2d], radius: 0.07, spacing: 0.2}, "
    world = load(files, ONE % "[8, 3]", options)
    assert [body.pose[:2] for body in legs_of(world, 4.0, 3.0)] == [
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
