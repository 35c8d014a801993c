"""Values that the physics takes and returns."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from flatland.geometry import FloatArray, Pose, Vector2

if TYPE_CHECKING:
    from collections.abc import Sequence

    from flatland._core import PhysicsBody, PhysicsFixture, RangeFinder

ALL_BITS: Final = 0xFFFF
"""All categories of fixtures."""

SpeedLimits = tuple[float, float, float]
"""Limits of velocity, acceleration and deceleration; 0 for no limit."""


class ObjectCounts(NamedTuple):
    """The numbers of objects in a physics world.

    Attributes:
        bodies: Number of bodies.
        fixtures: Number of fixtures.
        joints: Number of joints.
        contacts: Number of pairs of fixtures whose bounding boxes overlap.
    """

    bodies: int
    fixtures: int
    joints: int
    contacts: int


@dataclass(frozen=True, slots=True)
class StepReport:
    """What went wrong in a step; most steps have no report.

    Attributes:
        limited: Ids of dynamic bodies whose contacts or velocities the engine limited, since they
            are jammed: they overlap walls and have no room.
        invalid: Ids of bodies whose pose or velocity is not finite.
    """

    limited: tuple[int, ...]
    invalid: tuple[int, ...]


def to_report(ids: tuple[list[int], list[int]] | None) -> StepReport | None:
    """Converts the report of the core: the ids of limited and of invalid bodies."""
    return None if ids is None else StepReport(tuple(ids[0]), tuple(ids[1]))


class Material(NamedTuple):
    """What a surface does to the beams of range finders; all shares are from 0 to 1.

    Of the beams that hit the surface, a share `transmission` passes, a share `specular` is
    reflected as by a mirror, and the others are scattered: they are measured. The sum of
    `transmission` and `specular` is at most 1.

    Attributes:
        reflectance: Share of the light that is scattered (albedo), for intensities.
        transmission: Share of the beams that pass.
        specular: Share of the beams that are reflected as by a mirror.
    """

    reflectance: float = 0.5
    transmission: float = 0.0
    specular: float = 0.0


class Touch(NamedTuple):
    """A contact that exists now.

    Attributes:
        contact_id: Id of the contact, the same for as long as the two fixtures touch.
        this_body: Id of the body whose contacts are collected.
        other_body: Id of the other body.
        is_a: Whether `this_body` is body A of the contact, from which the normal points away.
        solver_calls: Number of times that the solver processed the contact in the last step; if it
            is 0, there are no points.
        normal_impulses: Sum of the impulses of these calls along the normal, by point [N s].
        tangent_impulses: The same along the surface.
        points: Contact points of the last call, world frame [m].
        normal: Unit vector from A to B of the last call, world frame.
    """

    contact_id: int
    this_body: int
    other_body: int
    is_a: bool
    solver_calls: int
    normal_impulses: list[float]
    tangent_impulses: list[float]
    points: list[Vector2]
    normal: Vector2


@dataclass(frozen=True, slots=True)
class RollingWheel:
    """A wheel on the ground.

    Attributes:
        body: Body on which the wheel is mounted.
        position: Point of the body at which the wheel touches the ground, body frame [m].
        heading: Direction in which the wheel rolls, body frame [rad].
        radius: Radius of the wheel [m].
        slide: Cotangent of the angle from the heading to the direction in which the wheel moves
            freely: 0 for wheels that slide sideways, 1 or -1 for mecanum wheels.
    """

    body: PhysicsBody
    position: Vector2
    heading: float
    radius: float
    slide: float


class PathState(NamedTuple):
    """Everything that changes in a `PathController`; waypoint 0 is the initial pose.

    Attributes:
        waypoint: The last waypoint that was reached.
        next_waypoint: The next one.
        is_moving: Whether the body moves.
        is_forward: Whether it moves forwards along the path.
        legs: Number of legs begun.
        time: Time since the beginning of the leg [s].
        used_starts: Number of starts used.
        pose: Pose of the motion, world frame [m, rad].
        leg_start: Pose at the beginning of the leg, world frame [m, rad].
        key: Key of the random numbers.
    """

    waypoint: int
    next_waypoint: int
    is_moving: bool
    is_forward: bool
    legs: int
    time: float
    used_starts: int
    pose: Pose
    leg_start: Pose
    key: int


@dataclass(frozen=True, slots=True)
class RayHit:
    """The nearest hit of a ray.

    Attributes:
        fraction: Distance of the hit as a fraction of the length of the ray, in [0, 1].
        point: Point of the hit, world frame [m].
        normal: Unit normal of the fixture at the point, world frame.
        fixture: Fixture that was hit.
        category_bits: Categories of the fixture.
    """

    fraction: float
    point: Vector2
    normal: Vector2
    fixture: PhysicsFixture
    category_bits: int


class Scan(NamedTuple):
    """A scan of a range finder.

    Attributes:
        pose: Pose (x, y, theta) of the sensor in the world frame [m, rad].
        ranges: Range of each beam [m], shape (n,).
        intensities: 255 for a beam whose reading is that of a reflecting fixture, else 0, shape
            (n,). In a world with materials, other hits have an intensity I from 0 to 255:
            I = 255 reflectance cos(angle of incidence) / max(range, 1 m)². None for a range finder
            without `reflect_mask` in a world without materials, and for a cone.
    """

    pose: Pose
    ranges: FloatArray
    intensities: FloatArray | None


class LabelledScan(NamedTuple):
    """A scan with what the beams hit.

    Attributes:
        pose: Pose (x, y, theta) of the sensor in the world frame [m, rad].
        ranges: Range of each beam [m], shape (n,).
        labels: For each beam, 1 + the index of an entry of `hits`, or 0 if its reading is not that
            of a hit, shape (n,).
        hits: The bodies that were hit, each as its id and the categories of the fixture.
    """

    pose: Pose
    ranges: FloatArray
    labels: npt.NDArray[np.uint32]
    hits: list[tuple[int, int]]


class ScanRequest(NamedTuple):
    """A scan to be performed; see `RangeFinder.scan`."""

    finder: RangeFinder
    body: PhysicsBody
    stream: int
    update: int


class Member(NamedTuple):
    """A person who is added to a crowd.

    Attributes:
        body: Body of the person; the origin is the center, x the heading.
        legs: The left and the right leg, or nothing.
        radius: Radius of the disc around the person that others do not enter [m].
        speed: Preferred speed [m/s].
        is_aware: Whether the person avoids dynamic bodies.
        phase: Phase of the gait, from 0 to 1.
        is_redrawn: Whether `Crowd.redraw` draws another place.
    """

    body: PhysicsBody
    legs: Sequence[PhysicsBody]
    radius: float
    speed: float
    is_aware: bool
    phase: float
    is_redrawn: bool


class PersonState(NamedTuple):
    """A person of a crowd.

    Attributes:
        body_id: Id of the body.
        x: Position [m], world frame.
        y: Position [m], world frame.
        yaw: Heading [rad].
        vx: Velocity [m/s], world frame.
        vy: Velocity [m/s], world frame.
        omega: Rate of the heading [rad/s].
        is_standing: Whether the person stands on purpose: stopped, waiting or in a queue.
    """

    body_id: int
    x: float
    y: float
    yaw: float
    vx: float
    vy: float
    omega: float
    is_standing: bool


Clock = tuple[int, int]
"""Weight and cycle: an update is due at time t [ns] if (2 t + step) * weight modulo cycle is less
than 2 * step * weight; see `flatland.UpdateTimer.clock`."""


class RunEnd(IntEnum):
    """What is to be done outside of the core when a run has ended.

    Attributes:
        DONE: Nothing; all steps are complete, or the run was interrupted.
        BEFORE: Calls before the physics step.
        PHYSICS: The physics step itself.
        AFTER_PHYSICS: The report of the physics step and the contacts are to be examined.
        AFTER: Calls after the physics step.
        LAST_CALLS: As `AFTER`, and the step is complete after them.
    """

    DONE = 0
    BEFORE = 1
    PHYSICS = 2
    AFTER_PHYSICS = 3
    AFTER = 4
    LAST_CALLS = 5


RunResult = tuple[int, int, list[int], list[tuple[int, str]], tuple[list[int], list[int]] | None]
"""Number of complete steps, a `RunEnd`, ids of the callbacks to be called in order, ids of the
controllers that have failed with their errors, and the ids of limited and of invalid bodies."""


class Run(NamedTuple):
    """Steps to be performed by the core.

    Attributes:
        time: Simulated time at which the next step begins, or has begun [ns].
        step: Simulated time of a step [ns].
        n: Maximum number of steps, including one that has begun.
        dt: Simulated time of a step [s].
        velocity_iterations: Velocity iterations of the solver.
        position_iterations: Position iterations of the solver.
        continues: Whether the first step is the one in which the last run has ended.
        calls_physics: Whether the caller performs the physics step.
    """

    time: int
    step: int
    n: int
    dt: float
    velocity_iterations: int
    position_iterations: int
    continues: bool = False
    calls_physics: bool = False


class WorkTimes(NamedTuple):
    """Wall times of the complete steps of a paced run.

    Attributes:
        waited: Of the waits between the steps [s].
        total: Of all steps [s].
        least: Of the shortest step [s].
        most: Of the longest step [s].
    """

    waited: float
    total: float
    least: float
    most: float
