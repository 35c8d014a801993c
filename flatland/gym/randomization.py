"""Domain randomization: what differs between episodes besides starts, goals and buildings."""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from flatland.checks import check_kind, checked_count, checked_names, plain_numbers, shown
from flatland.errors import WorldError
from flatland.geometry import BoolArray, DoubleArray, FloatArray
from flatland.plugin_api.body_drive import BodyDrive
from flatland.plugin_api.dynamics_limits import DynamicsLimits

if TYPE_CHECKING:
    from flatland.gym.agents import Agent
    from flatland.gym.situation import Rows, Situation
    from flatland.world import World

Interval = tuple[float, float]
_MAX_DELAY: Final = 1_000_000  # steps of the environment


class Randomization:
    """A part of the domain randomization; `+` combines parts. This class changes nothing.

    A part overrides what it needs. It draws its numbers at the start of an episode, from the
    generator that it is given: the numbers of an agent must depend on nothing else. It may change
    the world then, which is in the state after loading at each start. Parts are copied for each
    environment, and called in the order of the sum.
    """

    def check(self, agent: Agent) -> None:
        """Checks that the part applies to a model.

        Raises:
            WorldError: It does not; the text states what is missing.
        """

    def prepare(self, n: int, beams: int, size: int) -> None:
        """Prepares the memory of a copy of the part.

        Args:
            n: Number of agents.
            beams: Number of beams of a laser.
            size: Number of values of an observation.
        """

    def change_world(self, world: World, rng: np.random.Generator) -> None:
        """Changes a world at the start of an episode, before agents are placed."""

    def begin(self, row: int, agent: Agent, rng: np.random.Generator) -> None:
        """Draws the numbers of an agent, whose episode begins.

        Args:
            row: Index of the agent.
            agent: The agent, which has not been placed yet.
            rng: Source of the random numbers.
        """

    def change_commands(self, commands: DoubleArray, situation: Situation, rows: Rows) -> None:
        """Changes commands before they are carried out.

        Args:
            commands: Commands of all agents as the drive takes them, shape (n, 3): forward and
                sideways velocity and yaw rate, or speed, 0 and steering angle [m/s, rad/s, rad].
            situation: The state of all agents before the step; `steps` counts the step.
            rows: The agents that act.
        """

    def change_scans(self, situation: Situation, rows: Rows) -> None:
        """Changes `situation.ranges`, from which observations and rewards are computed.

        Called once for each agent after a reset (`situation.steps` is 0) and after each step.

        Args:
            situation: The state of all agents.
            rows: The agents that were scanned.
        """

    def change_observations(
        self, observations: FloatArray, situation: Situation, rows: Rows
    ) -> FloatArray:
        """Returns what is observed; called once for each agent, as `change_scans`.

        Args:
            observations: Observations of all agents, shape (n, size), which must not be changed.
            situation: The state of all agents.
            rows: The agents whose observations are new.
        """
        del situation, rows
        return observations

    def __add__(self, other: Randomization) -> Randomization:
        """Returns the combination of two parts."""
        return RandomizationSum(self, other)


class RandomizationSum(Randomization):
    """Several parts."""

    def __init__(self, *parts: Randomization) -> None:
        """Combines parts; nested sums are merged."""
        self.parts: tuple[Randomization, ...] = ()
        for part in parts:
            check_kind("each part", part, Randomization, "a Randomization")
            self.parts += part.parts if isinstance(part, RandomizationSum) else (part,)

    def check(self, agent: Agent) -> None:
        """Checks all parts."""
        for part in self.parts:
            part.check(agent)

    def prepare(self, n: int, beams: int, size: int) -> None:
        """Copies and prepares all parts."""
        self.parts = tuple(map(copy.copy, self.parts))
        for part in self.parts:
            part.prepare(n, beams, size)

    def change_world(self, world: World, rng: np.random.Generator) -> None:
        """Calls `change_world` of all parts."""
        for part in self.parts:
            part.change_world(world, rng)

    def begin(self, row: int, agent: Agent, rng: np.random.Generator) -> None:
        """Draws the numbers of all parts."""
        for part in self.parts:
            part.begin(row, agent, rng)

    def change_commands(self, commands: DoubleArray, situation: Situation, rows: Rows) -> None:
        """Calls `change_commands` of all parts."""
        for part in self.parts:
            part.change_commands(commands, situation, rows)

    def change_scans(self, situation: Situation, rows: Rows) -> None:
        """Calls `change_scans` of all parts."""
        for part in self.parts:
            part.change_scans(situation, rows)

    def change_observations(
        self, observations: FloatArray, situation: Situation, rows: Rows
    ) -> FloatArray:
        """Returns the observations after the changes of all parts."""
        for part in self.parts:
            observations = part.change_observations(observations, situation, rows)
        return observations


