"""PathFollower: the motion in closed form, modes, starts, moves, and errors."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from racing_commands import RacingCommand

import flatland

KINEMATIC = """
- name: base
  type: kinematic
  footprints: [{type: circle, radius: 0.2, density: 1}]
"""
Point = tuple[float, float, float]


def entry(text: str) -> str:
    return f"[{{type: PathFollower, name: path, body: base, {text}}}]"


@pytest.fixture
def follow(plugin_world: Any) -> Any:
    def load(text: str, **options: Any) -> flatland.World:
        options = {"bodies": KINEMATIC, "step_size": 0.01, **options}
        world: flatland.World = plugin_world(entry(text), **options)
        return world

    return load


def pose(world: flatland.World) -> Point:
    return world.model("robot").body("base").pose


def plugin(world: flatland.World) -> Any:
    return world.model("robot").plugin("path")


def trapezoid(t: float, length: float, v: float, a: float, b: float) -> float:
    """Returns the distance after t seconds of the fastest motion from rest to rest."""
    if v * v / 2 * (1 / a + 1 / b) > length:
        v = math.sqrt(2 * length / (1 / a + 1 / b))
    cruise = (length - v * v / 2 * (1 / a + 1 / b)) / v
    if t < v / a:
        return a * t * t / 2
    if t < v / a + cruise:
        return v * (t - v / a / 2)
    end = v / a + cruise + v / b
    return length if t >= end else length - b * (end - t) ** 2 / 2


class TestMotion:
    @pytest.mark.parametrize("target", [(3.0, 0.0, 0.0), (0.0, 0.0, 3.0)])
    def test_default_speeds_are_one_metre_and_one_radian_per_second(
        self, follow: Any, target: Point
    ) -> None:
        world = follow(f"waypoints: [{list(target)}], mode: once")
        world.step(150)
        assert pose(world) == pytest.approx([value / 2 for value in target], abs=1e-3)

    @pytest.mark.parametrize("length", [0.2, 3.0], ids=["triangle", "trapezoid"])
    def test_profile(self, follow: Any, length: float) -> None:
        world = follow(
            f"waypoints: [[{length}, 0]], mode: once, speed: 0.8, acceleration: 0.5, "
            "deceleration: 1.25"
        )
        found, expected = [], []
        for k in range(1, 700):
            world.step()
            found.append(pose(world)[0])
            expected.append(trapezoid(k * 0.01, length, 0.8, 0.5, 1.25))
        assert found == pytest.approx(expected, abs=1e-6)
        assert found[-1] == pytest.approx(length, abs=1e-7)

    def test_the_slower_one_of_translation_and_rotation_determines_the_time(
        self, follow: Any
    ) -> None:
        world = follow(
            "waypoints: [[1, 0, 1.5]], mode: once, speed: 10, angular_speed: 0.5, "
            "angular_acceleration: 0.25"
        )
        for k in (50, 100, 150, 200):
            world.step(50)
            angle = trapezoid(k * 0.01, 1.5, 0.5, 0.25, 0.25)
            assert pose(world) == pytest.approx((angle / 1.5, 0.0, angle), abs=1e-6)

    def test_forward_heading_turns_first(self, follow: Any) -> None:
        world = follow("waypoints: [[0, 2]], mode: once, heading: forward, angular_speed: 1")
        world.step(100)
        assert pose(world) == pytest.approx((0.0, 0.0, 1.0), abs=1e-6)
        world.step(157)  # the turn takes pi / 2 s
        assert pose(world) == pytest.approx((0.0, 2.57 - math.pi / 2, math.pi / 2), abs=1e-6)
        world.step(101)
        assert pose(world) == pytest.approx((0.0, 2.0, math.pi / 2), abs=1e-6)

    def test_the_shorter_rotation_is_taken(self, follow: Any) -> None:
        world = follow("waypoints: [[0, 0, -3]], mode: once", pose=(0.0, 0.0, 3.0))
        world.step(1000)
        assert pose(world)[2] == pytest.approx(0.0, abs=1e-6)  # -3 relative to the start
        world = follow("waypoints: [[0, 0, -3]], mode: once, frame: world", pose=(0.0, 0.0, 3.0))
        world.step(10)
        assert pose(world)[2] % math.tau == pytest.approx(3.1, abs=1e-6)
        world.step(1000)
        assert pose(world)[2] == pytest.approx(-3.0, abs=1e-6)

    def test_waypoints_are_relative_to_the_start_or_the_world(self, follow: Any) -> None:
        start = (1.0, 2.0, math.pi / 2)
        world = follow("waypoints: [[2, 1]], mode: once", pose=start)
        world.step(500)
        assert pose(world) == pytest.approx((0.0, 4.0, math.pi / 2), abs=1e-6)
        world = follow("waypoints: [[4, 6, 1.5707963]], mode: once, frame: world", pose=start)
        world.step(10)
        velocity = world.model("robot").body("base").velocity
        assert velocity == pytest.approx((0.6, 0.8, 0.0), abs=1e-4)
        world.step(491)
        assert pose(world) == pytest.approx((4.0, 6.0, math.pi / 2), abs=1e-6)
        assert world.model("robot").body("base").velocity == (0.0, 0.0, 0.0)

    def test_no_drift_in_an_hour(self, follow: Any) -> None:
        """The place after 543 rounds with waiting times is that of the closed form."""
        world = follow("waypoints: [[1.5, 0], [1.5, 1.5]], wait: 0.5, speed: 1", step_size=0.05)
        period = 1.5 + 1.5 + 1.5 * math.sqrt(2) + 1.5
        world.step(72000)
        diagonal = 3600.0 % period - 4.0  # since the body left the second waypoint
        place = 1.5 - diagonal / math.sqrt(2)
        assert pose(world)[:2] == pytest.approx((place, place), abs=1e-5)

    @pytest.mark.parametrize("body", ["dynamic", "static"])
    def test_other_types_of_bodies(self, follow: Any, body: str) -> None:
        world = follow(
            "waypoints: [[1, 0, 1]], mode: once", bodies=KINEMATIC.replace("kinematic", body)
        )
        world.step(50)
        assert pose(world) == pytest.approx((0.5, 0.0, 0.5), abs=1e-6)


class TestModes:
    @pytest.mark.parametrize(
        ("mode", "expected"),
        [
            ("loop", [(1, 0), (1, 1), (1 - 0.5**0.5, 1 - 0.5**0.5), (2 - 2**0.5, 0)]),
            (
                "there_and_back, wait: 1",
                [(1, 0), (1, 0), (1, 1), (1, 1), (1, 0), (1, 0), (0, 0), (0, 0)],
            ),
        ],
    )
    def test_places_after_each_second(
        self, follow: Any, mode: str, expected: list[tuple[float, float]]
    ) -> None:
        world = follow(f"waypoints: [[1, 0], [1, 1]], mode: {mode}")
        for place in expected:
            world.step(100)
            assert pose(world)[:2] == pytest.approx(place, abs=1e-5)

    def test_random_visits_all_others_and_depends_on_the_random_numbers_only(
        self, follow: Any
    ) -> None:
        def visits(seed: int, other_seed: int | None = None) -> list[int]:
            text = "waypoints: [[1, 0], [2, 0], [3, 0]], mode: random, speed: 100"
            world = follow(text, seed=seed)
            if other_seed is not None:
                plugin(world).reseed(np.random.default_rng(other_seed))
            found = []
            for _ in range(400):
                world.step()
                found.append(plugin(world).waypoint)
            return found

        first = visits(1)
        assert first == visits(1)
        assert first != visits(2)
        assert first != visits(1, 5) == visits(1, 5) != visits(1, 6)
        places = [w for before, w in itertools.pairwise(first) if w != before]
        pairs = set(itertools.pairwise(places))
        assert len(pairs) == 12  # from each of four places to the three others

    def test_once_visits_all_waypoints_and_returns_with_the_next_start(self, follow: Any) -> None:
        world = follow("waypoints: [[1, 0], [1, 1]], mode: once, start: false, start_topic: go")
        world.step(300)
        assert pose(world) == (0.0, 0.0, 0.0)
        for corner, end in ((1.0, 1.0), (1.0, 0.0), (1.0, 1.0)):
            world.command("/go").set(True)
            world.step(100)
            assert pose(world)[0] == pytest.approx(corner, abs=1e-6)
            world.step(300)
            assert pose(world)[:2] == pytest.approx((end, end), abs=1e-6)
        world.command("/go").set(False)
        world.step(300)
        assert pose(world)[:2] == pytest.approx((1.0, 1.0), abs=1e-6)

    def test_false_stops_at_the_next_waypoint(self, follow: Any) -> None:
        world = follow("waypoints: [[1, 0], [2, 0]], start_topic: go")
        world.step(50)
        world.command("/go").set(False)
        world.step(300)
        assert pose(world)[0] == pytest.approx(1.0, abs=1e-6)
        assert (plugin(world).waypoint, plugin(world).is_moving) == (1, False)
        world.command("/go").set(True)
        world.step(50)
        assert pose(world)[0] == pytest.approx(1.5, abs=1e-6)


@pytest.mark.parametrize("first", [False, True])
def test_a_command_that_arrives_while_another_one_is_carried_out(follow: Any, first: bool) -> None:
    world = follow("waypoints: [[1, 0]], start_topic: go")
    command = world.ports.commands["/go"][0]
    command.set(first)
    plugin(world)._start_command = RacingCommand(command, not first)
    world.step(3)
    _, is_started, starts = plugin(world).state()
    assert (is_started, starts) == (not first, 1 if first else 2)


def test_equal_waypoints_do_not_hang(follow: Any) -> None:
    world = follow("waypoints: [[0, 0], [0, 0]]")
    world.step(10)
    assert pose(world) == (0.0, 0.0, 0.0)


def test_a_moved_model_continues_to_the_same_waypoint(follow: Any) -> None:
    world = follow("waypoints: [[2, 0]], mode: once")
    world.step(50)
    world.move_model("robot", (0.0, 1.0, 0.0))
    world.step()
    x, y, _ = pose(world)
    assert (x, y) == pytest.approx((0.01 * 2 / math.sqrt(5), 1 - 0.01 / math.sqrt(5)), abs=1e-6)
    world.step(300)
    assert pose(world) == pytest.approx((2.0, 0.0, 0.0), abs=1e-6)


def test_a_path_pushes_dynamic_bodies_and_is_not_deflected(follow: Any) -> None:
    world = follow("waypoints: [[1, 0]], mode: once, speed: 0.5")
    crate = """
