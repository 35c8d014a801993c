"""What is measured during a run, from the true state of the world; see `docs/scenarios.md`."""

from __future__ import annotations

import hashlib
import math
import struct
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
_UNITS: Final = 1000  # of the clearance, per metre
_PERSONAL_SPACE: Final = 1.2  # radius [m], E. T. Hall, The Hidden Dimension, 1966
_STUCK_TIME: Final = 2.0  # window of the motion [s], at least one period
_STUCK_DISTANCE: Final = 0.1  # m
_STUCK_ANGLE: Final = 0.3  # rad
_TIME_PRECISION: Final = 1e-6  # of a period
_ROLLING: Final = 0.02  # coefficient of rolling resistance
_GRAVITY: Final = 9.81  # m/s^2

Velocity = tuple[float, float, float]


class Measures:
    """The measures of a run: `step` is called after each step, `sample` once per period.

    Attributes:
        path: Sampled poses (time, x, y) of the robot [s, m, m].
        jumps: Jumps of the robot (time, x, y, x, y) from one place to another [s, m].
        collisions: Number of times that the robot began to touch a wall layer or another model.
        touched: Names of the layers and models that the robot has touched, as keys.
        people: Names of all people of the run.
        stuck_for: Time for which the robot has not moved [s].
    """

    def __init__(self, stage: Stage) -> None:
        """Starts at the current pose of the robot."""
        self._stage = stage
        self._world = stage.world
        self._robot = stage.robot
        self._period = period = stage.task.period
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
        self._poses: deque[Pose] = deque(maxlen=max(1, round(_STUCK_TIME / period)) + 1)
        self._intruding: set[str] = set()
        self.people: set[str] = set()
        self.path: list[tuple[float, float, float]] = []
        self.jumps: list[tuple[float, float, float, float, float]] = []
        self._trajectory = hashlib.sha256()
        self.collisions = 0
        self.stuck_for = 0.0
        self.touched: dict[str, None] = {}
        self._impact_speed: float | None = None
        self._last_move = (self._pose[:2], self._pose[:2], 0.0)
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
        self._last_move = (self._pose[:2], pose[:2], self._length)
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
        """Adds what is measured once per period: jerk, time stuck, people and the path.

        The last sample of a run may come earlier, at the end; differences and windows of equal
        periods, which are the jerk and the time stuck, do not contain it.
        """
        now = self._stage.time
        elapsed = now - self.path[-1][0] if self.path else 0.0
        if self.path and elapsed <= 0:
            return  # The run has ended right after a sample.
        x, y, theta = self._pose
        self.path.append((now, x, y))
        self._trajectory.update(struct.pack("<4d", now, x, y, theta))
        self._sample_people(elapsed)
        if len(self.path) == 1 or elapsed > self._period * (1 - _TIME_PRECISION):
            self._sample_speeds()
            self._sample_stuck()

    def moved(self) -> None:
        """Takes a jump of the robot out of all measures, such as a kidnapping."""
        before = self._pose
        self._pose = self._robot.pose
        self.jumps.append((self._stage.time, *before[:2], *self._pose[:2]))
        self._kinetic = self._kinetic_energy()
        self._remember_velocities()
        self._speeds.clear()
        self._poses.clear()
        self.stuck_for = 0.0
        self._touched = self._touching()

    def length_to(self, center: Vector2, radius: float) -> float:
        """Returns the length of the path up to where the last step enters a circle [m].

        Args:
            center: Center of the circle, which contains the robot now [m].
            radius: Its radius [m].
        """
        before, now, length = self._last_move
        return length + distance_to_circle(before, now, center, radius)

    def values(self) -> dict[str, Any]:
        """Returns the measures by column."""
        jerks = np.array(self._jerks).reshape(-1, 2)
        jerk, angular_jerk = jerks.mean(axis=0).tolist() if len(jerks) else (None, None)
        return {
            "path_length": self._length,
            "collisions": self.collisions,
            "collided_with": " ".join(self.touched) or None,
            "impact_speed": self._impact_speed,
            "clearance": _finite(self._clearance),
            "jerk": jerk,
            "angular_jerk": angular_jerk,
            "stuck_time": self._stuck_time,
            "people_distance": _finite(self._people_distance),
            "intrusions": self._intrusions,
            "intrusion_time": self._intrusion_time,
            "energy": self._energy,
            "trajectory": self._trajectory.hexdigest()[:32],
        }

    # -- motion ----------------------------------------------------------------------------

    def _kinetic_energy(self) -> float:
        energy = 0.0
        for body, mass, inertia in self._masses:
            vx, vy, omega = body.velocity
            energy += 0.5 * (mass * (vx * vx + vy * vy) + inertia * omega * omega)
        return energy

    def _sample_speeds(self) -> None:
        vx, vy, omega = self._velocities[self._robot.name]
        theta = self._pose[2]
        # The speed ahead; the sign distinguishes driving backwards.
        self._speeds.append((vx * math.cos(theta) + vy * math.sin(theta), omega))
        if len(self._speeds) == 3:
            (v0, w0), (v1, w1), (v2, w2) = self._speeds
            square = self._period**2
            self._jerks.append((abs(v2 - 2 * v1 + v0) / square, abs(w2 - 2 * w1 + w0) / square))

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
        now, window = self._stage.time, (len(self._poses) - 1) * self._period
        # At first, the whole window, unless part of it was counted before.
        self.stuck_for += self._period if self.stuck_for else window
        self._stuck_time += now - max(now - window, self._stuck_until)
        self._stuck_until = now

    # -- people ----------------------------------------------------------------------------

    def _sample_people(self, elapsed: float) -> None:
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
        self._intrusion_time += elapsed if near else 0.0
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
        self.touched[name] = None
        ours = self._velocities[self._robot.name]
        theirs = self._velocities.get(name, (0.0, 0.0, 0.0))
        speed = math.hypot(ours[0] - theirs[0], ours[1] - theirs[1])
        self._impact_speed = max(speed, self._impact_speed or 0.0)

    def _is_nearer(self, distance: float) -> bool:
        """Returns whether an obstacle is nearer than a distance [m]."""
        physics, bodies = self._world.physics, self._robot.bodies
        return bool(physics.overlapping_bodies(bodies, self._pose, least_gap=distance))

    def _reduced_clearance(self, high: float) -> float:
        """Returns the clearance, which is known to be smaller than a distance, by bisection.

        It is rounded down to a multiple of 1 mm.
        """
        least, most = 0, math.ceil(high * _UNITS)
        while most - least > 1:
            middle = (least + most) // 2
            if self._is_nearer(middle / _UNITS):
                most = middle
            else:
                least = middle
        return least / _UNITS


