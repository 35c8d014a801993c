"""The state of all agents of an environment as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from flatland.geometry import BoolArray, DoubleArray, FloatArray
from flatland.physics import AgentRows

if TYPE_CHECKING:
    from flatland.gym.agents import Agent

Rows = npt.NDArray[np.intp]


class Situation:
    """The state of n agents after a step of the environment; row i of each array is agent i.

    Observations, rewards and endings are functions of all rows of a situation at once. The value of
    a row must not depend on other rows.

    Attributes:
        poses: (x, y, theta) of each agent in the world frame [m, rad], shape (n, 3).
        velocities: (vx, vy, omega) in the world frame [m/s, rad/s], shape (n, 3).
        speed: Forward speed in the frame of the agent [m/s], shape (n,).
        yaw_rate: Yaw rate [rad/s], shape (n,).
        ranges: Range of each beam [m], as the laser measures it: a beam without a hit is NaN, inf
            or the range of the laser; shape (n, beams), float32.
        max_range: Range of the laser [m].
        goals: Goal in the world frame [m], shape (n, 2).
        goal_ahead: Goal in the frame of the agent, forward [m], shape (n,).
        goal_left: Goal in the frame of the agent, to the left [m], shape (n,).
        distance: Distance to the goal [m], shape (n,).
        previous_distance: Distance to the goal before the step [m], shape (n,).
        arrived: Whether the agent is at its goal, shape (n,).
        collided: Whether a solid footprint of the agent touched anything during the step,
            shape (n,).
        actions: Actions as numbers in [-1, 1], zero before the first step, shape (n, k): speed and
            yaw rate, k = 2, for `VelocityAction`.
        previous_actions: Actions of the step before, shape (n, k).
        low: Command of the lowest action, such as (v, omega) [m/s, rad/s], shape (k,).
        high: Command of the highest action, shape (k,).
        velocity_limits: Greatest velocities (forward, sideways, yaw rate), the units of observed
            velocities [m/s, rad/s], shape (3,).
        steps: Number of steps since the start of the episode, shape (n,).
        agents: The agents, for what the arrays do not contain; they must not be changed.
    """

    def __init__(
        self,
        n: int,
        beams: int,
        max_range: float,
        low: DoubleArray,
        high: DoubleArray,
        velocity_limits: DoubleArray | None = None,
    ) -> None:
        """Creates arrays of zeros.

        Args:
            n: Number of agents.
            beams: Number of beams of a laser.
            max_range: Range of the laser [m].
            low: Command of the lowest action.
            high: Command of the highest action.
            velocity_limits: Greatest velocities (forward, sideways, yaw rate); None for those of
                the commands (v, omega) `low` and `high`.
        """
        self.max_range = max_range
        self.low = low
        self.high = high
        if velocity_limits is None:
            speed, turn = np.maximum(np.abs(low), np.abs(high))
            velocity_limits = np.array([speed, speed, turn])
        self.velocity_limits = velocity_limits
        self.poses: DoubleArray = np.zeros((n, 3))
        self.velocities: DoubleArray = np.zeros((n, 3))
        self.speed: DoubleArray = np.zeros(n)
        self.yaw_rate: DoubleArray = np.zeros(n)
        self.ranges: FloatArray = np.zeros((n, beams), np.float32)
        self.goals: DoubleArray = np.zeros((n, 2))
        self.goal_ahead: DoubleArray = np.zeros(n)
        self.goal_left: DoubleArray = np.zeros(n)
        self.distance: DoubleArray = np.zeros(n)
        self.previous_distance: DoubleArray = np.zeros(n)
        self.arrived: BoolArray = np.zeros(n, np.bool_)
        self.collided: BoolArray = np.zeros(n, np.bool_)
        self.actions: DoubleArray = np.zeros((n, len(low)))
        self.previous_actions: DoubleArray = np.zeros((n, len(low)))
        self.steps: npt.NDArray[np.int64] = np.zeros(n, np.int64)
        self.agents: Sequence[Agent] = ()
        self._core: AgentRows | None = None

    @property
    def core(self) -> AgentRows:
        """Computations of the core on these arrays."""
        if self._core is None:
            self._core = AgentRows(
                poses=self.poses,
                velocities=self.velocities,
                goals=self.goals,
                goal_ahead=self.goal_ahead,
                goal_left=self.goal_left,
                distance=self.distance,
                speed=self.speed,
                yaw_rate=self.yaw_rate,
                arrived=self.arrived,
                previous_distance=self.previous_distance,
                collided=self.collided,
                ranges=self.ranges,
            )
        return self._core

    def __len__(self) -> int:
        """Returns the number of agents."""
        return len(self.distance)

    def take(self, rows: Rows) -> Situation:
        """Returns a copy of some rows."""
        part = Situation(0, 0, self.max_range, self.low, self.high, self.velocity_limits)
        for name, values in self._rows().items():
            setattr(part, name, values[rows])
        if self.agents:
            part.agents = [self.agents[row] for row in rows.tolist()]
        return part

    def put(self, rows: Rows, part: Situation) -> None:
        """Replaces some rows by the rows of `part`, the inverse of `take`."""
        for name, values in self._rows().items():
            values[rows] = getattr(part, name)

    def _rows(self) -> dict[str, npt.NDArray[Any]]:
        """Returns the arrays with one row per agent by name."""
        shared = ("max_range", "low", "high", "velocity_limits", "agents", "_core")
        return {name: values for name, values in vars(self).items() if name not in shared}

    def locate(self, goal_radius: float) -> None:
        """Computes the quantities that follow from the poses, velocities and goals.

        Args:
            goal_radius: Distance to the goal at which the agent has arrived [m].
        """
        self.core.locate(goal_radius)
