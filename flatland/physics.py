"""Box2D behind handles: the physics world, its bodies, fixtures, joints and contacts.

Everything else of flatland reaches the C++ core through this module. A handle holds its world and
an id. The world owns what the id stands for; once that is destroyed, or the world closed, every
use of the handle raises `StaleHandleError`. While a world steps, or makes edges, any use of it from
another thread raises `WorldLockedError`.

All lengths are in metres, angles in radians, times in seconds, masses in kilograms; numbers must
be finite and within +-1e9. Box2D computes in single precision.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from flatland import _core
from flatland._core import OldManifold, PreSolveContact

__all__ = [
    "ContactEvent",
    "ContactInfo",
    "OldManifold",
    "PhysicsBody",
    "PhysicsFixture",
    "PhysicsJoint",
    "PhysicsWorld",
    "PreSolveContact",
    "RayHit",
]

Pose = tuple[float, float, float]
Vector2 = tuple[float, float]
FloatArray = npt.NDArray[np.float32]
DoubleArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
PreSolveHook = Callable[[PreSolveContact, OldManifold], object]

BodyType = Literal["static", "kinematic", "dynamic"]
ContactKind = Literal["begin", "end", "post_solve"]

_ALL_BITS: Final = 0xFFFF
_CONTACT_KINDS: Final[tuple[ContactKind, ContactKind, ContactKind]] = ("begin", "end", "post_solve")


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


@dataclass(frozen=True, slots=True, eq=False)
class ContactEvent:
    """Something that happened between two fixtures during a step, as it was at that moment.

    Attributes:
        kind: `begin`, `end` or `post_solve`.
        contact_id: Unique for as long as the two fixtures touch.
        fixture_a: Id of a fixture.
        fixture_b: Id of the other one.
        body_a: Id of the first fixture's body.
        body_b: Id of the second fixture's body.
        points: World frame [m], shape (k, 2), k from 0 to 2; none for sensors and shapes apart.
        normal: Unit vector from A to B, world frame, shape (2,); zeros without points.
        normal_impulses: Along the normal at each point [N s], shape (k,); 0 unless `post_solve`.
        tangent_impulses: Along the surface at each point [N s], shape (k,).
        is_sensor: Whether one of the fixtures is a sensor.
    """

    kind: ContactKind
    contact_id: int
    fixture_a: int
    fixture_b: int
    body_a: int
    body_b: int
    points: DoubleArray
    normal: DoubleArray
    normal_impulses: DoubleArray
    tangent_impulses: DoubleArray
    is_sensor: bool


@dataclass(frozen=True, slots=True, eq=False)
class ContactInfo:
    """Two fixtures that touch now.

    Attributes:
        contact_id: Unique for as long as the two fixtures touch.
        fixture_a: Id of a fixture.
        fixture_b: Id of the other one.
        body_a: Id of the first fixture's body.
        body_b: Id of the second fixture's body.
        points: World frame [m], shape (k, 2), k from 0 to 2; none for sensors.
        normal: Unit vector from A to B, world frame, shape (2,); zeros without points.
        is_sensor: Whether one of the fixtures is a sensor.
    """

    contact_id: int
    fixture_a: int
    fixture_b: int
    body_a: int
    body_b: int
    points: DoubleArray
    normal: DoubleArray
    is_sensor: bool


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

    def step(self, dt: float, velocity_iterations: int, position_iterations: int) -> None:
        """Advances the world; other Python threads run meanwhile.

        Args:
            dt: Simulated time of the step [s], from 1e-6 to 1000.
            velocity_iterations: Of Box2D's solver, at least 0.
            position_iterations: Of Box2D's solver, at least 0.

        Raises:
            ValueError: A number is out of range.
            StaleHandleError: The world is closed.
            WorldLockedError: Another thread uses the world, or this is a `pre_solve` call.
        """
        if self.pre_solve is None:
            self._core.step(dt, velocity_iterations, position_iterations)
        else:
            self._core.step_with_hook(
                dt,
                velocity_iterations,
                position_iterations,
                self.pre_solve,
                self.pre_solve_bodies,
                self._pre_solve_errors,
            )

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

    # -- rays ------------------------------------------------------------------------------

    def ray_cast(
        self, start: Sequence[float], end: Sequence[float], mask: int = _ALL_BITS
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
        if columns is None:
            return []
        kinds, ids, counts, points, normals, impulses, sensors = columns
        is_sensor = sensors.tolist()
        kind = kinds.tolist()
        return [
            ContactEvent(
                _CONTACT_KINDS[kind[i]],
                contact,
                fixture_a,
                fixture_b,
                body_a,
                body_b,
                points[i, :count],
                normals[i],
                impulses[i, 0, :count],
                impulses[i, 1, :count],
                is_sensor[i],
            )
            for i, ((contact, fixture_a, fixture_b, body_a, body_b), count) in enumerate(
                zip(ids.tolist(), counts.tolist(), strict=True)
            )
        ]

    def contacts(self) -> list[ContactInfo]:
        """Returns all pairs of fixtures that touch now.

        Raises:
            StaleHandleError: The world is closed.
            WorldLockedError: The world is stepping.
        """
        columns = self._core.touching_rows()
        if columns is None:
            return []
        _, ids, counts, points, normals, _, sensors = columns
        is_sensor = sensors.tolist()
        return [
            ContactInfo(
                contact,
                fixture_a,
                fixture_b,
                body_a,
                body_b,
                points[i, :count],
                normals[i],
                is_sensor[i],
            )
            for i, ((contact, fixture_a, fixture_b, body_a, body_b), count) in enumerate(
                zip(ids.tolist(), counts.tolist(), strict=True)
            )
        ]


class _Handle:
    """Something in a physics world: the world, and an id that is never used twice in it."""

    __slots__ = ("_core", "id", "world")

    def __init__(self, world: PhysicsWorld, handle_id: int) -> None:
        """Names a thing of a world; does not look whether it is there."""
        self.world = world
        self.id = handle_id
        self._core = world._core

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, _Handle):
            return NotImplemented
        return self.id == other.id and self._core is other._core

    def __hash__(self) -> int:
        return hash((id(self._core), self.id))

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.id:#x}>"


class PhysicsBody(_Handle):
    """Handle of a rigid body; every use raises `StaleHandleError` once it is destroyed.

    Attributes:
        id: Its number in the world, never used again for another body.
        world: The world it is in.
    """

    __slots__ = ()

    @property
    def alive(self) -> bool:
        """Whether the body is still there."""
        return self._core.has_body(self.id)

    def destroy(self) -> None:
        """Takes the body out of the world, with its fixtures and joints; contacts end.

        Raises:
            StaleHandleError: It is gone already.
            WorldLockedError: The world is stepping.
        """
        self._core.destroy_body(self.id)

    @property
    def type(self) -> str:
        """`static`, `kinematic` or `dynamic`."""
        return self._core.body_type(self.id)

    @property
    def pose(self) -> Pose:
        """(x, y, theta) of the body's origin in the world frame [m, rad]."""
        return self._core.pose(self.id)

    def set_pose(self, x: float, y: float, theta: float) -> None:
        """Puts the body's origin at a pose in the world frame and wakes the body.

        Raises:
            ValueError: A number is not finite.
            StaleHandleError: The body is gone.
            WorldLockedError: The world is stepping.
        """
        self._core.set_pose(self.id, x, y, theta)

    @property
    def velocity(self) -> Pose:
        """(vx, vy, omega) of the body's origin in the world frame [m/s, rad/s]."""
        return self._core.velocity(self.id)

    def set_velocity(self, vx: float, vy: float, omega: float) -> None:
        """Makes the body's origin move at (vx, vy), and the body turn at omega, world frame.

        Without effect on static bodies.

        Raises:
            ValueError: A number is not finite.
            StaleHandleError: The body is gone.
            WorldLockedError: The world is stepping.
        """
        self._core.set_velocity(self.id, vx, vy, omega)

    def apply_force(self, force: Sequence[float], point: Sequence[float]) -> None:
        """Applies a force to a dynamic body for the next step, and wakes it.

        Args:
            force: World frame [N].
            point: Where it acts, world frame [m].

        Raises:
            ValueError: A number is not finite, or the force is too large for the body's mass.
            StaleHandleError: The body is gone.
            WorldLockedError: The world is stepping.
        """
        fx, fy = force
        px, py = point
        self._core.apply_force(self.id, fx, fy, px, py)

    def apply_torque(self, torque: float) -> None:
        """Applies a torque about z [N m] to a dynamic body for the next step, and wakes it.

        Raises:
            ValueError: It is not finite, or too large for the body's inertia.
            StaleHandleError: The body is gone.
            WorldLockedError: The world is stepping.
        """
        self._core.apply_torque(self.id, torque)

    @property
    def awake(self) -> bool:
        """Whether the body is simulated; settable. Falling asleep sets its velocity to zero."""
        return self._core.awake(self.id)

    @awake.setter
    def awake(self, value: bool) -> None:
        self._core.set_awake(self.id, value)

    @property
    def mass(self) -> float:
        """Mass [kg]; 0 for bodies that are not dynamic."""
        return self._core.mass(self.id)

    @property
    def inertia(self) -> float:
        """Moment of inertia about the body's origin [kg m^2]."""
        return self._core.inertia(self.id)

    @property
    def local_center(self) -> Vector2:
        """Centre of mass in the body frame [m]."""
        return self._core.local_center(self.id)

    @property
    def world_center(self) -> Vector2:
        """Centre of mass in the world frame [m]."""
        return self._core.world_center(self.id)

    @property
    def linear_damping(self) -> float:
        """Linear damping [1/s]."""
        return self._core.linear_damping(self.id)

    @property
    def angular_damping(self) -> float:
        """Angular damping [1/s]."""
        return self._core.angular_damping(self.id)

    @property
    def fixtures(self) -> list[PhysicsFixture]:
        """All fixtures in the order in which they were made."""
        return [PhysicsFixture(self.world, i) for i in self._core.fixtures(self.id)]

    def fixture(self, fixture_id: int) -> PhysicsFixture:
        """Returns the handle of a fixture of this world; it may be stale."""
        return PhysicsFixture(self.world, fixture_id)

    @property
    def joints(self) -> list[PhysicsJoint]:
        """All joints that hold this body, in the order in which they were made."""
        return [PhysicsJoint(self.world, i) for i in self._core.joints(self.id)]

    def create_circle(
        self,
        center: Sequence[float],
        radius: float,
        *,
        density: float,
        friction: float = 0.0,
        restitution: float = 0.0,
        is_sensor: bool = False,
        category_bits: int = _ALL_BITS,
        mask_bits: int = _ALL_BITS,
    ) -> PhysicsFixture:
        """Adds a circle.

        Args:
            center: In the body frame [m].
            radius: At least 0 [m]; 0 makes a point without mass.
            density: At least 0 [kg/m^2].
            friction: At least 0.
            restitution: At least 0.
            is_sensor: Whether it only detects contacts.
            category_bits: What it is, 16 bits.
            mask_bits: What it collides with, 16 bits.

        Raises:
            ValueError: A number is out of range, or the body's mass would be.
            StaleHandleError: The body is gone.
            WorldLockedError: The world is stepping.
        """
        x, y = center
        fixture = self._core.create_circle(
            self.id,
            x,
            y,
            radius,
            density,
            friction,
            restitution,
            is_sensor,
            category_bits,
            mask_bits,
        )
        return PhysicsFixture(self.world, fixture)

    def create_polygon(
        self,
        points: npt.ArrayLike,
        *,
        density: float,
        friction: float = 0.0,
        restitution: float = 0.0,
        is_sensor: bool = False,
        category_bits: int = _ALL_BITS,
        mask_bits: int = _ALL_BITS,
    ) -> PhysicsFixture:
        """Adds the convex hull of some points.

        Args:
            points: 3 to 8 points in the body frame [m], shape (k, 2). Points nearer than 2.5 mm
                to an earlier one are dropped, as Box2D does it.
            density: At least 0 [kg/m^2].
            friction: At least 0.
            restitution: At least 0.
            is_sensor: Whether it only detects contacts.
            category_bits: What it is, 16 bits.
            mask_bits: What it collides with, 16 bits.

        Raises:
            ValueError: Wrong shape, too few points apart from each other, no area, a number out
                of range, or the body's mass would be.
            StaleHandleError: The body is gone.
            WorldLockedError: The world is stepping.
        """
        fixture = self._core.create_polygon(
            self.id,
            points,
            density,
            friction,
            restitution,
            is_sensor,
            category_bits,
            mask_bits,
        )
        return PhysicsFixture(self.world, fixture)

    def create_edges(
        self,
        edges: npt.ArrayLike,
        *,
        friction: float = 0.0,
        restitution: float = 0.0,
        category_bits: int = _ALL_BITS,
        mask_bits: int = _ALL_BITS,
    ) -> int:
        """Adds many two-sided edges, each a fixture; other Python threads run meanwhile.

        Args:
            edges: (x1, y1, x2, y2) in the body frame [m], shape (n, 4), float32. Edges shorter
                than 1.2e-7 m have no direction and are left out: nothing could ever hit them.
            friction: At least 0.
            restitution: At least 0.
            category_bits: What they are, 16 bits.
            mask_bits: What they collide with, 16 bits.

        Returns:
            How many were made.

        Raises:
            ValueError: A shape is wrong or a number out of range; nothing was made.
            StaleHandleError: The body is gone.
            WorldLockedError: The world is stepping.
        """
        return self._core.create_edges(
            self.id,
            edges,
            friction,
            restitution,
            category_bits,
            mask_bits,
        )

    def edges(self) -> FloatArray:
        """Returns its edge fixtures (x1, y1, x2, y2) in the body frame [m], shape (n, 4)."""
        return self._core.edges(self.id)


