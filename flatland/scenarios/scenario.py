"""What a scenario consists of, as values that can be sent to other processes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Literal

from flatland.foreign_texts import clean_name
from flatland.geometry import Bounds, Pose, Vector2
from flatland.scenarios.conditions import Condition

Fault = Literal["blind", "frozen"]
FAULTS: Final[tuple[Fault, ...]] = ("blind", "frozen")
"""How a laser fails: no beam hits anything, or the last scan is repeated."""


@dataclass(frozen=True, slots=True)
class GeneratedWorld:
    """A random world of `flatland.worldgen`.

    Attributes:
        kind: `office`, `maze` or `warehouse`.
        seed: Seed of the floor plan; None for the seed of the run.
        size: Width and height [m].
        radius: Radius of the largest robot that reaches each free place [m].
    """

    kind: str
    seed: int | None
    size: Vector2
    radius: float


@dataclass(frozen=True, slots=True)
class Robot:
    """The model that a controller drives.

    Attributes:
        name: Name of the model; empty for the first one with a laser.
        model: Model file that is spawned; empty if the world contains the robot.
        pose: Pose at which the model file is spawned [m, rad].
        laser: Name of its laser; empty for the first one.
        cmd_vel: Topic of its velocity command, in the namespace of the model.
        period: Time between two commands [s].
        max_speed: Limit of the commanded speed [m/s].
        max_turn: Limit of the commanded yaw rate [rad/s].
    """

    name: str = ""
    model: str = ""
    pose: Pose = (0.0, 0.0, 0.0)
    laser: str = ""
    cmd_vel: str = "cmd_vel"
    period: float = 0.1
    max_speed: float = 0.8
    max_turn: float = 1.5


@dataclass(frozen=True, slots=True)
class RandomPlace:
    """A place that is drawn with the seed of the run.

    Attributes:
        distance: Least and largest straight distance from the place before, that is the start or
            the previous goal [m]; not used for starts.
        clearance: Least distance of the robot to obstacles [m].
        area: Area that contains the place [m]; None for any place that the robot can reach.
    """

    distance: tuple[float, float] = (2.0, float("inf"))
    clearance: float = 0.1
    area: Bounds | None = None


@dataclass(frozen=True, slots=True)
class Spawn:
    """A model that is added to the world.

    Attributes:
        name: Name of the model.
        model: Absolute path of the model file.
        pose: Pose in the world frame [m, rad]; None for a place ahead of the robot.
        ahead: Distance from the robot to the model, along the heading of the robot [m].
    """

    name: str
    model: str
    pose: Pose | None
    ahead: float = 0.0


@dataclass(frozen=True, slots=True)
class People:
    """People who are added to a group of the plugin `Pedestrians`.

    Attributes:
        group: Name of the group; empty for the first one.
        count: Number of people at random free places.
        poses: Poses of the people instead [m, rad].
    """

    group: str
    count: int
    poses: tuple[Pose, ...] = ()


@dataclass(frozen=True, slots=True)
class Trigger:
    """When an event takes place: one of the attributes is set.

    Attributes:
        time: Simulated time [s].
        place: The robot is within `radius` of this place [m].
        radius: See `place` [m].
        goals: Number of goals that were reached.
    """

    time: float | None = None
    place: Vector2 | None = None
    radius: float = 1.0
    goals: int | None = None


@dataclass(frozen=True, slots=True)
class Event:
    """A change during a run, which takes place once.

    Attributes:
        trigger: When it takes place.
        action: `spawn`, `delete`, `move`, `kidnap`, `command`, `fail` or `people`.
        values: Arguments of the action, see `flatland.scenarios.events`.
        text: File and line, for error messages.
    """

    trigger: Trigger
    action: str
    values: Mapping[str, Any]
    text: str


@dataclass(frozen=True, slots=True)
class Limits:
    """What ends a run before its last goal is reached.

    Attributes:
        time: Simulated time [s].
        collisions: Number of collisions after which the next one ends the run; None for any.
        stuck: Time for which the robot makes no progress [s]; None for any.
    """

    time: float = 60.0
    collisions: int | None = 0
    stuck: float | None = None


@dataclass(frozen=True, slots=True)
class Scenario:
    """A scenario with the values of its matrix, to be run with any controller and seed.

    Attributes:
        name: Name without the values of the matrix, such as `office/tour`.
        description: What it tests.
        file: Path of the scenario file.
        world: Absolute path of the world file, or the random world.
        robot: The robot.
        start: Initial pose, None for that in the world, or a random place.
        goals: Places (x, y) to be reached one after the other, or random places.
        tolerance: Distance at which a goal is reached [m].
        models: Models that are added before the start.
        people: People that are added before the start.
        events: What happens during a run.
        limits: What ends a run.
        require: What must hold at the end.
        params: Values of `param()` in YAML files.
        variant: Values of the matrix by name, as text.
        seeds: Seeds of its runs.
    """

    name: str
    description: str
    file: str
    world: str | GeneratedWorld
    robot: Robot
    start: Pose | RandomPlace | None
    goals: tuple[Vector2 | RandomPlace, ...]
    tolerance: float
    models: tuple[Spawn, ...]
    people: tuple[People, ...]
    events: tuple[Event, ...]
    limits: Limits
    require: tuple[Condition, ...]
    params: Mapping[str, object] = field(default_factory=dict)
    variant: Mapping[str, str] = field(default_factory=dict)
    seeds: tuple[int, ...] = (0,)

    @property
    def title(self) -> str:
        """Name with the values of the matrix, such as `office/tour[speed=0.5]`."""
        values = ",".join(f"{name.lstrip('.')}={text}" for name, text in self.variant.items())
        return clean_name(f"{self.name}[{values}]" if values else self.name)


@dataclass(frozen=True, slots=True)
class Run:
    """One run of a scenario.

    Attributes:
        scenario: The scenario.
        controller: Name of an included controller, `FILE.py:NAME` or `MODULE:NAME`.
        seed: Seed of the world, of random places and of the controller.
    """

    scenario: Scenario
    controller: str
    seed: int

    @property
    def key(self) -> tuple[str, str, int]:
        """What identifies the run: title of the scenario, controller and seed."""
        return (self.scenario.title, clean_name(self.controller), self.seed)

    @property
    def title(self) -> str:
        """The key as a text."""
        scenario, controller, seed = self.key
        return f"{scenario} {controller} seed {seed}"