def success_weighted_length(success: bool, shortest: float, length: float) -> float:
    """Returns the success weighted by path length of one run, in [0, 1].

    See P. Anderson et al., "On Evaluation of Embodied Navigation Agents", arXiv:1807.06757, 2018:
    S l / max(p, l), where both lengths are those of paths from the start to where the success is
    declared.

    Args:
        success: Whether the goals were reached.
        shortest: Length l of a shortest path [m].
        length: Length p of the path of the robot [m].
    """
    if not success:
        return 0.0
    longest = max(length, shortest)
    return shortest / longest if longest else 1.0


def distance_to_circle(start: Vector2, end: Vector2, center: Vector2, radius: float) -> float:
    """Returns the length of the part of a straight line before it enters a circle [m].

    Args:
        start: Start of the line [m].
        end: End of the line, inside of the circle [m].
        center: Center of the circle [m].
        radius: Its radius [m].
    """
    length = math.dist(start, end)
    if not length or math.dist(start, center) <= radius:
        return 0.0
    ahead = ((end[0] - start[0]) / length, (end[1] - start[1]) / length)
    to_center = (center[0] - start[0], center[1] - start[1])
    along = to_center[0] * ahead[0] + to_center[1] * ahead[1]
    across = to_center[0] * ahead[1] - to_center[1] * ahead[0]
    half = math.sqrt(max(0.0, radius * radius - across * across))
    return min(max(along - half, 0.0), length)


def distance_left(pose: Pose, goal: Vector2) -> float:
    """Returns the straight distance to a goal [m]."""
    return math.dist(pose[:2], goal)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
