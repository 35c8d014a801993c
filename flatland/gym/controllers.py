"""Controllers that drive to a goal without learning, to compare policies with.

A controller is created for an environment, and called with an observation or with those of all
environments of a vector: `action = controller(observation)`. It uses nothing but the observation,
which must contain the parts `Scan` and `Goal`, and `Velocity` for `DynamicWindow`. It has no
memory.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from flatland.geometry import DoubleArray, FloatArray
from flatland.gym.actions import VelocityAction, limit_to_unit
from flatland.gym.observations import Goal, Scan, Velocity

if TYPE_CHECKING:
    import gymnasium

_HEADINGS: Final = 49
_DECELERATION: Final = 1.0  # m/s², with which controllers expect to brake
_MARGIN: Final = 0.05  # m
_STANDING: Final = 0.02  # m, free distance with which controllers stand
_GROUPS: Final = 60  # obstacle points that `DynamicWindow` considers, at most


@dataclass(frozen=True, slots=True, eq=False)
class Perception:
    """What n robots observe, in their own frames; row i of each array is robot i.

    Attributes:
        points: Ends of the beams [m], shape (n, beams, 2).
        is_hit: Whether there is an obstacle at the end of each beam, shape (n, beams).
        goals: Positions (ahead, left) of the goals [m], shape (n, 2).
        velocities: Forward speed and yaw rate [m/s, rad/s], shape (n, 2); None if they are not
            observed.
    """

    points: DoubleArray
    is_hit: np.typing.NDArray[np.bool_]
    goals: DoubleArray
    velocities: DoubleArray | None


class Controller(ABC):
    """Chooses velocities from observations.

    Attributes:
        radius: Radius of the disc that contains the robot [m].
        low: Lowest velocity command (v, omega) [m/s, rad/s], shape (2,).
        high: Highest velocity command, shape (2,).
        dt: Duration of an action [s].
    """

    def __init__(self, env: gymnasium.Env[Any, Any] | gymnasium.vector.VectorEnv[Any, Any, Any]):
        """Reads the properties of the robot from an environment.

        Args:
            env: A `FlatlandEnv` or a `FlatlandVectorEnv`, also within wrappers that change neither
                observations nor actions.

        Raises:
            ValueError: The observation lacks a part, or the action is no `VelocityAction`.
        """
        inner: Any = env.unwrapped
        episodes = inner.episodes
        agent, situation = episodes.agents[0], episodes.situation
        if not isinstance(episodes.settings.action, VelocityAction):
            raise ValueError("controllers require environments with a VelocityAction")
        self.radius: float = agent.radius
        self.low: DoubleArray = situation.low
        self.high: DoubleArray = situation.high
        self.dt: float = episodes.settings.dt
        self._layout = episodes.layout
        self._max_range: float = situation.max_range
        x, y, theta = agent.laser.origin
        c, s = math.cos(theta), math.sin(theta)
        self._beams = agent.laser.beam_ends / agent.laser.range @ np.array([[c, s], [-s, c]])
        self._sensor = np.array((x, y))
        for kind in (Scan, Goal):
            self._layout.find(kind)

    def __call__(self, observation: Any) -> FloatArray:
        """Returns the action for an observation, or the actions for several.

        Args:
            observation: One observation, or those of a vector.

        Returns:
            Actions in [-1, 1], shape (2,), or (n, 2) for several observations.
        """
        part, columns = self._layout.find(Scan)
        values = self._layout.select(observation, part, columns)
        perception = self._perceive(observation)
        commands = self.choose(perception)
        actions = 2.0 * (commands - self.low) / (self.high - self.low) - 1.0
        result: FloatArray = limit_to_unit(actions.astype(np.float32))
        return result[0] if values.ndim == 1 else result

    @abstractmethod
    def choose(self, perception: Perception) -> DoubleArray:
        """Returns the velocity commands (v, omega) of all robots [m/s, rad/s], shape (n, 2)."""

    def _perceive(self, observation: Any) -> Perception:
        def read(kind: type[Any]) -> Any:
            part, columns = self._layout.find(kind)
            values = self._layout.select(observation, part, columns)
            return part, np.atleast_2d(values).astype(np.float64)

        scan, values = read(Scan)
        ranges = scan.ranges_of(values, self._max_range, len(self._beams))
        goal, values = read(Goal)
        velocities = None
        if self._layout.has(Velocity):
            velocity, numbers = read(Velocity)
            velocities = velocity.velocities_of(numbers, self.low, self.high)
        return Perception(
            self._sensor + ranges[..., np.newaxis] * self._beams,
            ranges < self._max_range,
            goal.positions_of(values),
            velocities,
        )

    def _towards(self, headings: DoubleArray, free: DoubleArray) -> DoubleArray:
        """Returns commands that turn to headings and then drive.

        Args:
            headings: Wanted headings in the frame of the robot [rad], shape (n,).
            free: Distances that are free on the way [m], shape (n,).
        """
        turn = np.clip(headings / (2.0 * self.dt), self.low[1], self.high[1])
        # The speed from which the robot can brake after this action.
        change = _DECELERATION * self.dt
        speed = np.sqrt(change * change + 2.0 * _DECELERATION * np.maximum(free, 0.0)) - change
        # On a curve, the robot leaves the line that is free.
        speed = np.minimum(speed, self.high[0]) * np.maximum(np.cos(headings), 0.0) ** 4
        return np.stack((np.maximum(speed, self.low[0]), turn), axis=1)


class Straight(Controller):
    """Turns to the goal and drives there, without regard for obstacles."""

    def choose(self, perception: Perception) -> DoubleArray:
        """Returns commands that lead straight to the goals."""
        goals = perception.goals
        distances = np.hypot(goals[:, 0], goals[:, 1])
        return self._towards(np.arctan2(goals[:, 1], goals[:, 0]), distances)


class Gap(Controller):
    """Drives along the free heading that is nearest to the goal.

    Of 49 headings all around, and that of the goal, the scan determines how far the disc of the
    robot can drive along each. Those with enough free distance, or along which the goal can be
    reached, are compared by the angle to the goal; without any, the one with most is chosen.
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any] | gymnasium.vector.VectorEnv[Any, Any, Any],
        *,
        margin: float = _MARGIN,
        distance: float = 1.0,
    ) -> None:
        """Creates the controller.

        Args:
            env: See `Controller`.
            margin: Distance to keep from obstacles [m].
            distance: Free distance that a heading needs [m].

        Raises:
            ValueError: The observation lacks a part, or a number is not positive.
        """
        super().__init__(env)
        _check_positive("margin", margin)
        _check_positive("distance", distance)
        self.margin = margin
        self.distance = distance
        self._headings = np.linspace(-math.pi, math.pi, _HEADINGS)

    def choose(self, perception: Perception) -> DoubleArray:
        """Returns commands along the best headings."""
        return self._towards(*self._best(perception))

    def _best(self, perception: Perception) -> tuple[DoubleArray, DoubleArray]:
        """Returns the best headings [rad], and the free distances on the way [m], (n,) each."""
        goals = perception.goals
        bearings = np.arctan2(goals[:, 1], goals[:, 0])
        headings = np.column_stack((np.tile(self._headings, (len(goals), 1)), bearings))
        free = self._free(perception, headings)
        needed = np.minimum(np.hypot(goals[:, 0], goals[:, 1]), self.distance)
        angles = np.abs((headings - bearings[:, np.newaxis] + math.pi) % math.tau - math.pi)
        # Of headings with equal angles, the one that needs least turning.
        cost = angles + 0.1 * np.abs(headings)
        # All that are free cost less.
        cost = np.where(free >= needed[:, np.newaxis], cost, 10.0 + self._max_range - free)
        best = np.argmin(cost, axis=1)
        rows = np.arange(len(goals))
        # Until the robot has turned, it drives on along its present heading.
        ahead = free[:, _HEADINGS // 2]
        return headings[rows, best], np.minimum(free[rows, best], ahead)

    def _free(self, perception: Perception, headings: DoubleArray) -> DoubleArray:
        """Returns how far each robot can drive along headings [m], shape (n, headings)."""
        ahead, left = perception.points[..., 0], perception.points[..., 1]
        reach = self.radius + self.margin
        gaps = np.hypot(ahead, left)
        # Points within the margin block only the ways that lead nearer to them.
        discs = np.minimum(reach, np.maximum(gaps - 1e-3, 0.0))[:, np.newaxis]
        c, s = np.cos(headings)[..., np.newaxis], np.sin(headings)[..., np.newaxis]
        along = c * ahead[:, np.newaxis] + s * left[:, np.newaxis]
        across = c * left[:, np.newaxis] - s * ahead[:, np.newaxis]
        squared = discs * discs - across * across
        blocks = (squared > 0.0) & (along > 0.0) & perception.is_hit[:, np.newaxis]
        distances = np.where(blocks, along - np.sqrt(np.maximum(squared, 0.0)), self._max_range)
        # So that the robot stands before an obstacle instead of creeping towards it.
        free: DoubleArray = distances.min(axis=2) - _STANDING
        return free


class DynamicWindow(Gap):
    """Chooses the best of the velocities that can be reached within an action.

    It aims at a place along the heading that `Gap` chooses, at most `distance` away.

    For each velocity, the robot is predicted along an arc. Velocities with which it could not stop
    before an obstacle are excluded. The others are rated by the distance of the arc from that
    place, and by their clearance: D. Fox, W. Burgard, S. Thrun, "The dynamic window
    approach to collision avoidance", IEEE Robotics & Automation Magazine 4 (1997).
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any] | gymnasium.vector.VectorEnv[Any, Any, Any],
        *,
        acceleration: tuple[float, float] = (2.0, 8.0),
        horizon: float = 1.5,
        samples: tuple[int, int] = (6, 15),
        margin: float = _MARGIN,
        distance: float = 1.0,
        clearance: float = 0.3,
        clearance_weight: float = 0.6,
    ) -> None:
        """Creates the controller; the accelerations are those of the included robot.

        Args:
            env: See `Controller`; the observation must contain `Velocity`.
            acceleration: Limits of the acceleration of the drive [m/s², rad/s²].
            horizon: Duration of the predicted arcs [s].
            samples: Number of speeds and of yaw rates, at least 2 each.
            margin: Distance to keep from obstacles [m].
            distance: Free distance that a heading needs, see `Gap` [m].
            clearance: Distance beyond which an obstacle does not matter [m].
            clearance_weight: Distance from the place ahead that costs as much as a metre of missing
                clearance.

        Raises:
            ValueError: The observation lacks a part, or a number is out of range.
        """
        super().__init__(env, margin=margin, distance=distance)
        self._layout.find(Velocity)
        _check_positive("acceleration", min(acceleration))
        _check_positive("horizon", horizon)
        _check_positive("clearance", clearance)
        if not clearance_weight >= 0:
            raise ValueError(f"clearance_weight must not be negative, got {clearance_weight}")
        if min(samples) < 2:
            raise ValueError(f"samples must be at least 2 each, got {samples}")
        self.acceleration = acceleration
        self.horizon = horizon
        self.samples = samples
        self.clearance = clearance
        self.clearance_weight = clearance_weight

    def choose(self, perception: Perception) -> DoubleArray:
        """Returns the best commands."""
        if perception.velocities is None:
            raise ValueError("the observation must contain Velocity")
        change = self.dt * np.array(self.acceleration)
        low = np.maximum(self.low, perception.velocities - change)
        high = np.maximum(np.minimum(self.high, perception.velocities + change), low)
        fractions = [np.linspace(0.0, 1.0, count) for count in self.samples]
        v = low[:, :1] + (high - low)[:, :1] * fractions[0]
        omega = low[:, 1:] + (high - low)[:, 1:] * fractions[1]
        v = np.repeat(v, len(fractions[1]), axis=1)  # shape (n, count)
        omega = np.tile(omega, len(fractions[0]))
        times = np.linspace(0.0, self.horizon, 9)[1:]
        ahead, left = _arcs(v, omega, times)  # shape (n, count, times)
        gaps = self._gaps(perception, ahead, left)
        # The time until the robot stands, if it brakes after this action.
        stopping = self.dt + v / _DECELERATION
        is_before = times <= stopping[..., np.newaxis] + times[0]
        # Within the margin, the robot may drive if it does not come nearer.
        zero = np.zeros((len(v), 1, 1))
        least = np.minimum(self.margin, 0.95 * self._gaps(perception, zero, zero)[:, 0])
        is_safe = (np.where(is_before, gaps, math.inf).min(axis=2) > least) | (v <= 0.0)
        bearings, _ = self._best(perception)
        lengths = np.minimum(
            np.hypot(perception.goals[:, 0], perception.goals[:, 1]), self.distance
        )
        goal_ahead = (lengths * np.cos(bearings))[:, np.newaxis]
        goal_left = (lengths * np.sin(bearings))[:, np.newaxis]
        # An arc may end there before the horizon.
        remaining = np.hypot(
            ahead - goal_ahead[..., np.newaxis], left - goal_left[..., np.newaxis]
        ).min(axis=2)
        turned = np.arctan2(goal_left - left[..., -1], goal_ahead - ahead[..., -1])
        turned = np.abs((turned - omega * self.horizon + math.pi) % math.tau - math.pi)
        near = self.clearance - np.clip(gaps.min(axis=2), 0.0, self.clearance)
        cost = remaining + self.clearance_weight * near + 0.1 * turned
        cost[~is_safe] = math.inf
        best = np.argmin(cost, axis=1)
        rows = np.arange(len(v))
        commands: DoubleArray = np.stack((v[rows, best], omega[rows, best]), axis=1)
        # Without any safe velocity, the robot brakes and turns there.
        blocked = ~is_safe.any(axis=1)
        commands[blocked, 0] = low[blocked, 0]
        commands[blocked, 1] = np.clip(bearings[blocked], low[blocked, 1], high[blocked, 1])
        return commands

    def _gaps(self, perception: Perception, ahead: DoubleArray, left: DoubleArray) -> DoubleArray:
        """Returns the gap between the robot and the obstacles at predicted positions [m]."""
        points = np.where(perception.is_hit[..., np.newaxis], perception.points, math.inf)
        beams = points.shape[1]
        size = -(-beams // _GROUPS)
        if size > 1:
            # The nearest point of each group of neighbouring beams.
            padding = -beams % size
            points = np.pad(points, ((0, 0), (0, padding), (0, 0)), constant_values=math.inf)
            groups = points.reshape(len(points), -1, size, 2)
            nearest = np.argmin((groups * groups).sum(axis=3), axis=2)
            points = np.take_along_axis(groups, nearest[..., None, None], axis=2)[:, :, 0]
        dx = ahead[..., np.newaxis] - points[:, None, None, :, 0]
        dy = left[..., np.newaxis] - points[:, None, None, :, 1]
        gaps: DoubleArray = np.sqrt((dx * dx + dy * dy).min(axis=3)) - self.radius
        return gaps


def _check_positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f"{name} must be positive, got {value}")


def _arcs(
    v: DoubleArray, omega: DoubleArray, times: DoubleArray
) -> tuple[DoubleArray, DoubleArray]:
    """Returns the positions (ahead, left) after times at constant velocities.

    Args:
        v: Forward speeds [m/s], shape (n, count).
        omega: Yaw rates [rad/s], shape (n, count).
        times: Times [s], shape (k,).
    """
    angle = omega[..., np.newaxis] * times
    length = v[..., np.newaxis] * times
    half = 0.5 * angle
    chord = length * np.sinc(half / math.pi)
    ahead: DoubleArray = chord * np.cos(half)
    left: DoubleArray = chord * np.sin(half)
    return ahead, left


CONTROLLERS: Final[dict[str, type[Controller]]] = {
    "straight": Straight,
    "gap": Gap,
    "window": DynamicWindow,
}
"""The controllers by name."""
