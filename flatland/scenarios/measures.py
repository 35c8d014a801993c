"""What is measured during a run, from the true state of the world; see `docs/scenarios.md`."""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from flatland.geometry import wrap_angle

if TYPE_CHECKING:
    from flatland.geometry import Pose, Vector2
    from flatland.scenarios.stage import Stage

PERSON: Final = "person"
"""Class of the models that are people."""

_MAX_CLEARANCE: Final = 100.0  # m; obstacles farther away are not searched
_PRECISION: Final = 1e-3  # of the clearance [m]
_PERSONAL_SPACE: Final = 1.2  # radius [m], E. T. Hall, The Hidden Dimension, 1966
_STUCK_TIME: Final = 2.0  # window of the motion [s]
_STUCK_DISTANCE: Final = 0.1  # m
_STUCK_ANGLE: Final = 0.3  # rad
_ROLLING: Final = 0.02  # coefficient of rolling resistance
_GRAVITY: Final = 9.81  # m/s^2

Velocity = tuple[float, float, float]


class Measures:
    """The measures of a run: `step` is called after each step, `sample` once per period.

    Attributes:
        path: Sampled poses (time, x, y) of the robot [s, m, m].
        collisions: Number of times that the robot began to touch a wall layer or another model.
        people: Names of all people of the run.
        stuck_for: Time for which the robot has not moved [s].
    """

    def __init__(self, stage: Stage) -> None:
        """Starts at the current pose of the robot."""
        self._stage = stage
        self._world = stage.world
        self._robot = stage.robot
        self._period = stage.task.period
        self._own = {body.id for body in self._robot.bodies}
        self._owners: dict[int, str] = {}
        self._masses = [(body, body.mass, body.inertia) for body in self._robot.bodies]
        self._mass = sum(mass for _, mass, _ in self._masses)
        self._pose = self._robot.pose
        self._kinetic = self._kinetic_energy()
        self._velocities: dict[str, Velocity] = {}
        self._remember_velocities()
        self._touched = self._touching()
        self._speeds: deque[tuple[float, float]] = deque(maxlen=3)
        self._jerks: list[tuple[float, float]] = []
        self._poses: deque[Pose] = deque(maxlen=round(_STUCK_TIME / self._period) + 1)
        self._intruding: set[str] = set()
        self.people: set[str] = set()
        self.path: list[tuple[float, float, float]] = []
        self.collisions = 0
        self.stuck_for = 0.0
        self._partners: dict[str, None] = {}
        self._impact_speed: float | None = None
        self._length = self._energy = self._stuck_time = self._intrusion_time = 0.0
        self._stuck_until = 0.0
        self._intrusions = 0
        self._people_distance = math.inf
        self._clearance = math.inf
        if self._touched:
            self._clearance = 0.0
        elif self._is_nearer(_MAX_CLEARANCE):
            self._clearance = self._reduced_clearance(_MAX_CLEARANCE)

    def step(self) -> Pose:
        """Adds the last step; returns the pose of the robot."""
        pose = self._robot.pose
        moved = math.hypot(pose[0] - self._pose[0], pose[1] - self._pose[1])
        self._pose = pose
        self._length += moved
        kinetic = self._kinetic_energy()
        self._energy += max(0.0, kinetic - self._kinetic)
        self._energy += _ROLLING * self._mass * _GRAVITY * moved
        self._kinetic = kinetic
        touching = self._touching()
        for name in sorted(touching - self._touched):
            self._add_collision(name)
        self._touched = touching
        self._remember_velocities()
        if touching:
            self._clearance = 0.0
        elif self._clearance > 0 and self._is_nearer(min(self._clearance, _MAX_CLEARANCE)):
            self._clearance = self._reduced_clearance(min(self._clearance, _MAX_CLEARANCE))
        return pose

    def sample(self) -> None:
        """Adds what is measured once per period: jerk, time stuck, people and the path."""
        x, y, theta = self._pose
        self.path.append((self._stage.time, x, y))
        vx, vy, omega = self._velocities[self._robot.name]
        # The speed ahead; the sign distinguishes driving backwards.
        self._speeds.append((vx * math.cos(theta) + vy * math.sin(theta), omega))
        if len(self._speeds) == 3:
            (v0, w0), (v1, w1), (v2, w2) = self._speeds
            square = self._period**2
            self._jerks.append((abs(v2 - 2 * v1 + v0) / square, abs(w2 - 2 * w1 + w0) / square))
        self._sample_stuck()
        self._sample_people()

    def moved(self) -> None:
        """Takes a jump of the robot out of all measures, such as a kidnapping."""
        self._pose = self._robot.pose
        self._kinetic = self._kinetic_energy()
        self._remember_velocities()
        self._speeds.clear()
        self._poses.clear()
        self.stuck_for = 0.0
        self._touched = self._touching()

    def values(self) -> dict[str, Any]:
        """Returns the measures by column."""
        jerks = np.array(self._jerks).reshape(-1, 2)
        jerk, angular_jerk = jerks.mean(axis=0).tolist() if len(jerks) else (None, None)
        return {
            "path_length": self._length,
            "collisions": self.collisions,
            "collided_with": " ".join(self._partners) or None,
            "impact_speed": self._impact_speed,
            "clearance": _finite(self._clearance),
            "jerk": jerk,
            "angular_jerk": angular_jerk,
            "stuck_time": self._stuck_time,
            "people_distance": _finite(self._people_distance),
            "intrusions": self._intrusions,
            "intrusion_time": self._intrusion_time,
            "energy": self._energy,
        }

    # -- motion ----------------------------------------------------------------------------

    def _kinetic_energy(self) -> float:
        energy = 0.0
        for body, mass, inertia in self._masses:
            vx, vy, omega = body.velocity
            energy += 0.5 * (mass * (vx * vx + vy * vy) + inertia * omega * omega)
        return energy

    def _sample_stuck(self) -> None:
        self._poses.append(self._pose)
        if len(self._poses) < (self._poses.maxlen or 0):
            return
        x, y, theta = self._poses[0]
        is_stuck = (
            math.dist((x, y), self._pose[:2]) < _STUCK_DISTANCE
            and abs(wrap_angle(self._pose[2] - theta)) < _STUCK_ANGLE
        )
        if not is_stuck:
            self.stuck_for = 0.0
            return
        now = self._stage.time
        # At first, the whole window, unless part of it was counted before.
        self.stuck_for += self._period if self.stuck_for else _STUCK_TIME
        self._stuck_time += now - max(now - _STUCK_TIME, self._stuck_until)
        self._stuck_until = now

    # -- people ----------------------------------------------------------------------------

    def _sample_people(self) -> None:
        near: set[str] = set()
        for model in self._world.models:
            if model.class_name != PERSON:
                continue
            self.people.add(model.name)
            distance = math.dist(model.pose[:2], self._pose[:2])
            self._people_distance = min(self._people_distance, distance)
            if distance < _PERSONAL_SPACE:
                near.add(model.name)
        self._intrusions += len(near - self._intruding)
        self._intrusion_time += self._period if near else 0.0
        self._intruding = near

    # -- obstacles -------------------------------------------------------------------------

    def _remember_velocities(self) -> None:
        states = self._world.state()
        velocities = map(tuple, states.velocities.tolist())
        self._velocities = dict(zip(states.names, velocities, strict=True))

    def _touching(self) -> set[str]:
        """Returns the names of the models and layers that the robot touches."""
        touching = set()
        for contact in self._world.physics.contacts():
            a, b = contact.body_a, contact.body_b
            if contact.is_sensor or (a in self._own) == (b in self._own):
                continue
            other = b if a in self._own else a
            if other not in self._owners:
                self._owners[other] = self._world.body_of_id(other).entity.name
            touching.add(self._owners[other])
        return touching

    def _add_collision(self, name: str) -> None:
        """Counts a collision, with the velocities before the step."""
        self.collisions += 1
        self._partners[name] = None
        ours = self._velocities[self._robot.name]
        theirs = self._velocities.get(name, (0.0, 0.0, 0.0))
        speed = math.hypot(ours[0] - theirs[0], ours[1] - theirs[1])
        self._impact_speed = max(speed, self._impact_speed or 0.0)

    def _is_nearer(self, distance: float) -> bool:
        """Returns whether an obstacle is nearer than a distance [m]."""
        physics, bodies = self._world.physics, self._robot.bodies
        return bool(physics.overlapping_bodies(bodies, self._pose, least_gap=distance))

    def _reduced_clearance(self, high: float) -> float:
        """Returns the clearance, which is known to be smaller than a distance, by bisection."""
        low = 0.0
        while high - low > _PRECISION:
            middle = (low + high) / 2
            if self._is_nearer(middle):
                high = middle
            else:
                low = middle
        return low


def success_weighted_length(success: bool, shortest: float, length: float) -> float:
    """Returns the success weighted by path length of one run, in [0, 1].

    See P. Anderson et al., "On Evaluation of Embodied Navigation Agents", arXiv:1807.06757, 2018.

    Args:
        success: Whether the goals were reached.
        shortest: Length of a shortest path [m].
        length: Length of the path of the robot [m].
    """
    if not success:
        return 0.0
    longest = max(length, shortest)
    return shortest / longest if longest else 1.0


def distance_left(pose: Pose, goal: Vector2) -> float:
    """Returns the straight distance to a goal [m]."""
    return math.dist(pose[:2], goal)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