bodies:
  - name: box
    footprints: [{type: circle, radius: 0.1, density: 1}]
"""
    world.spawn_model("\n" + crate, "crate", pose=(0.6, 0.0, 0.0))
    world.step(250)
    assert pose(world) == pytest.approx((1.0, 0.0, 0.0), abs=1e-6)
    assert world.model("crate").pose[0] > 1.29


class TestRandomStart:
    @pytest.mark.parametrize("mode", ["loop", "there_and_back", "random"])
    @pytest.mark.parametrize("heading", ["waypoint", "forward"])
    def test_starts_are_places_of_the_motion_in_proportion_to_time(
        self, follow: Any, mode: str, heading: str
    ) -> None:
        text = f"waypoints: [[3, 0], [3, 1]], mode: {mode}, heading: {heading}, wait: 1, speed: 0.5"
        world = follow(text)
        starts = []
        for seed in range(300):
            world.randomize(seed)
            starts.append(pose(world))
            x, y, _ = starts[-1]
            on_sides = [abs(y) < 1e-6, abs(x - 3) < 1e-5]
            if mode != "there_and_back":
                on_sides.append(abs(x - 3 * y) < 1e-5)
            assert any(on_sides)
        assert len(set(starts)) > 100
        if mode == "there_and_back" and heading == "waypoint":
            # 8 s on each way, of which 1 s at each end and at the middle.
            shares = [sum(abs(x - 3) > 1e-5 and x > 1e-5 for x, _, _ in starts) / 300]
            assert shares[0] == pytest.approx(12 / 20, abs=0.1)

    def test_the_motion_continues_from_the_start(self, follow: Any) -> None:
        world = follow("waypoints: [[3, 0], [3, 2]], speed: 1, acceleration: 1, wait: 0.5")

        def places(steps: int) -> np.ndarray:
            found = [pose(world)[:2]]
            for _ in range(steps):
                world.step()
                found.append(pose(world)[:2])
            return np.array(found)

        motion = places(3000)[500:]
        for seed in range(3):
            world.randomize(seed)
            found = places(200)
            assert np.linalg.norm(np.diff(found, axis=0), axis=1).max() <= 0.01 + 1e-5
            distances = np.linalg.norm(found[:, None] - motion, axis=2)
            assert distances.min(axis=1).max() <= 0.01

    @pytest.mark.parametrize(
        "text",
        [
            "waypoints: [[3, 0]], redraw: false",
            "waypoints: [[3, 0]], mode: once",
            "waypoints: [[3, 0]], start: false, start_topic: go",
            "waypoints: [[0, 0]]",
        ],
    )
    def test_some_paths_begin_at_the_initial_pose(self, follow: Any, text: str) -> None:
        world = follow(text)
        world.randomize(1)
        assert pose(world) == (0.0, 0.0, 0.0)

    def test_bodies_on_joints_move_along(self, follow: Any) -> None:
        arm = KINEMATIC + (
            "- {name: arm, pose: [1, 0, 0], footprints: [{type: circle, radius: 0.1, density: 1}]}"
        )
        joints = "[{type: weld, name: joint, bodies: [{name: base, anchor: [1, 0]}, "
        joints += "{name: arm, anchor: [0, 0]}]}]"
        world = follow("waypoints: [[5, 0, 1.5], [5, 5, 3]]", bodies=arm, joints=joints)
        for seed in range(5):
            world.randomize(seed)
            x, y, theta = pose(world)
            ahead = (x + math.cos(theta), y + math.sin(theta))
            assert world.model("robot").body("arm").pose[:2] == pytest.approx(ahead, abs=1e-5)
            world.step(5)
            x, y, theta = pose(world)
            ahead = (x + math.cos(theta), y + math.sin(theta))
            assert world.model("robot").body("arm").pose[:2] == pytest.approx(ahead, abs=0.05)
