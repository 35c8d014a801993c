"""Prepares the world of a run: robot, models, people, start and goals."""

from __future__ import annotations

import math
import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from flatland.errors import FlatlandError
from flatland.geometry import compose, invert, transform_points
from flatland.plugins.laser import Laser
from flatland.plugins.pedestrians import Pedestrians
from flatland.scenarios.scenario import GeneratedWorld, RandomPlace
from flatland.scenarios.sensing import LaserReader
from flatland.scenarios.task import Task
from flatland.scenarios.views import view_of

if TYPE_CHECKING:
    from flatland.entities.model import Model
    from flatland.geometry import Pose, Vector2
    from flatland.plugin_api.ports import CommandTopic
    from flatland.scenarios.scenario import Robot, Run, Scenario
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
    wanted = scenario.robot
    if wanted.model and not isinstance(scenario.world, GeneratedWorld):
        world.spawn_model(wanted.model, wanted.name, pose=wanted.pose, if_blocked="allow")
    robot, laser = _find_robot(world, scenario)
    radius, bits = _footprint(robot)
    for spawn in scenario.models:
        if spawn.pose is not None:
            world.spawn_model(spawn.model, spawn.name, pose=spawn.pose, if_blocked="allow")
    people = next((plugin for plugin in world.plugins if isinstance(plugin, Pedestrians)), None)
    if scenario.people and people is None:
        raise ScenarioError(
            f"{scenario.name} adds people, but the world {world.path} has no plugin Pedestrians"
        )
    places = _Places(world, robot, radius, bits, generator(run.seed, "places"))
    start = places.start(scenario.start)
    world.move_model(robot.name, start, if_blocked="refuse")
    for entry in scenario.people:
        if people is not None:
            people.spawn(entry.group or None, entry.count, entry.poses or None)
    task = Task(
        world=view_of(world),
        robot=view_of(robot),
        radius=radius,
        category_bits=bits,
        goals=places.goals(scenario, start),
        period=period_of(world, wanted),
        max_speed=wanted.max_speed,
        max_turn=wanted.max_turn,
        rng=generator(run.seed, "controller"),
    )
    drive = world.command(drive_topic(robot, wanted))
    reader = LaserReader(world, robot, laser)
    return Stage(world, reader, drive, robot, task, start, people, world.time)


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


def _find_robot(world: World, scenario: Scenario) -> tuple[Model, Laser]:
    wanted = scenario.robot
    models = [world.model(wanted.name)] if wanted.name else world.models
    for model in models:
        for plugin in model.plugins:
            if isinstance(plugin, Laser) and wanted.laser in ("", plugin.name):
                return model, plugin
    laser = f'plugin "{wanted.laser}" of type Laser' if wanted.laser else "plugin of type Laser"
    owner = f'model "{wanted.name}"' if wanted.name else "the world"
    raise ScenarioError(f"{owner} has no {laser}")


def _footprint(robot: Model) -> tuple[float, int]:
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


class _Places:
    """Draws random starts and goals, which depend on the world and the seed only."""

    def __init__(
        self, world: World, robot: Model, radius: float, bits: int, rng: np.random.Generator
    ) -> None:
        self._world = world
        self._robot = robot
        self._radius = radius
        self._rng = rng
        self._home = robot.pose[:2]
        known = world.collision_filter
        self._layers: str | list[str] = (
            "all"
            if bits == _ALL_BITS
            else [name for name in known.names if bits >> known.layer_id(name) & 1]
        )

    def start(self, wanted: Pose | RandomPlace | None) -> Pose:
        """Returns the initial pose."""
        if wanted is None:
            return self._robot.pose
        return self._sample(wanted) if isinstance(wanted, RandomPlace) else wanted

    def goals(self, scenario: Scenario, start: Pose) -> tuple[Vector2, ...]:
        """Returns all goals."""
        goals: list[Vector2] = []
        last = start[:2]
        for wanted in scenario.goals:
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