# -- sensors -----------------------------------------------------------------------------------


class _ScanPart(Randomization):
    """Changes scans with random numbers of its own for each agent.

    Attributes:
        interval: Least and greatest strength, one of which is drawn for each episode.
    """

    def __init__(self, name: str, interval: Interval, limit: float) -> None:
        self.interval = _checked_interval(name, interval, 0.0, limit)

    def prepare(self, n: int, beams: int, size: int) -> None:
        """Prepares a generator for each agent."""
        del beams, size
        self._strengths = np.zeros(n)
        self._generators = [np.random.default_rng(0)] * n  # replaced by `begin`

    def begin(self, row: int, agent: Agent, rng: np.random.Generator) -> None:
        """Draws the strength, and the seed of the numbers of the episode."""
        del agent
        self._strengths[row] = rng.uniform(*self.interval)
        self._generators[row] = np.random.default_rng(int(rng.integers(2**63)))


class ScanNoise(_ScanPart):
    """Normal noise of all ranges, in addition to that of the laser; not of beams without a hit.

    Ranges remain from 0 to the range of the laser.
    """

    def __init__(self, deviation: Interval = (0.0, 0.03)) -> None:
        """Creates the part.

        Args:
            deviation: Least and greatest standard deviation [m].

        Raises:
            ValueError: A number is out of range.
        """
        super().__init__("deviation", deviation, math.inf)

    def change_scans(self, situation: Situation, rows: Rows) -> None:
        """Adds the noise."""
        for row in rows.tolist():
            ranges = situation.ranges[row]
            noise = self._generators[row].standard_normal(len(ranges), np.float32)
            noise *= np.float32(self._strengths[row])
            is_hit = ranges < situation.max_range
            ranges[is_hit] = np.clip(ranges[is_hit] + noise[is_hit], 0.0, situation.max_range)


class _Dropout(_ScanPart):
    """Loses a share of the measurements."""

    def __init__(self, share: Interval = (0.0, 0.05)) -> None:
        """Creates the part.

        Args:
            share: Least and greatest share that is lost, from 0 to 1.

        Raises:
            ValueError: A number is out of range.
        """
        super().__init__("share", share, 1.0)


class BeamDropout(_Dropout):
    """Beams that return nothing, each by chance: their ranges are those without a hit."""

    def change_scans(self, situation: Situation, rows: Rows) -> None:
        """Removes hits."""
        for row in rows.tolist():
            ranges = situation.ranges[row]
            ranges[self._generators[row].random(len(ranges)) < self._strengths[row]] = np.nan


class ScanDropout(_Dropout):
    """Scans that are lost, each by chance: the previous one remains. The first one is not lost."""

    def prepare(self, n: int, beams: int, size: int) -> None:
        """Prepares the memory of the previous scans."""
        super().prepare(n, beams, size)
        self._previous: FloatArray = np.zeros((n, beams), np.float32)

    def change_scans(self, situation: Situation, rows: Rows) -> None:
        """Replaces the scans that are lost by the previous ones."""
        numbers = np.array([self._generators[row].random() for row in rows.tolist()])
        is_lost: BoolArray = (numbers < self._strengths[rows]) & (situation.steps[rows] > 0)
        lost, others = rows[is_lost], rows[~is_lost]
        situation.ranges[lost] = self._previous[lost]
        self._previous[others] = situation.ranges[others]


# -- latency -----------------------------------------------------------------------------------


class _Latency(Randomization):
    """A delay by steps of the environment, which is drawn for each episode.

    Attributes:
        steps: Least and greatest delay [steps].
    """

    def __init__(self, steps: tuple[int, int] = (0, 1)) -> None:
        """Creates the part.

        Args:
            steps: Least and greatest delay [steps of the environment].

        Raises:
            ValueError: The delays are not two increasing integers of at least 0.
        """
        low, high = _pair("steps", steps)
        low, high = (checked_count("steps", each, 0, _MAX_DELAY) for each in (low, high))
        if low > high:
            raise ValueError(f"steps must be the least and the greatest delay, got {steps}")
        self.steps = (low, high)

    def _allocate(self, n: int, size: int) -> None:
        self._delays = np.zeros(n, np.int64)
        # Element i is that of the steps whose remainder is i.
        self._past = np.zeros((n, self.steps[1] + 1, size))

    def begin(self, row: int, agent: Agent, rng: np.random.Generator) -> None:
        """Draws the delay."""
        del agent
        self._delays[row] = rng.integers(*self.steps, endpoint=True)

    def _exchange(
        self, new: FloatArray | DoubleArray, steps: npt.NDArray[np.int64], rows: Rows, first: int
    ) -> tuple[DoubleArray, BoolArray]:
        """Stores rows of numbers, and returns those of the past.

        Args:
            new: Numbers of the agents, shape (len(rows), size).
            steps: Steps of the agents in their episodes, shape (len(rows),).
            rows: The agents.
            first: The first step of an episode with numbers.

        Returns:
            The numbers of the past, or the first ones, and whether there are any for the delay.
        """
        length = self._past.shape[1]
        self._past[rows, steps % length] = new
        past = steps - self._delays[rows]
        return self._past[rows, np.maximum(past, first) % length], past >= first