class PhysicsFixture(_Handle):
    """Handle of a fixture; every use raises `StaleHandleError` once its body is destroyed.

    Attributes:
        id: Its number in the world, never used again for another fixture.
        world: The world it is in.
    """

    __slots__ = ()

    @property
    def alive(self) -> bool:
        """Whether the fixture is still there."""
        return self._core.has_fixture(self.id)

    @property
    def body(self) -> PhysicsBody:
        """The body it belongs to."""
        return PhysicsBody(self.world, self._core.fixture_body(self.id))

    @property
    def shape(self) -> str:
        """`circle`, `polygon` or `edge`."""
        return self._core.fixture_shape(self.id)

    @property
    def vertices(self) -> DoubleArray:
        """Corners of a polygon, counter-clockwise, or ends of an edge, body frame [m], (n, 2)."""
        return self._core.fixture_vertices(self.id)

    @property
    def center(self) -> Vector2:
        """Centre of a circle, centroid of a polygon, middle of an edge, body frame [m]."""
        return self._core.fixture_center(self.id)

    @property
    def radius(self) -> float:
        """Radius of a circle [m], 0 for other shapes."""
        return self._core.fixture_radius(self.id)

    @property
    def density(self) -> float:
        """Density [kg/m^2]."""
        return self._core.fixture_density(self.id)

    @property
    def friction(self) -> float:
        """Friction coefficient."""
        return self._core.fixture_friction(self.id)

    @property
    def restitution(self) -> float:
        """Restitution coefficient."""
        return self._core.fixture_restitution(self.id)

    @property
    def is_sensor(self) -> bool:
        """Whether it only detects contacts and is not seen by rays; settable."""
        return self._core.fixture_is_sensor(self.id)

    @is_sensor.setter
    def is_sensor(self, value: bool) -> None:
        self._core.set_fixture_is_sensor(self.id, value)

    @property
    def category_bits(self) -> int:
        """What it is, 16 bits; settable."""
        return self._core.fixture_filter(self.id)[0]

    @category_bits.setter
    def category_bits(self, bits: int) -> None:
        self._core.set_fixture_filter(self.id, bits, self.mask_bits)

    @property
    def mask_bits(self) -> int:
        """What it collides with, 16 bits; settable."""
        return self._core.fixture_filter(self.id)[1]

    @mask_bits.setter
    def mask_bits(self, bits: int) -> None:
        self._core.set_fixture_filter(self.id, self.category_bits, bits)


