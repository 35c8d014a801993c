"""Actions for drives of all kinds, in single environments and in vectors."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tricycle
from gymnasium import spaces
from gymnasium.error import InvalidAction
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import parallel_api_test

from flatland.errors import WorldError
from flatland.gym import (
    Action,
    DiscreteAction,
    FixedGoal,
    FlatlandEnv,
    FlatlandVectorEnv,
    Goal,
    HolonomicAction,
    Jerkiness,
    LastAction,
    Observation,
    Scan,
    SteeringAction,
    Velocity,
    VelocityAction,
    make_parallel,
)
from flatland.gym.controllers import Gap

Make = Callable[..., Any]

DISC = "[{name: base, footprints: [{type: circle, radius: 0.2, density: 100}]}]"
LASER = (
    "{type: Laser, name: laser, body: base, range: 4, angle: {min: -1.5, max: 1.5, increment: 0.5}}"
)
OMNI = "type: OmniDrive, name: drive, body: base, linear_dynamics: {velocity_limit: 0.8}"
CAR = (
    "type: AckermannDrive, name: drive, body: base, wheelbase: 0.5, rear_axle: [0, 0], "
    "max_steer_angle: 0.6, linear_dynamics: {velocity_limit: 0.5}"
)
TRICYCLE = (
    f"{tricycle.DRIVE}, max_steer_angle: 1.0, linear_dynamics: {{velocity_limit: 0.5}}, "
    "angular_dynamics: {velocity_limit: 9}"
)
COMMANDS = [(0.0, 1.0), (1.0, 0.0), (0.5, -1.0)]


@pytest.fixture
def robot(room: Path) -> Callable[..., Path]:
    """Writes the robot of the room, with a drive."""

    def write(drive: str, bodies: str = DISC, joints: str = "[]") -> Path:
        (room.parent / "robot.model.yaml").write_text(
            f"bodies: {bodies}\njoints: {joints}\nplugins: [{{{drive}}}, {LASER}]\n"
        )
        return room

    return write


@pytest.fixture
def world(robot: Callable[..., Path]) -> Callable[[str], Path]:
    """Writes the robot of the room, with the drive of a name."""

    def write(name: str) -> Path:
        if name == "tricycle":
            return robot(TRICYCLE, tricycle.BODIES.replace("2d", "walls"), f"\n{tricycle.JOINTS}")
        return robot({"omni": OMNI, "car": f"{CAR}, command: steering"}[name])

    return write


def arguments(path: Path, action: Action, **kwargs: Any) -> dict[str, Any]:
    return {"world": path, "action": action, "task": FixedGoal((3, 2, 0), (5, 3)), **kwargs}


def velocity(env: FlatlandEnv, action: Any, steps: int = 5) -> tuple[float, float, float]:
    """Returns the velocity in the frame of the robot after some steps."""
    env.reset(seed=0)
    for _ in range(steps):
        env.step(action)
    body = env.world.model("robot").bodies[0]
    (vx, vy, omega), theta = body.velocity, body.pose[2]
    c, s = math.cos(theta), math.sin(theta)
    return (c * vx + s * vy, c * vy - s * vx, omega)


def test_a_holonomic_robot_moves_sideways(make: Make, world: Callable[[str], Path]) -> None:
    observation = Observation(Velocity(sideways=True), LastAction(3))
    action = HolonomicAction(yaw_rate=1.0)
    env = make(**arguments(world("omni"), action, observation=observation))
    assert env.action_space == spaces.Box(-1, 1, (3,), np.float32)
    assert velocity(env, np.array([0.0, 1.0, 0.0])) == pytest.approx((0, 0.8, 0), abs=1e-4)
    # The heading changes by 2.5 mrad in a step of the world.
    numbers = np.array([-0.5, 0.25, 0.5])
    assert velocity(env, numbers) == pytest.approx((-0.4, 0.2, 0.5), abs=2e-3)
    assert env.step(numbers)[0] == pytest.approx([*numbers, *numbers], abs=5e-3)


@pytest.mark.parametrize(("name", "length"), [("car", 0.5), ("tricycle", tricycle.WHEELBASE)])
def test_a_steered_robot_follows_the_angle(
    make: Make, world: Callable[[str], Path], name: str, length: float
) -> None:
    env = make(**arguments(world(name), SteeringAction((-0.2, 0.4), 0.3)))
    assert env.action_space == spaces.Box(-1, 1, (2,), np.float32)
    drive = env.world.model("robot").plugins[0]
    _, _, omega = velocity(env, np.array([1.0, 1.0]), 8)
    assert drive.steering_angle == pytest.approx(0.3)
    slope = math.tan(0.3) if name == "car" else math.sin(0.3)
    assert omega == pytest.approx(0.4 * slope / length, rel=1e-3)
    # The yaw rate at the greatest speed and angle is observed as 1.
    observed = env.episodes.layout
    part, columns = observed.find(Velocity)
    numbers = observed.select(env.step(np.array([1.0, 1.0]))[0], part, columns)
    assert numbers[1] == pytest.approx(1.0, abs=1e-3)


def test_the_limits_are_those_of_the_drive(make: Make, world: Callable[[str], Path]) -> None:
    for name, action, high in (
        ("omni", HolonomicAction(), [0.8, 0.8, 2.0]),
        ("omni", VelocityAction(), [0.8, 2.0]),
        ("car", SteeringAction(), [0.5, 0.6]),
        ("tricycle", SteeringAction(), [0.5, 1.0]),
    ):
        env = make(**arguments(world(name), action))
        assert env.episodes.situation.high.tolist() == pytest.approx(high)


def test_a_car_that_takes_yaw_rates_has_velocity_actions(
    make: Make, robot: Callable[..., Path]
) -> None:
    env = make(**arguments(robot(f"{CAR}, command: twist"), VelocityAction(yaw_rate=0.4)))
    assert velocity(env, np.array([1.0, 0.5]), 8) == pytest.approx((0.5, 0, 0.2), abs=1e-3)


def test_an_index_stands_for_a_command(make: Make) -> None:
    env = make(world="corridor", action=DiscreteAction(COMMANDS))
    assert env.action_space == spaces.Discrete(3)
    command = env.world.command("/cmd_vel")
    for index, (v, omega) in enumerate(COMMANDS):
        env.reset(seed=0)
        for action in (index, np.int64(index), np.array(index, np.uint8)):
            env.step(action)
            assert (command.value.linear_x, command.value.angular_z) == (v, omega)


def test_commands_of_other_kinds_are_discrete(make: Make, world: Callable[[str], Path]) -> None:
    action = DiscreteAction([(0, 0.5, 0), (0, -0.5, 0)], HolonomicAction())
    env = make(**arguments(world("omni"), action))
    assert velocity(env, 1) == pytest.approx((0, -0.5, 0), abs=1e-4)
    action = DiscreteAction([(0.5, 0.6), (0.5, -0.6)], SteeringAction())
    env = make(**arguments(world("car"), action))
    assert velocity(env, 0, 8)[2] == pytest.approx(0.5 * math.tan(0.6) / 0.5, rel=1e-3)


@pytest.mark.parametrize(
    ("name", "action"),
    [
        ("omni", HolonomicAction()),
        ("omni", DiscreteAction([(0.5, 0.5, 0.0), (-0.5, 0.0, 1.0)], HolonomicAction())),
        ("car", SteeringAction()),
        ("tricycle", SteeringAction()),
    ],
)
def test_a_vector_equals_single_environments(
    equals_singles: Callable[..., Any],
    world: Callable[[str], Path],
    name: str,
    action: Action,
) -> None:
    numbers = len(action.columns)
    envs, _ = equals_singles(
        3,
        30,
        world=world(name),
        action=action,
        observation=Observation(Scan(), Goal(), LastAction(numbers), Velocity(numbers == 3)),
        reward=-1.0 * Jerkiness(),
        max_steps=12,
        task=FixedGoal((3, 2, 0), (5, 3)),
    )
    assert envs._episodes._batch is not None


def test_checkers_find_nothing(make: Make, world: Callable[[str], Path]) -> None:
    for action in (HolonomicAction(), DiscreteAction([(0.2, 0.0), (0.0, 1.0)])):
        check_env(make(**arguments(world("omni"), action)), skip_render_check=True)
    parallel_api_test(make(make_parallel, num_robots=3, action=DiscreteAction(COMMANDS)), 30)


def test_robots_of_a_fleet_take_indices(make: Make) -> None:
    env = make(make_parallel, num_robots=2, action=DiscreteAction(COMMANDS))
    env.reset(seed=0)
    assert env.action_space("robot_0") == spaces.Discrete(3)
    env.step({"robot_0": 0, "robot_1": np.int64(1)})
    commands = [env.world.command(f"/{name}/cmd_vel").value for name in env.possible_agents]
    assert [(each.linear_x, each.angular_z) for each in commands] == COMMANDS[:2]


# -- errors ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "action", "message"),
    [
        ("car", VelocityAction(), "takes steering angles: use SteeringAction"),
        ("tricycle", VelocityAction(), "takes steering angles"),
        ("car", HolonomicAction(), "HolonomicAction requires an OmniDrive.* AckermannDrive"),
        ("omni", SteeringAction(), 'SteeringAction requires .* "command: steering"'),
        ("omni", DiscreteAction(COMMANDS), r"\[1.0, 0.0\] of action 1 is not between"),
        ("omni", DiscreteAction([(-0.1, 0)]), r"action 0 .* bounds of VelocityAction"),
    ],
)
def test_a_drive_that_does_not_take_the_commands_is_an_error(
    world: Callable[[str], Path], name: str, action: Action, message: str
) -> None:
    with pytest.raises(WorldError, match=message):
        FlatlandEnv(world(name), action=action)


def test_an_invalid_index_is_an_error(make: Make) -> None:
    env = make(world="corridor", action=DiscreteAction(COMMANDS))
    envs = make(FlatlandVectorEnv, 2, "corridor", action=DiscreteAction(COMMANDS))
    env.reset(seed=0)
    envs.reset(seed=0)
    for action, message in (
        (3, "from 0 to 2, got 3"),
        (-1, "from 0 to 2, got -1"),
        (1.0, "must be integers"),
        (True, "must be integers"),
        ("1", "must be integers"),
        (None, "must be integers"),
        (np.array([1]), r"shape \(\), got \(1,\)"),
    ):
        with pytest.raises(InvalidAction, match=message):
            env.step(action)
        with pytest.raises(InvalidAction, match=r"integers|shape \(2,\)"):
            envs.step(np.array([action, action], object) if action is None else [action, action])


@pytest.mark.parametrize(
    "create",
    [
        lambda: DiscreteAction([]),
        lambda: DiscreteAction([1.0, 2.0]),
        lambda: DiscreteAction([(1.0, 2.0, 3.0)]),
        lambda: DiscreteAction([(1.0, math.nan)]),
        lambda: DiscreteAction([(1.0, 2.0), (1.0,)]),
        lambda: DiscreteAction("fast"),
        lambda: HolonomicAction(speed=0.0),
        lambda: HolonomicAction(yaw_rate=-1.0),
        lambda: SteeringAction((1.0, 0.5)),
        lambda: SteeringAction(angle=math.nan),
        lambda: LastAction(4),
    ],
)
def test_an_invalid_argument_is_an_error(create: Callable[[], object]) -> None:
    with pytest.raises(ValueError, match="must be"):
        create()


def test_parts_that_do_not_fit_together_are_errors(make: Make) -> None:
    with pytest.raises(TypeError, match="kind must be a continuous action"):
        DiscreteAction([(1.0, 0.0)], DiscreteAction([(1.0, 0.0)]))
    with pytest.raises(ValueError, match="LastAction"):
        FlatlandEnv("corridor", observation=Observation(LastAction(3)))
    with pytest.raises(ValueError, match="VelocityAction"):
        Gap(make(world="corridor", action=DiscreteAction(COMMANDS)))
