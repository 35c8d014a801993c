"""Bodies that nothing can touch are moved without the solver of Box2D, with the same results.

A world with a hook `pre_solve` leaves all bodies to Box2D, here with a hook for no body.
"""

from __future__ import annotations

import math
import os
import random
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from flatland.physics import PhysicsBody, PhysicsWorld, Run, RunEnd
from flatland.plugin_api.update_timer import UpdateTimer

# `make fuzz` compares the results of this number of other worlds.
EXAMPLES = int(os.environ.get("FLATLAND_FUZZ", "0"))
PROPERTY = settings(
    max_examples=EXAMPLES or 15,
    deadline=None,
    derandomize=not EXAMPLES,
    suppress_health_check=list(HealthCheck),
)
RUNS = settings(PROPERTY, max_examples=EXAMPLES or 100)  # which take less time
ROUNDS = 25  # of changes and steps of a world
SIDE = 12.0  # m, of the room
STEP = 5_000_000  # ns, of a run


def two_worlds() -> tuple[PhysicsWorld, PhysicsWorld]:
    """Returns two worlds; the second one leaves all bodies to Box2D."""
    worlds = PhysicsWorld(), PhysicsWorld()
    worlds[1].pre_solve = lambda *_: None
    return worlds


class Pair:
    """Two worlds that receive the same calls."""

    def __init__(self, seed: int, worlds: tuple[PhysicsWorld, PhysicsWorld]) -> None:
        self.rng = random.Random(seed)
        # Kinematic bodies that leave their boxes are moved without the solver if all others are.
        self.kinds = ["dynamic", "kinematic"] + self.rng.choice((["dynamic"], ["kinematic"])) * 5
        self.worlds = worlds
        # Each contact ends a run.
        record_contacts = self.rng.random() < 0.5
        for world in self.worlds:
            world.record_contacts = record_contacts
        self.time = 0  # ns, of runs
        self.bodies: list[tuple[PhysicsBody, ...]] = []
        walls = self._walls()
        self.both(
            lambda world: world.create_body("static", (0, 0, 0)).create_edges(
                walls, category_bits=3
            )
        )
        for _ in range(self.rng.randrange(1, 14)):
            self.add_body()
        jobs = self.worlds[0].jobs
        clock = UpdateTimer(self.rng.choice([3.0, 30.0])).clock(STEP)
        seen = [pair[0] for pair in self.bodies]
        self.reader = jobs.add_callback((1, 0), clock, is_after=True, is_counted=True, bodies=seen)
        jobs.set_called(self.reader, False)

    def both(self, call: Callable[[PhysicsWorld], object]) -> None:
        for world in self.worlds:
            call(world)

    def change(self, call: Callable[[PhysicsBody], object]) -> None:
        for body in self.rng.choice(self.bodies):
            call(body)

    def _walls(self) -> np.ndarray:
        half = SIDE / 2
        rows = [
            (-half, -half, half, -half),
            (half, -half, half, half),
            (half, half, -half, half),
            (-half, half, -half, -half),
        ]
        for _ in range(self.rng.randrange(30)):
            x, y = self.place()
            angle, length = self.rng.uniform(0, math.tau), self.rng.uniform(0.1, 2)
            rows.append((x, y, x + length * math.cos(angle), y + length * math.sin(angle)))
        return np.array(rows, np.float32)

    def place(self) -> tuple[float, float]:
        return self.rng.uniform(-SIDE / 2, SIDE / 2), self.rng.uniform(-SIDE / 2, SIDE / 2)

    def add_body(self) -> None:
        rng = self.rng
        kind = rng.choice(self.kinds)
        pose = (*self.place(), rng.uniform(-9, 9))
        damping = rng.choice([0.0, 0.3])
        shapes = [
            (rng.random() < 0.5, rng.uniform(-0.4, 0.4), rng.uniform(0.05, 0.3), rng.random() < 0.1)
            for _ in range(rng.choice([1, 1, 1, 2, 3, 9]))
        ]
        made = []
        for world in self.worlds:
            body = world.create_body(kind, pose, linear_damping=damping, angular_damping=damping)
            for is_circle, offset, size, is_sensor in shapes:
                if is_circle:
                    body.create_circle((offset, 0), size, density=1, is_sensor=is_sensor)
                else:
                    box = [(offset, -size), (offset + size, -size), (offset + size, size)]
                    body.create_polygon(box, density=2, is_sensor=is_sensor)
            made.append(body)
        self.bodies.append(tuple(made))
        self.push()

    def push(self) -> None:
        scale = self.rng.choice([0.0, 0.01, 1.0, 1.0, 1.0, 30.0])
        numbers = [scale * self.rng.uniform(-1, 1) for _ in range(3)]
        self.change(lambda body: body.set_velocity(*numbers))

    def force(self) -> None:
        fx, fy, torque = (self.rng.uniform(-5, 5) for _ in range(3))
        self.change(lambda body: body.apply_force((fx, fy), body.world_center))
        self.change(lambda body: body.apply_torque(torque / 5))

    def move(self) -> None:
        pose = (*self.place(), self.rng.uniform(-9, 9))
        self.change(lambda body: body.set_pose(*pose))

    def join(self) -> None:
        first, second = self.rng.choice(self.bodies), self.rng.choice(self.bodies)
        if first is second or "dynamic" not in (first[0].type, second[0].type):
            return
        for world, a, b in zip(self.worlds, first, second, strict=True):
            world.create_revolute_joint(a, b, (0.5, 0.0), (-0.5, 0.0))

    def part(self) -> None:
        joints = [pair for pair in self.bodies if pair[0].joints]
        if joints:
            for body in self.rng.choice(joints):
                body.joints[0].destroy()

    def sense(self) -> None:
        value = self.rng.random() < 0.5
        self.change(lambda body: setattr(body.fixtures[0], "is_sensor", value))

    def filter(self) -> None:
        mask = self.rng.choice([1, 2, 0xFFFF])
        self.change(lambda body: setattr(body.fixtures[0], "mask_bits", mask))

    def step(self) -> None:
        steps = (self.rng.choice([0.005, 0.005, 0.005, 0.05]), 10, self.rng.choice([10, 10, 10, 0]))
        self.both(lambda world: world.step(*steps))

    def control(self) -> None:
        """Adds a controller of a body, which reads and changes the body in each step."""
        target = [self.rng.uniform(-1, 1) for _ in range(3)]
        if self.rng.random() < 0.5:
            self.change(lambda body: body.control_velocity().set_target(*target))
        else:
            self.change(
                lambda body: body.control_tween(target, duration=2, mode="yoyo", easing="linear")
            )

    def run_step_by_step(self) -> None:
        """Performs steps in a run, in which bodies may coast, and as single runs."""
        n = self.rng.randrange(2, 100)
        self.perform(self.worlds[0], self.time, n)
        for _ in range(n):
            self.perform(self.worlds[1], self.time, 1)
            self.time += STEP

    @staticmethod
    def perform(world: PhysicsWorld, time: int, n: int) -> None:
        continues = False
        end = time + n * STEP
        while time < end:
            run = Run(time, STEP, (end - time) // STEP, 1e-9 * STEP, 10, 10, continues)
            made, reason, *_ = world.jobs.run(*run)
            time += made * STEP
            continues = reason != RunEnd.DONE

    def run(self) -> None:
        """Performs steps in a run, in which bodies may coast, and one by one in the other world."""
        first, second = self.worlds
        n = self.rng.randrange(2, 100)
        self.perform(first, self.time, n)
        poses = {}
        for _ in range(n):
            second.step(1e-9 * STEP, 10, 10)
            self.time += STEP
            poses[self.time] = [pair[1].pose for pair in self.bodies]
        for reader, _, stamp, recorded in first.jobs.take_skipped():
            assert reader == self.reader
            assert recorded == poses[stamp]

    def check(self) -> None:
        states, events = [], []
        for world in self.worlds:
            states.append(world.body_states().tobytes())
            events.append(
                [
                    (e.kind, e.contact_id, e.fixture_a, e.fixture_b, e.normal_impulses.tobytes())
                    for e in world.take_contact_events()
                ]
            )
        assert states[0] == states[1]
        assert events[0] == events[1]

    @property
    def is_valid(self) -> bool:
        return bool(np.isfinite(self.worlds[0].body_states()).all())


@PROPERTY
@given(seed=st.integers(0, 2**32 - 1))
def test_all_states_and_contacts_are_those_of_the_solver(seed: int) -> None:
    pair = Pair(seed, two_worlds())
    changes = (pair.push, pair.force, pair.move, pair.join, pair.part, pair.sense, pair.filter)
    for _ in range(ROUNDS):
        for _ in range(pair.rng.choice([0, 0, 1, 2])):
            pair.rng.choice((*changes, pair.push, pair.force, pair.force))()
        for _ in range(pair.rng.randrange(1, 20)):
            pair.step()
            pair.check()
            if not pair.is_valid:  # The world does not advance any more.
                return


@RUNS
@given(seed=st.integers(0, 2**32 - 1))
def test_a_run_with_controllers_gives_the_states_of_single_steps(seed: int) -> None:
    pair = Pair(seed, (PhysicsWorld(), PhysicsWorld()))
    for _ in range(pair.rng.randrange(4)):
        pair.control()
    for _ in range(ROUNDS):
        for _ in range(pair.rng.choice([0, 1, 5])):
            pair.push()
        pair.run_step_by_step()
        pair.check()
        if not pair.is_valid:
            return


@RUNS
@given(seed=st.integers(0, 2**32 - 1))
def test_a_run_gives_the_states_of_single_steps_of_the_solver(seed: int) -> None:
    pair = Pair(seed, two_worlds())
    for _ in range(ROUNDS):
        for _ in range(pair.rng.choice([0, 1, 5])):
            pair.rng.choice((pair.push, pair.push, pair.push, pair.force, pair.move))()
        pair.run()
        pair.check()
        if not pair.is_valid:
            return


@pytest.mark.parametrize("direction", [(1, 0), (-1, 0), (0, 1), (0, -1)])
@pytest.mark.parametrize("distance", [0.6, 0.64, 0.68])
def test_a_moving_platform_pushes_a_body_in_every_direction(
    direction: tuple[int, int], distance: float
) -> None:
    x, y = direction
    paths = []
    for world in two_worlds():
        platform = world.create_body("kinematic", (0, 0, 0))
        platform.create_polygon([(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)], density=1)
        platform.set_velocity(x, y, 0)
        ball = world.create_body("dynamic", (distance * x, distance * y, 0))
        ball.create_circle((0, 0), 0.2, density=1)
        path = []
        for _ in range(80):
            world.step(0.005, 10, 10)
            path.append(world.body_states().tobytes())
        paths.append(path)
        assert np.hypot(*ball.pose[:2]) > distance
    assert paths[0] == paths[1]


@pytest.mark.parametrize(
    "velocity", [(0, 0.7, 0), (0.3, -1, 0), (-0.3, -0.4, 0), (0, 0, 3), (0, 0, -1)]
)
def test_a_bar_that_coasts_hits_a_ball_in_the_step_of_the_solver(
    velocity: tuple[float, float, float],
) -> None:
    states = []
    for world in two_worlds():
        bar = world.create_body("kinematic", (0, 0, 0))
        bar.create_polygon([(-1, -0.05), (1, -0.05), (1, 0.05), (-1, 0.05)], density=1)
        bar.set_velocity(*velocity)
        places = [(x, y, 0.0) for x in (-0.5, 0.5) for y in (-0.8, 0.8)]
        balls = [world.create_body("dynamic", place) for place in places]
        for ball in balls:
            ball.create_circle((0, 0), 0.2, density=1)
        if world.pre_solve is None:
            Pair.perform(world, 0, 400)
        else:
            for _ in range(400):
                world.step(1e-9 * STEP, 10, 10)
        states.append(world.body_states().tobytes())
        assert any(
            math.dist(ball.pose[:2], place[:2]) > 0.1
            for ball, place in zip(balls, places, strict=True)
        )
    assert states[0] == states[1]


LINEAR_TOLERANCE = np.float32(0.01)  # m/s
ANGULAR_TOLERANCE = np.float32(2) / np.float32(180) * np.float32(math.pi)  # rad/s


@pytest.mark.parametrize("place", [0, 2], ids=["linear", "angular"])
@pytest.mark.parametrize("is_larger", [False, True])
def test_a_body_at_the_tolerance_of_sleep_falls_asleep(place: int, is_larger: bool) -> None:
    speed = ANGULAR_TOLERANCE if place == 2 else LINEAR_TOLERANCE
    velocity = [0.0, 0.0, 0.0]
    velocity[place] = float(np.nextafter(speed, np.float32(1)) if is_larger else speed)
    awake = []
    for world in two_worlds():
        body = world.create_body("dynamic", (0, 0, 0))
        body.create_circle((0, 0), 0.2, density=1)
        body.set_velocity(*velocity)
        for _ in range(60):
            world.step(0.01, 8, 3)
        awake.append(body.awake)
    assert awake == [is_larger] * 2