class CommandLatency(_Latency):
    """Commands that take effect later; before the first one, the robot stands still."""

    def prepare(self, n: int, beams: int, size: int) -> None:
        """Prepares the memory of the commands."""
        del beams, size
        self._allocate(n, 3)

    def change_commands(self, commands: DoubleArray, situation: Situation, rows: Rows) -> None:
        """Replaces the commands by earlier ones."""
        past, is_known = self._exchange(commands[rows], situation.steps[rows], rows, 1)
        commands[rows] = np.where(is_known[:, np.newaxis], past, 0.0)


class ObservationLatency(_Latency):
    """Observations of an earlier time; until there is one, the first one of the episode remains.

    Rewards and endings are those of the present.
    """

    def prepare(self, n: int, beams: int, size: int) -> None:
        """Prepares the memory of the observations."""
        del beams
        self._allocate(n, size)
        self._past = self._past.astype(np.float32)
        self._observed: FloatArray = np.zeros((n, size), np.float32)

    def change_observations(
        self, observations: FloatArray, situation: Situation, rows: Rows
    ) -> FloatArray:
        """Returns the earlier observations."""
        past, _ = self._exchange(observations[rows], situation.steps[rows], rows, 0)
        self._observed[rows] = past
        return self._observed


# -- the robot and its surroundings ------------------------------------------------------------


class DriveLimits(Randomization):
    """Factors of the limits of the drive, one for linear and one for angular velocities each.

    The velocities of actions -1 and 1 do not change: greater ones than the drive carries out can be
    commanded.
    """

    def __init__(
        self, velocity: Interval | None = None, acceleration: Interval | None = None
    ) -> None:
        """Creates the part.

        Args:
            velocity: Least and greatest factor of the limits of velocity; None for no change.
            acceleration: The same of the limits of acceleration and deceleration.

        Raises:
            ValueError: A factor is not positive, or none is given.
        """
        if velocity is None and acceleration is None:
            raise ValueError("DriveLimits requires factors of velocity or of acceleration")
        self.velocity, self.acceleration = (
            (1.0, 1.0) if value is None else _checked_factors(name, value)
            for name, value in (("velocity", velocity), ("acceleration", acceleration))
        )

    def check(self, agent: Agent) -> None:
        """Checks that the drive has limits."""
        drive = _drive_of(agent, self)
        both = (drive.linear_dynamics, drive.angular_dynamics)
        for name, factors in (("velocity", self.velocity), ("acceleration", self.acceleration)):
            if factors != (1.0, 1.0) and not any(getattr(each, f"{name}_limit") for each in both):
                raise _refused(self, agent, f"a drive with limits of {name}")

    def begin(self, row: int, agent: Agent, rng: np.random.Generator) -> None:
        """Sets the limits of the drive."""
        del row
        drive = _drive_of(agent, self)
        for name in ("linear_dynamics", "angular_dynamics"):
            limits: DynamicsLimits = getattr(drive, name)
            velocity, acceleration = rng.uniform(*self.velocity), rng.uniform(*self.acceleration)
            changed = DynamicsLimits(
                limits.velocity_limit * velocity,
                limits.acceleration_limit * acceleration,
                limits.deceleration_limit * acceleration,
            )
            setattr(drive, name, changed)


class Payload(Randomization):
    """An additional mass of the driven body, distributed like its own. Requires `mode: force`."""

    def __init__(self, mass: Interval = (0.0, 10.0)) -> None:
        """Creates the part.

        Args:
            mass: Least and greatest additional mass [kg].

        Raises:
            ValueError: A number is out of range.
        """
        self.mass = _checked_interval("mass", mass, 0.0, math.inf)

    def check(self, agent: Agent) -> None:
        """Checks that the drive moves a mass by forces."""
        if _drive_of(agent, self).traction is None:
            raise _refused(self, agent, 'a drive with "mode: force", whose motion depends on mass')

    def begin(self, row: int, agent: Agent, rng: np.random.Generator) -> None:
        """Increases the densities of the body."""
        del row
        body = _drive_of(agent, self).body
        factor = 1.0 + float(rng.uniform(*self.mass)) / body.mass
        for fixture in body.fixtures:
            fixture.density *= factor


