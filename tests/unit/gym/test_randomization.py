"""Domain randomization: effects of the parts, exactness, and models that do not permit a part."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from nested import assert_same

from flatland.errors import WorldError
from flatland.gym import (
    BeamDropout,
    Buildings,
    CommandLatency,
    DriveLimits,
    FixedGoal,
    FlatlandEnv,
    Friction,
    ObservationLatency,
    ObstacleSize,
    Payload,
    Randomization,
    RobotSize,
    ScanDropout,
    ScanNoise,
    make_parallel,
)

Make = Callable[..., Any]
FORWARD = np.array([1.0, 0.0], np.float32)
ALL = (
    ScanNoise((0.0, 0.05))
    + BeamDropout((0.0, 0.2))
    + ScanDropout((0.0, 0.3))
    + CommandLatency((0, 2))
    + ObservationLatency((0, 2))
    + DriveLimits((0.5, 1.0), (0.5, 1.5))
    + Friction((0.5, 1.0))
    + RobotSize((0.5, 1.0))
)
PUSHER = """
bodies:
  - name: base
    footprints: [{type: circle, radius: 0.2, density: 100, friction: 0.4}]
plugins:
  - {type: DiffDrive, name: drive, body: base, mode: force, max_force: 20, max_torque: 9}
  - {type: Laser, name: laser, body: base, range: 4, angle: {min: -1.5, max: 1.5, increment: 0.25}}
