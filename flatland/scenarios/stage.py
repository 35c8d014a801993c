"""Prepares the world of a run: robot, models, people, start and goals."""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from flatland.config import hints
from flatland.errors import FlatlandError, WorldError
from flatland.geometry import compose, invert, transform_points
from flatland.plugins.laser import Laser
from flatland.plugins.pedestrians import Pedestrians
from flatland.scenarios.scenario import GeneratedWorld, RandomPlace
from flatland.scenarios.sensing import LaserReader
from flatland.scenarios.task import Task
from flatland.scenarios.views import view_of
from flatland.values import Twist

if TYPE_CHECKING:
    from flatland.entities.model import Model
    from flatland.geometry import Pose, Vector2
    from flatland.plugin_api.ports import CommandTopic
    from flatland.scenarios.scenario import People, Robot, Run, Scenario, Spawn
    from flatland.world import World

_MAX_TRIES: Final = 100  # of random goals
_ALL_BITS: Final = 0xFFFF


class ScenarioError(FlatlandError):
    """A scenario cannot be run in its world."""

    prefix = "Flatland scenario: "


@dataclass(frozen=True, slots=True)
class Stage:
    """The parts of a prepared run.

    Attributes:
        world: The world.
        laser: The scans of the robot.
        drive: Its velocity command.
        robot: The robot.
        task: What the controller has to do.
        start: Initial pose of the robot [m, rad].
        people: The plugin of people, None without one.
        start_time: Simulated time of the world at the start of the run [s].
    """

    world: World
    laser: LaserReader
    drive: CommandTopic[object]
    robot: Model
    task: Task
    start: Pose
    people: Pedestrians | None
    start_time: float

    @property
    def time(self) -> float:
        """Simulated time since the start of the run [s]."""
        return self.world.time - self.start_time


def prepare(world: World, run: Run) -> Stage:
    """Adds what the scenario adds to a loaded world, and places the robot at its start.

    Raises:
        FlatlandError: Something does not exist in the world, or has no place in it.
    """
    scenario = run.scenario
    add_robot(world, scenario)
    robot, laser = find_robot(world, scenario)
    for spawn in scenario.models:
        add_model(world, spawn)
    people = find_people(world)
    places = Places(world, robot, run.seed)
    start = places.start(scenario.start)
    world.move_model(robot.name, start, if_blocked="refuse")
    for entry in scenario.people:
        add_people(world, people, entry)
    return make_stage(world, run, robot, laser, start, places.goals(scenario.goals, start))


def add_robot(world: World, scenario: Scenario) -> None:
    """Adds the robot to the world if the scenario has a model file for it.

    Raises:
        FlatlandError: The model is invalid, or its name is in use.
    """
    wanted = scenario.robot
    if wanted.model and not isinstance(scenario.world, GeneratedWorld):
        world.spawn_model(wanted.model, wanted.name, pose=wanted.pose, if_blocked="allow")


def find_robot(world: World, scenario: Scenario) -> tuple[Model, Laser]:
    """Returns the robot and its laser.

    Raises:
        FlatlandError: One of them does not exist.
    """
    wanted = scenario.robot
    names = [model.name for model in world.models]
    if wanted.name and wanted.name not in names:
        raise ScenarioError(
            f'the robot "{wanted.name}" does not exist',
            hint=hints.did_you_mean(wanted.name, names, "models of the world"),
        )
    lasers: list[str] = []
    for model in world.models:
        if wanted.name not in ("", model.name):
            continue
        for plugin in model.plugins:
            if isinstance(plugin, Laser):
                if wanted.laser in ("", plugin.name):
                    return model, plugin
                lasers.append(plugin.name)
    laser = f'plugin "{wanted.laser}" of type Laser' if wanted.laser else "plugin of type Laser"
    owner = f'model "{wanted.name}"' if wanted.name else "the world"
    hint = hints.did_you_mean(wanted.laser, lasers, "plugins of type Laser") if lasers else ""
    raise ScenarioError(f"{owner} has no {laser}", hint=hint)


def add_model(world: World, spawn: Spawn) -> None:
    """Adds a model to the world that has a pose.

    Raises:
        FlatlandError: The model is invalid, or its name is in use.
    """
    if spawn.pose is not None:
        world.spawn_model(spawn.model, spawn.name, pose=spawn.pose, if_blocked="allow")


def find_people(world: World) -> Pedestrians | None:
    """Returns the plugin of people, None without one."""
    return next((plugin for plugin in world.plugins if isinstance(plugin, Pedestrians)), None)


def add_people(world: World, people: Pedestrians | None, entry: People) -> None:
    """Adds people to the world.

    Raises:
        FlatlandError: There is no plugin or group of people, or too little room.
    """
    if people is None:
        raise ScenarioError(
            f"the scenario has people, but the world {world.path} has no plugin Pedestrians"
        )
    people.spawn(entry.group or None, entry.count, entry.poses or None)


