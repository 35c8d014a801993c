"""A single environment: episodes, seeds, actions, errors."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import InvalidAction, ResetNeeded
from gymnasium.utils.env_checker import check_env

import flatland
from flatland.gym import (
    Arrived,
    FixedGoal,
    FlatlandEnv,
    Observation,
    RandomBuildings,
    RandomGoal,
    Scan,
    Step,
    VelocityAction,
)
from flatland.gym.registration import SINGLE

Make = Callable[..., Any]

AHEAD = np.array([1.0, 0.0], np.float32)


def test_the_checker_of_gymnasium_finds_nothing() -> None:
    env = gymnasium.make("flatland/Corridor-v0")
    check_env(env.unwrapped)
    env.close()


@pytest.mark.parametrize("name", SINGLE)
def test_registered_worlds_have_starts_and_goals(make: Make, name: str) -> None:
    world = SINGLE[name]["world"]
    if isinstance(world, RandomBuildings):
        world = RandomBuildings(world.kind, 1)
    env = make(world=world)
    env.reset(seed=0)
    env.step(AHEAD)


def test_noise_depends_on_the_seed_of_the_episode(make: Make, room: Path) -> None:
    env = make(world=room, observation=Observation(Scan()))
    start = {"start": (3, 2, 0), "goal": (5, 2)}
    first, _ = env.reset(seed=1, options=start)
    again, _ = env.reset(seed=1, options=start)
    other, _ = env.reset(seed=2, options=start)
    following, _ = env.reset(options=start)
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()
    assert (following != other).any()
    assert abs(first - other).max() < 0.05


def test_other_models_return_to_their_places(make: Make, room: Path) -> None:
    (room.parent / "box.model.yaml").write_text(
        "bodies:\n  - name: box\n    linear_damping: 2\n    angular_damping: 2\n"
        "    footprints: [{type: circle, radius: 0.2, density: 5}]\n"
    )
    text = room.read_text() + "  - {name: box, model: box.model.yaml, pose: [2, 1, 0]}\n"
    room.write_text(text)
    env = make(world=room, ending=Arrived(), task=FixedGoal((1, 1, 0), (5, 3)))
    env.reset(seed=0)
    for _ in range(20):
        env.step(AHEAD)
    assert env.world.model("box").pose[0] > 2.3
    env.reset()
    assert env.world.model("box").pose == (2.0, 1.0, 0.0)
    assert env.world.time == 0.0


@pytest.mark.parametrize(
    ("limits", "action", "velocities"),
    [
        # One action is beyond the bounds.
        (
            "",
            VelocityAction(speed=(-0.5, 1.0), yaw_rate=0.8),
            {(1.0, 0.5): (1.0, 0.4), (-7.0, -1.0): (-0.5, -0.8)},
        ),
        # The highest velocity is the limit of the drive.
        (
            ", linear_dynamics: {velocity_limit: 0.7}, angular_dynamics: {velocity_limit: 1.3}",
            VelocityAction(),
            {(1.0, 1.0): (0.7, 1.3), (-1.0, -1.0): (0.0, -1.3)},
        ),
    ],
)
def test_an_action_is_a_scaled_velocity(
    make: Make,
    room: Path,
    limits: str,
    action: VelocityAction,
    velocities: dict[tuple[float, float], tuple[float, float]],
) -> None:
    path = room.parent / "robot.model.yaml"
    path.write_text(path.read_text().replace("body: base}", f"body: base{limits}}}", 1))
    env = make(world=room, action=action, task=FixedGoal((3, 2, 0), (5, 3)))
    env.reset(seed=0)
    for numbers, velocity in velocities.items():
        env.step(np.array(numbers, np.float32))
        command = env.world.command("/cmd_vel").value
        assert (command.linear_x, command.angular_z) == pytest.approx(velocity)
        _, _, omega = env.world.model("robot").bodies[0].velocity
        assert omega == pytest.approx(velocity[1])


def test_a_step_lasts_as_many_physics_steps_as_configured(make: Make) -> None:
    env = make(world="corridor", physics_steps=7, step_size=0.01)
    env.reset(seed=0)
    env.step(AHEAD)
    assert env.world.time == pytest.approx(0.07)
    assert env.metadata["render_fps"] == 14


@pytest.mark.parametrize(
    ("start", "goal", "sign"),
    [((1, 1.9, 0), (2.5, 1.9), 1), ((1, 1.25, math.pi), (8, 1.25), -1)],
    ids=["goal", "wall"],
)
def test_an_episode_ends_at_a_goal_or_a_wall_ahead(
    make: Make, start: Any, goal: Any, sign: int
) -> None:
    env = make(world="corridor", task=FixedGoal(start, goal))
    _, info = env.reset(seed=0)
    distance = pytest.approx(goal[0] - start[0])
    assert info == {"distance": distance, "is_success": False, "collision": False}
    for _ in range(30):
        _, reward, terminated, truncated, info = env.step(AHEAD)
        if terminated:
            break
    assert (terminated, truncated) == (True, False)
    assert (info["is_success"], info["collision"]) == (sign > 0, sign < 0)
    assert (info["distance"] <= 0.3) == (sign > 0)
    assert sign * reward > 4.9


def test_a_brief_contact_within_a_step_counts(make: Make, room: Path) -> None:
    # It bumps into a box, which bounces off before the end of the step.
    (room.parent / "box.model.yaml").write_text(
        "bodies:\n  - name: box\n    footprints:\n"
        "      - {type: circle, radius: 0.1, density: 1, restitution: 1}\n"
    )
    text = room.read_text() + "  - {name: box, model: box.model.yaml, pose: [1.5, 2, 0]}\n"
    room.write_text(text)
    env = make(
        world=room,
        physics_steps=40,
        action=VelocityAction(speed=(0.0, 3.0)),
        task=FixedGoal((1, 2, 0), (5, 3)),
    )
    env.reset(seed=0)
    _, _, terminated, _, info = env.step(AHEAD)
    assert env.world.contacts == []
    assert info["collision"]
    assert terminated


def test_reward_and_ending_are_replaceable(make: Make) -> None:
    env = make(world="corridor", reward=2.0 * Step(), ending=Arrived(), max_steps=3)
    env.reset(seed=0)
    assert [env.step(AHEAD)[1] for _ in range(3)] == [2.0, 2.0, 2.0]


# -- errors ------------------------------------------------------------------------------------


def test_stepping_needs_a_reset(make: Make) -> None:
    env = make(world="corridor", max_steps=1)
    with pytest.raises(ResetNeeded, match="reset"):
        env.step(AHEAD)
    env.reset(seed=0)
    env.step(AHEAD)
    with pytest.raises(ResetNeeded, match="has ended"):
        env.step(AHEAD)


def test_an_invalid_action_changes_nothing(make: Make) -> None:
    env = make(world="corridor")
    env.reset(seed=0)
    before = env.world.state_hash()
    for action, message in (
        ([math.nan, 0.0], "NaN"),
        ([0.0], r"shape \(2,\), got \(1,\)"),
        (0.5, r"shape \(2,\), got \(\)"),
        ([[0.0, 0.0]], r"shape \(2,\), got \(1, 2\)"),
        (["fast", "left"], "must be numbers"),
        (["0.5", "0.5"], "must be numbers"),
        ([0.5 + 1j, 0.0], "must be numbers"),
        ([[0.0], [0.0, 0.0]], "must be numbers"),
        (None, "must have the shape|must be numbers"),
    ):
        with pytest.raises(InvalidAction, match=message):
            env.step(action)
        assert env.world.state_hash() == before
    env.step(AHEAD)


def test_an_unknown_world_is_an_error() -> None:
    with pytest.raises(flatland.WorldError, match=r'"atlantis".*corridor, crowd, fleet, navigate'):
        FlatlandEnv(world="atlantis")
    with pytest.raises(flatland.WorldError, match=r'"no/such\.yaml" does not exist'):
        FlatlandEnv(world="no/such.yaml")


@pytest.mark.parametrize(
    ("model", "message"),
    [
        (lambda text: text[: text.index("  - type: Laser")], "no plugin of type Laser"),
        (
            lambda text: text.replace("  - {type: DiffDrive, name: drive, body: base}\n", ""),
            "no velocity command",
        ),
        (
            lambda text: text.replace("density: 100", "density: 100, sensor: true"),
            "no solid footprint",
        ),
    ],
)
def test_a_model_that_is_no_agent_is_an_error(
    room: Path, model: Callable[[str], str], message: str
) -> None:
    path = room.parent / "robot.model.yaml"
    path.write_text(model(path.read_text()))
    with pytest.raises(flatland.WorldError, match=f'model "robot" has {message}'):
        FlatlandEnv(world=room)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"agent": "nobody"}, flatland.WorldError, "nobody"),
        ({"laser": "nothing"}, flatland.WorldError, 'no Laser "nothing"; its lasers: laser'),
        ({"command": "/nothing"}, flatland.WorldError, "no velocity command /nothing.*/cmd_vel"),
        ({"render_mode": "hologram"}, ValueError, "rgb_array, human"),
        ({"max_steps": 0}, ValueError, "max_steps"),
        ({"physics_steps": 2.5}, ValueError, "physics_steps"),
        ({"step_size": 0.0}, ValueError, "step_size"),
        ({"reward": 1.0}, TypeError, "reward must be a Reward"),
        ({"colour": "red"}, TypeError, "unknown argument 'colour'"),
        ({"observation": Observation(Scan(7))}, ValueError, "180 beams"),
    ],
)
def test_an_invalid_argument_is_an_error(
    arguments: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        FlatlandEnv(world="corridor", **arguments)


def test_a_task_without_places_is_an_error(make: Make) -> None:
    env = make(world="corridor", task=RandomGoal(distance=(50.0, 60.0)))
    with pytest.raises(flatland.WorldError, match="no free place from 50 to 60 m"):
        env.reset(seed=0)


def test_a_place_that_is_taken_is_refused(make: Make) -> None:
    env = make(world="corridor")
    for options, error, message in (
        ({"begin": (1, 1, 0)}, ValueError, "goal, start, got begin"),
        ({"start": (1, 1)}, ValueError, "three numbers"),
        ({"start": (3.3, 0.5, 0)}, flatland.WorldError, "start .* cannot be reached: no path"),
        ({"goal": (60, 0)}, flatland.WorldError, r"goal .* outside of the walls, .*\(10, 2.5\)"),
        ({"start": (3.0, 0.9, 0)}, flatland.WorldError, "start .* is not free"),
        ({"goal": (0.1, 0.1)}, flatland.WorldError, "goal .* is not free"),
        ({"goal": (math.nan, 0.1)}, ValueError, "finite"),
    ):
        with pytest.raises(error, match=message):
            env.reset(seed=0, options=options)
        with pytest.raises(ResetNeeded):
            env.step(AHEAD)
        env.reset(seed=0)
        env.step(AHEAD)