"""
BOX = "bodies: [{name: base, type: static, footprints: [{type: circle, radius: 0.3, density: 1}]}]"


@pytest.fixture
def pusher(room: Path) -> Path:
    """The room with a robot that is moved by forces, without noise, and a round obstacle."""
    (room.parent / "robot.model.yaml").write_text(PUSHER)
    (room.parent / "box.model.yaml").write_text(BOX)
    room.write_text(room.read_text() + "  - {name: box, model: box.model.yaml, pose: [4, 3, 0]}\n")
    return room


def fixed(world: Path | str, randomization: Randomization, **kwargs: Any) -> dict[str, Any]:
    """Returns arguments of an environment in which nothing else is random."""
    task = FixedGoal((1, 1, 0), (5, 1))
    return {"world": world, "task": task, "randomization": randomization, **kwargs}


def speeds(env: FlatlandEnv, seed: int, steps: int) -> list[float]:
    """Returns the forward speeds after steps at full speed."""
    env.reset(seed=seed)
    found = []
    for _ in range(steps):
        env.step(FORWARD)
        found.append(env.world.model("robot").bodies[0].velocity[0])
    return found


# -- exactness ---------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", [AutoresetMode.SAME_STEP, AutoresetMode.DISABLED])
def test_a_vector_equals_single_environments(
    equals_singles: Callable[..., Any], mode: AutoresetMode
) -> None:
    equals_singles(3, 30, mode, world="corridor", max_steps=8, randomization=ALL)


def test_an_episode_depends_on_its_seed_only(make: Make) -> None:
    def run(env: FlatlandEnv, seed: int) -> list[Any]:
        rng = np.random.default_rng(seed)
        results: list[Any] = [env.reset(seed=seed)]
        results += [env.step(rng.uniform(-1, 1, 2).astype(np.float32)) for _ in range(10)]
        return [*results, env.world.state_hash()]

    kwargs = {"world": "corridor", "randomization": ALL, "max_steps": 10}
    env = make(**kwargs)
    for seed in (3, 1, 3):
        assert_same(run(env, seed), run(make(**kwargs), seed))


def test_buildings_are_randomized(equals_singles: Callable[..., Any]) -> None:
    world = Buildings(["corridor"] * 3)
    equals_singles(2, 20, world=world, max_steps=5, randomization=ALL)


def test_robots_of_a_fleet_differ(make: Make) -> None:
    env = make(make_parallel, num_robots=3, randomization=ALL)
    env.reset(seed=4)
    robots = map(env.world.model, env.agents)
    assert len({robot.bodies[0].fixtures[0].radius for robot in robots}) == 3
    env.step(dict.fromkeys(env.agents, FORWARD))


def test_parts_of_one_object_are_independent_in_two_environments(make: Make) -> None:
    part = CommandLatency((1, 1))
    first, second = make(**fixed("corridor", part)), make(**fixed("corridor", part))
    first.reset(seed=0)
    second.reset(seed=0)
    first.step(FORWARD)
    second.step(-FORWARD)
    first.step(FORWARD)
    second.step(FORWARD)
    assert first.world.model("robot").bodies[0].velocity[0] > 0.1
    assert second.world.model("robot").bodies[0].velocity[0] == pytest.approx(0.0)


# -- sensors -----------------------------------------------------------------------------------


def scans(make: Make, room: Path, randomization: Randomization, n: int) -> np.ndarray:
    """Returns ranges of a standing robot, one row for each observation."""
    env = make(**fixed(room, randomization, max_steps=None))
    env.reset(seed=5)
    rows = [env.episodes.situation.ranges[0].copy()]
    for _ in range(n):
        env.step(np.array([-1.0, 0.0]))
        rows.append(env.episodes.situation.ranges[0].copy())
    return np.array(rows)


def test_noise_has_the_deviation(make: Make, pusher: Path) -> None:
    exact = scans(make, pusher, Randomization(), 0)[0]
    noisy = scans(make, pusher, ScanNoise((0.1, 0.1)), 200)
    is_hit = exact < 4.0
    assert 0 < is_hit.sum() < len(exact)
    errors = (noisy - exact)[:, is_hit]
    assert abs(errors.mean()) < 0.01
    assert errors.std() == pytest.approx(0.1, rel=0.1)
    np.testing.assert_array_equal(noisy[:, ~is_hit], np.tile(exact[~is_hit], (201, 1)))


def test_noise_remains_within_the_range(make: Make, pusher: Path) -> None:
    noisy = scans(make, pusher, ScanNoise((3.0, 3.0)), 20)
    hits = noisy[~np.isnan(noisy)]
    assert (hits.min(), hits.max()) == (0.0, 4.0)


def test_the_share_of_beams_is_lost(make: Make, pusher: Path) -> None:
    exact = scans(make, pusher, Randomization(), 0)[0]
    rows = scans(make, pusher, BeamDropout((0.3, 0.3)), 300)
    hits = rows[:, exact < 4.0]
    assert np.isnan(hits).mean() == pytest.approx(0.3, abs=0.03)
    assert (np.isnan(hits) | (hits == exact[exact < 4.0])).all()


def test_a_lost_scan_is_the_previous_one(make: Make, pusher: Path) -> None:
    rows = scans(make, pusher, ScanNoise((0.1, 0.1)) + ScanDropout((0.4, 0.4)), 300)
    is_same = [one.tobytes() == other.tobytes() for one, other in pairwise(rows)]
    assert np.mean(is_same) == pytest.approx(0.4, abs=0.08)


# -- latency -----------------------------------------------------------------------------------


def test_commands_take_effect_later(make: Make) -> None:
    prompt = speeds(make(**fixed("corridor", Randomization())), 0, 3)
    late = speeds(make(**fixed("corridor", CommandLatency((2, 2)))), 0, 5)
    assert late[:2] == [0.0, 0.0]
    assert late[2:] == pytest.approx(prompt, abs=1e-5)


def test_the_latency_is_drawn_for_each_episode(make: Make) -> None:
    env = make(**fixed("corridor", CommandLatency((0, 2))))
    found = {speeds(env, seed, 3).count(0.0) for seed in range(20)}
    assert found == {0, 1, 2}


def test_observations_are_those_of_an_earlier_step(make: Make) -> None:
    now = make(**fixed("corridor", Randomization()))
    late = make(**fixed("corridor", ObservationLatency((2, 2))))
    present, past = [now.reset(seed=0)[0]], [late.reset(seed=0)[0]]
    for _ in range(6):
        one, other = now.step(FORWARD), late.step(FORWARD)
        present.append(one[0])
        past.append(other[0])
        assert_same(one[1:], other[1:])
    np.testing.assert_array_equal(past, [present[0]] * 2 + present[:5])


# -- the robot and its surroundings ------------------------------------------------------------


def test_the_limits_of_the_drive_are_scaled(make: Make) -> None:
    env = make(**fixed("corridor", DriveLimits((0.5, 0.5))))
    for seed in range(2):  # and not scaled twice
        assert speeds(env, seed, 8)[-1] == pytest.approx(0.5, abs=1e-3)
    slow = make(**fixed("corridor", DriveLimits(acceleration=(0.25, 0.25))))
    assert speeds(slow, 0, 1) == pytest.approx([0.05], abs=1e-3)  # 0.25 * 2 m/s² * 0.1 s
    assert speeds(slow, 0, 21)[-1] == pytest.approx(1.0, abs=1e-3)


def test_a_payload_makes_the_robot_slower(make: Make, pusher: Path) -> None:
    light = make(**fixed(pusher, Randomization()))
    body = light.world.model("robot").bodies[0]
    mass = body.mass
    heavy = make(**fixed(pusher, Payload((mass, mass))))
    # The motors accelerate twice the mass half as much.
    assert speeds(heavy, 0, 4) == pytest.approx([v / 2 for v in speeds(light, 0, 4)], rel=1e-3)
    heavy.reset(seed=1)
    assert heavy.world.model("robot").bodies[0].mass == pytest.approx(2 * mass)


def test_friction_limits_the_acceleration(make: Make, pusher: Path) -> None:
    env = make(**fixed(pusher, Friction((0.01, 0.01))))
    assert speeds(env, 0, 1) == pytest.approx([0.01 * 9.80665 * 0.1], rel=1e-3)
    assert env.world.model("robot").bodies[0].fixtures[0].friction == pytest.approx(0.004)
    env.reset(seed=1)
    assert env.world.model("robot").bodies[0].fixtures[0].friction == pytest.approx(0.004)


def test_sizes_differ_between_episodes(make: Make, pusher: Path) -> None:
    part = RobotSize((0.5, 1.0)) + ObstacleSize(["box"], (0.5, 2.0))
    env = make(**fixed(pusher, part))
    sizes = []
    for seed in range(8):
        env.reset(seed=seed)
        models = [env.world.model(name) for name in ("robot", "box")]
        sizes.append([model.bodies[0].fixtures[0].radius for model in models])
    robot, box = np.array(sizes).T
    assert 0.1 <= robot.min() < robot.max() <= 0.2
    assert 0.15 <= box.min() < box.max() <= 0.6
    assert len(set(robot)) == len(set(box)) == 8


# -- errors ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("part", "message"),
    [
        (Payload(), 'Payload requires a drive with "mode: force"'),
        (DriveLimits((0.5, 1.0)), "DriveLimits requires a drive with limits of velocity"),
        (DriveLimits(acceleration=(1, 2)), "DriveLimits requires .* limits of acceleration"),
        (ObstacleSize(["robot"]), "ObstacleSize .* other than the robot"),
        (ObstacleSize(["ghost"]), "ghost"),
        (ScanNoise() + Friction(), "Friction requires footprints with friction"),
    ],
)
def test_a_model_that_does_not_permit_a_part_is_an_error(
    room: Path, part: Randomization, message: str
) -> None:
    path = room.parent / "robot.model.yaml"
    path.write_text(path.read_text().replace("density: 100", "density: 100, friction: 0"))
    with pytest.raises(WorldError, match=message):
        FlatlandEnv(room, randomization=part)


@pytest.mark.parametrize(
    "create",
    [
        lambda: ScanNoise((-0.1, 0.1)),
        lambda: ScanNoise((0.2, 0.1)),
        lambda: ScanNoise(0.1),
        lambda: BeamDropout((0.0, 1.1)),
        lambda: ScanDropout((np.nan, 0.1)),
        lambda: CommandLatency((2, 1)),
        lambda: ObservationLatency((0, 0.5)),
        lambda: DriveLimits(),
        lambda: DriveLimits((0.0, 1.0)),
        lambda: Payload((0.0, np.inf)),
        lambda: Friction((0.0, 1.0)),
        lambda: RobotSize((0.5, 1.5)),
        lambda: ObstacleSize(["box"], (0.0, 1.0)),
    ],
)
def test_a_number_out_of_range_is_an_error(create: Callable[[], Randomization]) -> None:
    with pytest.raises(ValueError, match=r"must be|requires factors"):
        create()


def test_other_arguments_are_errors() -> None:
    with pytest.raises(TypeError, match="randomization must be a Randomization"):
        FlatlandEnv("corridor", randomization=[ScanNoise()])
    with pytest.raises(TypeError, match="models must be several names"):
        ObstacleSize("box")


def test_an_own_part_changes_what_it_overrides(make: Make) -> None:
    class Slope(Randomization):
        """A robot that is drawn to one side."""

        def prepare(self, n: int, beams: int, size: int) -> None:
            self.turns = np.zeros(n)

        def begin(self, row: int, agent: Any, rng: np.random.Generator) -> None:
            self.turns[row] = rng.uniform(0.5, 1.0)

        def change_commands(self, commands: Any, situation: Any, rows: Any) -> None:
            commands[rows, 2] += self.turns[rows]

    env = make(**fixed("corridor", Slope() + ScanNoise()))
    env.reset(seed=0)
    env.step(np.array([-1.0, 0.0]))
    assert 0.45 <= env.world.model("robot").bodies[0].velocity[2] <= 1.0
