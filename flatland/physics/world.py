"""The physics world."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy.typing as npt

from flatland import _core
from flatland.geometry import BoolArray, FloatArray, Pose, Vector2
from flatland.physics.body import PhysicsBody
from flatland.physics.contact import ContactEvent, ContactInfo, to_events, to_infos
from flatland.physics.fixture import ALL_BITS, PhysicsFixture
from flatland.physics.joint import PhysicsJoint

PreSolveHook = Callable[[_core.PreSolveContact, _core.OldManifold], object]


@dataclass(frozen=True, slots=True)
class RayHit:
    """Where a ray meets the nearest fixture.

    Attributes:
        fraction: Of the ray's length, from 0 to 1.
        point: World frame [m].
        normal: Unit normal of the fixture, world frame.
        fixture: What was hit.
        category_bits: Of that fixture.
    """

    fraction: float
    point: Vector2
    normal: Vector2
    fixture: PhysicsFixture
    category_bits: int


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


class PhysicsWorld:
    """A Box2D world without gravity; owns its bodies, fixtures, joints and contacts.

    Worlds are independent of each other: each may be stepped in a thread of its own.

    Attributes:
        pre_solve: Called inside `step`, with the GIL, for each contact about to be solved that
            involves one of `pre_solve_bodies`: `pre_solve(contact, old_manifold)`. It may set
            `enabled`, `friction`, `restitution` and `tangent_speed` of the contact, and read the
            world; it may not change anything else. None: nothing is called. What it raises is
            kept for `take_pre_solve_errors`.
        pre_solve_bodies: Ids of bodies whose contacts `pre_solve` gets; others cost nothing.
    """

    __slots__ = ("_core", "_pre_solve_errors", "pre_solve", "pre_solve_bodies")

    def __init__(self) -> None:
        """Makes an empty world."""
        self._core = _core.World()
        self.pre_solve: PreSolveHook | None = None
        self.pre_solve_bodies: set[int] = set()
        self._pre_solve_errors: list[BaseException] = []

    def close(self) -> None:
        """Frees all that is in the world; a second call does nothing.

        Raises:
            WorldLockedError: The world is stepping.
        """
        self._core.close()
        self.pre_solve = None

    @property
    def closed(self) -> bool:
        """Whether `close` was called."""
        return self._core.closed

    def step(
        self, dt: float, velocity_iterations: int, position_iterations: int
    ) -> StepReport | None:
        """Advances the world; other Python threads run meanwhile.

        Contacts add no energy: a dynamic body without joints that touches only static bodies is
        at most 1 % and 0.01 m/s faster after a step than before this step or the previous one.
        Bodies that touch each other or are joined are together at most twice as fast and 0.1 m/s.
        Forces, springs, restitution above 1 and moving kinematic bodies are allowed for. Box2D
        alone breaks this where bodies have no room; then they are slowed down and reported. A
        contact that is updated more than 6 times in one step, while Box2D handles times of impact,
        has its bodies reported; it is disabled for the rest of the step after 6 updates, and
        after 20 in the first ten successive steps.

        Args:
            dt: Simulated time of the step [s], from 1e-6 to 1000.
            velocity_iterations: Of Box2D's solver, at least 0.
            position_iterations: Of Box2D's solver, at least 0.

        Returns:
            None, or which bodies were limited or are invalid. The world does not advance while a
            body is invalid, and each step reports the body again: set its pose and its velocity,
            or destroy it.

        Raises:
            ValueError: A number is out of range.
            StaleHandleError: The world is closed.
            WorldLockedError: Another thread uses the world, or this is a `pre_solve` call.
        """
        if self.pre_solve is None:
            ids = self._core.step(dt, velocity_iterations, position_iterations)
        else:
            ids = self._core.step_with_hook(
                dt,
                velocity_iterations,
                position_iterations,
                self.pre_solve,
                self.pre_solve_bodies,
                self._pre_solve_errors,
            )
        return None if ids is None else StepReport(tuple(ids[0]), tuple(ids[1]))

    def find_new_contacts(self) -> None:
        """Searches for pairs of fixtures that may touch, which the next step would do otherwise.

        The first search takes as long as many steps if there are many edges. The results of the
        next step are the same.

        Raises:
            StaleHandleError: The world is closed.
            WorldLockedError: The world is stepping.
        """
        self._core.find_new_contacts()

    def take_pre_solve_errors(self) -> list[BaseException]:
        """Returns what `pre_solve` raised since the last call, in order."""
        errors = self._pre_solve_errors
        self._pre_solve_errors = []
        return errors

    # -- bodies and joints -----------------------------------------------------------------

    def create_body(
        self,
        body_type: str,
        pose: Sequence[float],
        *,
        linear_damping: float = 0.0,
        angular_damping: float = 0.0,
    ) -> PhysicsBody:
        """Makes a body without fixtures, awake and at rest.

        Args:
            body_type: `static`, `kinematic` or `dynamic`.
            pose: (x, y, theta) of its origin in the world frame [m, rad].
            linear_damping: At least 0 [1/s].
            angular_damping: At least 0 [1/s].

        Raises:
            ValueError: An unknown type, a number that is not finite, or negative damping.
            StaleHandleError: The world is closed.
            WorldLockedError: The world is stepping.
        """
        x, y, theta = pose
        body = self._core.create_body(body_type, x, y, theta, linear_damping, angular_damping)
        return PhysicsBody(self, body)

    def create_revolute_joint(
        self,
        body_a: PhysicsBody,
        body_b: PhysicsBody,
        anchor_a: Sequence[float],
        anchor_b: Sequence[float],
        *,
        limits: tuple[float, float] | None = None,
        collide_connected: bool = False,
    ) -> PhysicsJoint:
        """Joins two bodies so that they turn about a common point.

        Args:
            body_a: First body.
            body_b: Second body, another one.
            anchor_a: The point in the frame of body A [m].
            anchor_b: The point in the frame of body B [m].
            limits: Lower and upper angle of B relative to A at creation [rad], None for no limits.
            collide_connected: Whether the two bodies collide with each other.

        Raises:
            ValueError: The bodies are one or of another world, a number is not finite, or the
                lower limit is above the upper one.
            StaleHandleError: A body is gone.
            WorldLockedError: The world is stepping.
        """
        self._check_own(body_a, body_b)
        ax, ay = anchor_a
        bx, by = anchor_b
        joint = self._core.create_revolute_joint(
            body_a.id, body_b.id, (ax, ay), (bx, by), limits, collide_connected
        )
        return PhysicsJoint(self, joint)

    def create_weld_joint(
        self,
        body_a: PhysicsBody,
        body_b: PhysicsBody,
        anchor_a: Sequence[float],
        anchor_b: Sequence[float],
        *,
        reference_angle: float = 0.0,
        frequency: float = 0.0,
        damping: float = 0.0,
        collide_connected: bool = False,
    ) -> PhysicsJoint:
        """Joins two bodies rigidly, or with an angular spring.

        Args:
            body_a: First body.
            body_b: Second body, another one.
            anchor_a: The common point in the frame of body A [m].
            anchor_b: The common point in the frame of body B [m].
            reference_angle: Angle of B relative to A at rest [rad].
            frequency: Of the spring [Hz], at least 0; 0 is rigid. The spring is tuned to the
                inertias that the bodies have now.
            damping: Damping ratio of the spring, at least 0; 1 is critical.
            collide_connected: Whether the two bodies collide with each other.

        Raises:
            ValueError: The bodies are one or of another world, a number is not finite or negative.
            StaleHandleError: A body is gone.
            WorldLockedError: The world is stepping.
        """
        self._check_own(body_a, body_b)
        ax, ay = anchor_a
        bx, by = anchor_b
        joint = self._core.create_weld_joint(
            body_a.id,
            body_b.id,
            (ax, ay),
            (bx, by),
            reference_angle,
            frequency,
            damping,
            collide_connected,
        )
        return PhysicsJoint(self, joint)

    def _check_own(self, *bodies: PhysicsBody) -> None:
        for body in bodies:
            if body.world is not self:
                raise ValueError("a joint must connect bodies of its own world")

    # -- handles by id ---------------------------------------------------------------------

    def body(self, body_id: int) -> PhysicsBody:
        """Returns the handle of a body by its id, without a look whether it is there."""
        return PhysicsBody(self, body_id)

    def fixture(self, fixture_id: int) -> PhysicsFixture:
        """Returns the handle of a fixture by its id, without a look whether it is there."""
        return PhysicsFixture(self, fixture_id)

    def joint(self, joint_id: int) -> PhysicsJoint:
        """Returns the handle of a joint by its id, without a look whether it is there."""
        return PhysicsJoint(self, joint_id)

    # -- rays ------------------------------------------------------------------------------

    def ray_cast(
        self, start: Sequence[float], end: Sequence[float], mask: int = ALL_BITS
    ) -> RayHit | None:
        """Casts one ray by `b2World::RayCast`.

        A ray that starts inside a circle or polygon does not hit it; sensors are never hit.

        Args:
            start: World frame [m].
            end: World frame [m].
            mask: Category bits that stop the ray.

        Returns:
            The nearest hit, or None; always None for a ray of no length.

        Raises:
            ValueError: A number is not finite.
            StaleHandleError: The world is closed.
            WorldLockedError: The world is stepping.
        """
        start_x, start_y = start
        end_x, end_y = end
        hit = self._core.ray_cast(start_x, start_y, end_x, end_y, mask)
        if hit is None:
            return None
        fraction, point, normal, fixture, category_bits = hit
        return RayHit(fraction, point, normal, PhysicsFixture(self, fixture), category_bits)

    def cast_rays(
        self, pose: Pose, ends: npt.ArrayLike, mask: int, reflect_mask: int = 0
    ) -> tuple[FloatArray, BoolArray]:
        """Casts one ray from a sensor to each end point; other Python threads run meanwhile.

        The nearest fixture counts that is no sensor and has a category in `mask`. A ray that
        starts inside a circle or polygon does not hit it; edges are hit from both sides.

        Args:
            pose: (x, y, theta) of the sensor in the world frame [m, rad].
            ends: End points in the sensor frame [m], shape (n, 2), float32.
            mask: Category bits that stop a ray.
            reflect_mask: Category bits that reflect; 0 when nobody asks.

        Returns:
            How far each ray got, as a fraction of its length in [0, 1], NaN for a miss and for a
            ray of no length, shape (n,); and for each ray whether a fixture that stops it and has
            a category in `reflect_mask` is at that distance, within 1e-4 m + 1e-5 of the length.

        Raises:
            ValueError: A shape is wrong or a number is not finite.
            StaleHandleError: The world is closed.
            WorldLockedError: The world is stepping.
        """
        return self._core.cast_rays(pose, ends, mask, reflect_mask)

    def cast_rays_reference(
        self, pose: Pose, ends: npt.ArrayLike, mask: int, reflect_mask: int = 0
    ) -> tuple[FloatArray, BoolArray]:
        """Does what `cast_rays` does by one `b2World::RayCast` a ray: slow, for comparison."""
        return self._core.cast_rays_reference(pose, ends, mask, reflect_mask)

    # -- overlaps --------------------------------------------------------------------------

    def overlapping_bodies(
        self,
        bodies: Sequence[PhysicsBody],
        pose: Pose,
        *,
        ignored: Iterable[PhysicsBody] = (),
        least_gap: float = 0.0,
    ) -> list[PhysicsBody]:
        """Returns the other bodies that some bodies would overlap at a pose.

        Only fixtures that the solver would collide count: no sensors, category and mask bits that
        match, at least one dynamic body of the two, no joint that excludes the collision. Shapes
        are measured without the skin that Box2D puts around polygons and edges. Edges have no
        inside: a closed loop of them overlaps only what crosses it.

        Args:
            bodies: They move together, at least one.
            pose: (x, y, theta) of the first one in the world frame [m, rad].
            ignored: Bodies that may be overlapped.
            least_gap: Two fixtures that are closer than this overlap [m]; a negative one is how
                deep they may penetrate.

        Raises:
            ValueError: There is no body, or a number is not finite.
            StaleHandleError: A body was destroyed, or the world is closed.
            WorldLockedError: The world is stepping.
        """
        found = self._core.overlapping_bodies(_ids(bodies), pose, _ids(ignored), least_gap)
        return [PhysicsBody(self, body) for body in found]

    def free_poses(
        self,
        bodies: Sequence[PhysicsBody],
        poses: npt.ArrayLike,
        *,
        ignored: Iterable[PhysicsBody] = (),
        least_gap: float = 0.0,
    ) -> BoolArray:
        """Returns at which poses some bodies would overlap nothing; see `overlapping_bodies`.

        Other Python threads run meanwhile.

        Args:
            bodies: They move together, at least one.
            poses: (x, y, theta) of the first one in the world frame [m, rad], shape (n, 3).
            ignored: Bodies that may be overlapped.
            least_gap: Two fixtures that are closer than this overlap [m].

        Returns:
            Shape (n,).

        Raises:
            ValueError: There is no body, a shape is wrong or a number is not finite.
            StaleHandleError: A body was destroyed, or the world is closed.
            WorldLockedError: The world is stepping.
        """
        return self._core.free_poses(_ids(bodies), poses, _ids(ignored), least_gap)

    def free_discs(
        self,
        poses: npt.ArrayLike,
        radius: float,
        bits: int,
        *,
        ignored: Iterable[PhysicsBody] = (),
        only: Iterable[PhysicsBody] | None = None,
        least_gap: float = 0.0,
    ) -> BoolArray:
        """Returns where a disc would overlap nothing; see `free_poses`.

        Args:
            poses: (x, y, theta) of its centre in the world frame [m, rad], shape (n, 3).
            radius: Of the disc [m], at least 0.
            bits: Category and mask bits of the disc.
            ignored: Bodies that may be overlapped.
            only: All other bodies may be overlapped, too; None for no such limit.
            least_gap: A fixture that is closer to the disc than this overlaps it [m].

        Returns:
            Shape (n,).

        Raises:
            ValueError: A shape is wrong or a number is out of range.
            StaleHandleError: A body was destroyed, or the world is closed.
            WorldLockedError: The world is stepping.
        """
        only_ids = None if only is None else _ids(only)
        return self._core.free_discs(poses, radius, bits, _ids(ignored), only_ids, least_gap)

    # -- contacts --------------------------------------------------------------------------

    @property
    def record_contacts(self) -> bool:
        """Whether steps record contact events; settable."""
        return self._core.record_contacts

    @record_contacts.setter
    def record_contacts(self, record: bool) -> None:
        self._core.record_contacts = record

    def take_contact_events(self) -> list[ContactEvent]:
        """Returns what happened since the last call, in order.

        Raises:
            StaleHandleError: The world is closed.
            WorldLockedError: The world is stepping.
        """
        columns = self._core.take_contact_rows()
        return [] if columns is None else to_events(columns)

    def contacts(self) -> list[ContactInfo]:
        """Returns all pairs of fixtures that touch now.

        Raises:
            StaleHandleError: The world is closed.
            WorldLockedError: The world is stepping.
        """
        columns = self._core.touching_rows()
        return [] if columns is None else to_infos(columns)


def _ids(bodies: Iterable[PhysicsBody]) -> list[int]:
    return [body.id for body in bodies]