class PhysicsJoint(_Handle):
    """Handle of a joint; every use raises `StaleHandleError` once it or a body is destroyed.

    Attributes:
        id: Its number in the world, never used again for another joint.
        world: The world it is in.
    """

    __slots__ = ()

    @property
    def alive(self) -> bool:
        """Whether the joint is still there."""
        return self._core.has_joint(self.id)

    def destroy(self) -> None:
        """Takes the joint out of the world and wakes its bodies.

        Raises:
            StaleHandleError: It is gone already.
            WorldLockedError: The world is stepping.
        """
        self._core.destroy_joint(self.id)

    @property
    def type(self) -> str:
        """`revolute` or `weld`."""
        return self._core.joint_type(self.id)

    @property
    def body_a(self) -> PhysicsBody:
        """The first body."""
        return PhysicsBody(self.world, self._core.joint_bodies(self.id)[0])

    @property
    def body_b(self) -> PhysicsBody:
        """The second body."""
        return PhysicsBody(self.world, self._core.joint_bodies(self.id)[1])

    @property
    def anchors(self) -> DoubleArray:
        """Anchor of each body in its frame [m], shape (2, 2)."""
        return np.array(self._core.joint_anchors(self.id))

    @property
    def collide_connected(self) -> bool:
        """Whether the two bodies collide with each other."""
        return self._core.joint_collide_connected(self.id)

    @property
    def limits(self) -> tuple[float, float] | None:
        """Lower and upper angle of a revolute joint [rad], None without limits and for welds."""
        return self._core.joint_limits(self.id)

    def set_limits(self, lower: float, upper: float) -> None:
        """Sets the limits of a revolute joint [rad].

        Raises:
            ValueError: A number is not finite, or the lower limit is above the upper one.
            PhysicsError: It is a weld joint.
            StaleHandleError: The joint is gone.
            WorldLockedError: The world is stepping.
        """
        self._core.set_joint_limits(self.id, (lower, upper))

    def clear_limits(self) -> None:
        """Takes the limits of a revolute joint away.

        Raises:
            PhysicsError: It is a weld joint.
            StaleHandleError: The joint is gone.
            WorldLockedError: The world is stepping.
        """
        self._core.set_joint_limits(self.id, None)

    @property
    def reference_angle(self) -> float:
        """Angle of body B relative to body A at rest [rad]."""
        return self._core.joint_reference_angle(self.id)

    @property
    def frequency(self) -> float:
        """Spring frequency of a weld joint [Hz], 0 when rigid."""
        return self._core.joint_frequency(self.id)

    @property
    def damping(self) -> float:
        """Damping ratio of a weld joint's spring."""
        return self._core.joint_damping(self.id)