class Friction(Randomization):
    """A factor of the friction of the robot: of its footprints, and of its wheels on the ground.

    The wheels have friction with `mode: force` of the drive.
    """

    def __init__(self, factor: Interval = (0.5, 1.0)) -> None:
        """Creates the part.

        Args:
            factor: Least and greatest factor.

        Raises:
            ValueError: A factor is not positive.
        """
        self.factor = _checked_factors("factor", factor)

    def check(self, agent: Agent) -> None:
        """Checks that there is friction."""
        has_friction = any(f.friction for body in agent.model.bodies for f in body.fixtures)
        if not has_friction and not _has_grip(agent):
            raise _refused(self, agent, 'footprints with friction, or a drive with "mode: force"')

    def begin(self, row: int, agent: Agent, rng: np.random.Generator) -> None:
        """Changes the friction."""
        del row
        factor = float(rng.uniform(*self.factor))
        for body in agent.model.bodies:
            for fixture in body.fixtures:
                fixture.friction *= factor
        drive = agent.drive
        if isinstance(drive, BodyDrive) and drive.traction is not None:
            drive.traction = replace(drive.traction, friction=drive.traction.friction * factor)


class RobotSize(Randomization):
    """A factor of the footprints of the robot, about the origin of its body; the mass changes too.

    The footprints of the model file are the greatest ones: starts and goals have room for them.
    """

    def __init__(self, factor: Interval = (0.8, 1.0)) -> None:
        """Creates the part.

        Args:
            factor: Least and greatest factor, from 0.1 to 1.

        Raises:
            ValueError: A factor is out of range.
        """
        self.factor = _checked_interval("factor", factor, 0.1, 1.0)

    def check(self, agent: Agent) -> None:
        """Checks that the model has a single body."""
        if len(agent.model.bodies) > 1:
            raise _refused(self, agent, "a model with a single body")

    def begin(self, row: int, agent: Agent, rng: np.random.Generator) -> None:
        """Scales the footprints."""
        del row
        agent.body.scale_shapes(float(rng.uniform(*self.factor)))


class ObstacleSize(Randomization):
    """Factors of the footprints of models that stand around, about the origins of their bodies."""

    def __init__(self, models: Sequence[str], factor: Interval = (0.8, 1.2)) -> None:
        """Creates the part.

        Args:
            models: Names of the models, each of which has a factor of its own.
            factor: Least and greatest factor, from 0.1 to 10.

        Raises:
            TypeError: `models` is a single name.
            ValueError: A factor is out of range.
        """
        if isinstance(models, str):
            raise TypeError(f"models must be several names, got {models!r}")
        self.models = tuple(checked_names("models", models))
        self.factor = _checked_interval("factor", factor, 0.1, 10.0)

    def check(self, agent: Agent) -> None:
        """Checks that the models exist, are not the robot and have a single body each."""
        for name in self.models:
            model = agent.world.model(name)
            if model is agent.model or len(model.bodies) > 1:
                raise WorldError(
                    "ObstacleSize requires models with a single body, other than the robot, got "
                    f'"{name}"'
                )

    def change_world(self, world: World, rng: np.random.Generator) -> None:
        """Scales the footprints."""
        for name in self.models:
            world.model(name).bodies[0].scale_shapes(float(rng.uniform(*self.factor)))


def _drive_of(agent: Agent, part: Randomization) -> BodyDrive:
    if not isinstance(agent.drive, BodyDrive):
        raise _refused(part, agent, "a drive such as DiffDrive")
    return agent.drive


def _has_grip(agent: Agent) -> bool:
    traction = agent.drive.traction if isinstance(agent.drive, BodyDrive) else None
    return traction is not None and math.isfinite(traction.friction)


def _refused(part: Randomization, agent: Agent, needed: str) -> WorldError:
    return WorldError(
        f'{type(part).__name__} requires {needed}; model "{agent.model.name}" has none'
    )


def _pair(name: str, values: Sequence[float]) -> tuple[float, float]:
    try:
        low, high = values
    except (TypeError, ValueError):
        raise ValueError(
            f"{name} must be the least and the greatest value, got {shown(values)}"
        ) from None
    return low, high


def _checked_interval(name: str, values: Interval, least: float, greatest: float) -> Interval:
    low, high = plain_numbers(_pair(name, values), (2,)) or (math.nan, math.nan)
    if not (least <= low <= high <= greatest and math.isfinite(high)):
        limits = (
            f"at least {least:g}" if greatest == math.inf else f"from {least:g} to {greatest:g}"
        )
        raise ValueError(f"{name} must be two increasing numbers {limits}, got {shown(values)}")
    return (low, high)


def _checked_factors(name: str, values: Interval) -> Interval:
    low, high = _checked_interval(name, values, 0.0, math.inf)
    if not low > 0:
        raise ValueError(f"{name} must be two positive factors, got {shown(values)}")
    return (low, high)