def make_stage(
    world: World,
    run: Run,
    robot: Model,
    laser: Laser,
    start: Pose,
    goals: tuple[Vector2, ...],
) -> Stage:
    """Returns the parts of a run, the robot of which is at its start.

    Raises:
        FlatlandError: The laser has no topic, or the robot no velocity command.
    """
    wanted = run.scenario.robot
    radius, bits = footprint(robot)
    task = Task(
        world=view_of(world),
        robot=view_of(robot),
        radius=radius,
        category_bits=bits,
        goals=goals,
        period=period_of(world, wanted),
        max_speed=wanted.max_speed,
        max_turn=wanted.max_turn,
        rng=generator(run.seed, "controller"),
    )
    drive, reader = find_drive(world, robot, wanted), LaserReader(world, robot, laser)
    return Stage(world, reader, drive, robot, task, start, find_people(world), world.time)


def find_drive(world: World, robot: Model, wanted: Robot) -> CommandTopic[object]:
    """Returns the velocity command of a robot.

    Raises:
        FlatlandError: The command does not exist, or is no velocity.
    """
    topic = drive_topic(robot, wanted)
    twists = [
        name
        for name, commands in world.ports.commands.items()
        if any(command.value_type is Twist for command in commands)
    ]
    hint = hints.did_you_mean(f"/{topic.removeprefix('/')}", twists, "velocities")
    try:
        drive = world.command(topic)
    except WorldError as error:
        raise ScenarioError(error.message, hint=hint) from error
    if drive.value_type is not Twist:
        raise ScenarioError(
            f'the command "{topic}" of the robot "{robot.name}" must be a velocity, it is a '
            f"{drive.value_type.__name__}",
            hint=hint,
        )
    return drive


def drive_topic(robot: Model, wanted: Robot) -> str:
    """Returns the topic of the command of a robot."""
    return "/".join(filter(None, (robot.namespace, wanted.cmd_vel)))


def period_of(world: World, wanted: Robot) -> float:
    """Returns the time between two commands [s]: a whole number of steps, at least one."""
    step_size = world.timekeeper.step_size
    period = max(1, round(wanted.period / step_size)) * step_size
    return wanted.period if math.isclose(period, wanted.period) else period


def generator(seed: int, purpose: str) -> np.random.Generator:
    """Returns the random numbers of a run for one purpose."""
    return np.random.default_rng([seed, zlib.crc32(purpose.encode())])


def footprint(robot: Model) -> tuple[float, int]:
    """Returns the radius of a robot about its origin, and the categories of its obstacles."""
    to_origin = invert(robot.pose)
    radius, bits = 0.0, 0
    for body in robot.bodies:
        pose = compose(to_origin, body.pose)
        for fixture in body.fixtures:
            if fixture.is_sensor or not fixture.mask_bits:
                continue
            bits |= fixture.category_bits
            points = np.array([fixture.center] if fixture.shape == "circle" else fixture.vertices)
            reach = np.hypot(*transform_points(pose, points).T).max() + fixture.radius
            radius = max(radius, float(reach))
    if not radius:
        raise ScenarioError(f'model "{robot.name}" has no footprint that collides')
    return radius, bits


class Places:
    """Draws random starts and goals, which depend on the world and the seed only."""

    def __init__(self, world: World, robot: Model, seed: int) -> None:
        """Begins with the place of the robot in the world.

        Raises:
            FlatlandError: The robot has no footprint.
        """
        self._world = world
        self._robot = robot
        self._radius, bits = footprint(robot)
        self._rng = generator(seed, "places")
        self._home = robot.pose[:2]
        known = world.collision_filter
        self._layers: str | list[str] = (
            "all"
            if bits == _ALL_BITS
            else [name for name in known.names if bits >> known.layer_id(name) & 1]
        )

    def start(self, wanted: Pose | RandomPlace | None) -> Pose:
        """Returns the initial pose.

        Raises:
            FlatlandError: There is no place for a random start.
        """
        if wanted is None:
            return self._robot.pose
        return self._sample(wanted) if isinstance(wanted, RandomPlace) else wanted

    def goals(
        self, wanted_goals: Iterable[Vector2 | RandomPlace], start: Pose
    ) -> tuple[Vector2, ...]:
        """Returns all goals.

        Raises:
            FlatlandError: There is no place for a random goal.
        """
        goals: list[Vector2] = []
        last = start[:2]
        for wanted in wanted_goals:
            last = self._goal(wanted, last) if isinstance(wanted, RandomPlace) else wanted
            goals.append(last)
        return tuple(goals)

    def _goal(self, wanted: RandomPlace, last: Vector2) -> Vector2:
        least, most = wanted.distance
        for _ in range(_MAX_TRIES):
            x, y, _theta = self._sample(wanted)
            if least <= math.dist(last, (x, y)) <= most:
                return (x, y)
        raise ScenarioError(
            f"found no goal at a distance from {least:g} to {most:g} m from "
            f"({last[0]:.2f}, {last[1]:.2f})"
        )

    def _sample(self, wanted: RandomPlace) -> Pose:
        area = wanted.area
        (place,) = self._world.sample_free(
            1,
            self._radius,
            wanted.clearance,
            self._rng,
            # Paths would have to stay within the area.
            connected_to=self._home if area is None else None,
            layers=self._layers,
            bounds=area,
            ignore=self._robot,
        ).tolist()
        x, y, theta = place
        return (x, y, theta)
