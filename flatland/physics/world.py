"""The physics world."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from flatland import _core
from flatland.geometry import DoubleArray, FloatArray
from flatland.physics.body import PhysicsBody
from flatland.physics.contact_queries import ContactQueries
from flatland.physics.controller import RollingWheel, WheelsController
from flatland.physics.fixture import PhysicsFixture
from flatland.physics.joint import PhysicsJoint
from flatland.physics.plan import StepPlan
from flatland.physics.queries import PhysicsQueries

PreSolveHook = Callable[[_core.PreSolveContact, _core.OldManifold], object]


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


class PhysicsWorld(ContactQueries, PhysicsQueries):
    """A Box2D world without gravity; owns its bodies, fixtures, joints and contacts.

    Worlds are independent: different threads may step different worlds at the same time.

    Attributes:
        pre_solve: Function called as `pre_solve(contact, old_manifold)` within `step`, before the
            solver processes a contact of one of `pre_solve_bodies`; None for no function. The
            function may set `enabled`, `friction`, `restitution` and `tangent_speed` of the
            contact and read the world, but not change the world. In a step that reports invalid
            bodies, numbers of contacts may be NaN. `take_pre_solve_errors` returns the exceptions
            that it raises.
        pre_solve_bodies: Ids of the bodies whose contacts are passed to `pre_solve`. Contacts of
            other bodies cause no overhead.
        plan: What the steps of a `flatland.World` do besides the physics; `step` ignores it.
    """

    __slots__ = ("_pre_solve_errors", "plan", "pre_solve", "pre_solve_bodies")

    def __init__(self) -> None:
        """Creates an empty world."""
        self._core = _core.World()
        self.plan = StepPlan(self._core)
        self.pre_solve: PreSolveHook | None = None
        self.pre_solve_bodies: set[int] = set()
        self._pre_solve_errors: list[BaseException] = []

    def close(self) -> None:
        """Destroys the world and all objects in it; idempotent.

        Raises:
            WorldLockedError: The world is stepping.
        """
        self._core.close()
        self.pre_solve = None

    @property
    def closed(self) -> bool:
        """Whether the world is closed."""
        return self._core.closed

    # -- copies ----------------------------------------------------------------------------

    def copy(self) -> PhysicsWorld:
        """Returns an independent copy with the same ids and without a function `pre_solve`.

        The copy is exact: the same calls have the same results, bit by bit. It shares only what
        never changes: trees of edges and sorted rays. Copies may be used in different threads.

        Raises:
            StaleHandleError: The world is closed.
            WorldLockedError: The world is stepping.
        """
        copy = type(self)()
        copy._core = self._core.copy()
        copy.plan = StepPlan(copy._core)
        copy.plan.is_used = self.plan.is_used
        return copy

    def become_copy_of(self, source: PhysicsWorld) -> None:
        """Replaces all objects by exact copies of those of another world, with the same ids.

        Handles of objects whose ids do not exist in the other world become stale, and their ids are
        not used again.

        Args:
            source: The other world, such as an earlier copy of this one.

        Raises:
            StaleHandleError: One of the worlds is closed.
            WorldLockedError: One of the worlds is stepping.
        """
        self._core.become_copy_of(source._core)
        self.plan.is_used = self.plan.is_used or source.plan.is_used

    def clear(self) -> None:
        """Destroys all objects; the results of the same further calls are those of a new world.

        Raises:
            StaleHandleError: The world is closed.
            WorldLockedError: The world is stepping.
        """
        self._core.clear()

    def step(
        self, dt: float, velocity_iterations: int, position_iterations: int
    ) -> StepReport | None:
        """Advances the world by one time step.

        Releases the GIL if the previous step took more than 0.1 ms.

        Contacts add no energy: a dynamic body without joints that touches only static bodies is
        at most 1 % and 0.01 m/s faster after a step than before this step or the previous one.
        Bodies that touch each other or are joined are together at most twice as fast and 0.1 m/s.
        Forces, springs, restitution above 1 and moving kinematic bodies are allowed for. Box2D
        alone breaks this where bodies have no room; then they are slowed down and reported. A
        contact that is updated more than 6 times in one step, while Box2D handles times of impact,
        has its bodies reported; it is disabled for the rest of the step after 6 updates, and
        after 20 in the first ten successive steps.

        Args:
            dt: Duration of the time step, from 1e-6 to 1000 [s].
            velocity_iterations: Velocity iterations of the Box2D solver, at least 0.
            position_iterations: Position iterations of the Box2D solver, at least 0.

        Returns:
            None, or which bodies were limited or are invalid. The world does not advance while a
            body is invalid, and each step reports the body again: set its pose and its velocity,
            or destroy it.

        Raises:
            ValueError: A number is out of range.
            StaleHandleError: The world is closed.
            WorldLockedError: The world is in use by another thread, or the caller is `pre_solve`.
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
        return to_report(ids)

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
        """Returns the exceptions that `pre_solve` raised since the last call, in order."""
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
        """Creates a body without fixtures, awake and at rest.

        Args:
            body_type: Type of the body: `static`, `kinematic` or `dynamic`.
            pose: Pose (x, y, theta) of the origin of the body in the world frame [m, rad].
            linear_damping: Linear damping coefficient, at least 0 [1/s].
            angular_damping: Angular damping coefficient, at least 0 [1/s].

        Returns:
            The new body.

        Raises:
            ValueError: The type is unknown, a number is not finite, or a damping is negative.
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
        """Creates a joint that lets two bodies rotate about a common point.

        Args:
            body_a: First body.
            body_b: Second body, different from the first one.
            anchor_a: Common point in the frame of body A [m].
            anchor_b: Common point in the frame of body B [m].
            limits: Lower and upper angle of B relative to A, measured from their relative angle at
                creation [rad]; None for no limits.
            collide_connected: Whether the two bodies collide with each other.

        Returns:
            The new joint.

        Raises:
            ValueError: The bodies are identical or in another world, a number is not finite, or
                the lower limit is greater than the upper limit.
            StaleHandleError: A body was destroyed.
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
        """Creates a joint that connects two bodies rigidly or by an angular spring.

        Args:
            body_a: First body.
            body_b: Second body, different from the first one.
            anchor_a: Common point in the frame of body A [m].
            anchor_b: Common point in the frame of body B [m].
            reference_angle: Angle of B relative to A at rest [rad].
            frequency: Frequency of the spring, at least 0 [Hz]; 0 for a rigid joint. The stiffness
                of the spring is computed from the moments of inertia of the bodies at this time.
            damping: Damping ratio of the spring, at least 0; 1 for critical damping.
            collide_connected: Whether the two bodies collide with each other.

        Returns:
            The new joint.

        Raises:
            ValueError: The bodies are identical or in another world, or a number is not finite, or
                the frequency or damping is negative.
            StaleHandleError: A body was destroyed.
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

    def measure_wheels(self, wheels: Sequence[RollingWheel]) -> WheelsController:
        """Creates a controller that measures how far wheels roll; not carried out yet.

        Args:
            wheels: The wheels, at least one.

        Raises:
            ValueError: There is no wheel, or a radius is not positive.
            StaleHandleError: A body was destroyed.
            WorldLockedError: The world is stepping.
        """
        self.plan.is_used = True
        rows = [(w.body.id, *w.position, w.heading, w.radius, w.slide) for w in wheels]
        return WheelsController(self, self._core.add_rolling_wheels(rows))

    def _check_own(self, *bodies: PhysicsBody) -> None:
        for body in bodies:
            if body.world is not self:
                raise ValueError("a joint must connect bodies of its own world")

    def object_counts(self) -> ObjectCounts:
        """Returns the numbers of objects.

        Raises:
            StaleHandleError: The world is closed.
            WorldLockedError: The world is stepping.
        """
        return ObjectCounts(*self._core.object_counts())

    def body_states(self) -> FloatArray:
        """Returns the states of all bodies in order of creation, exactly as Box2D stores them.

        Returns:
            Position of the origin (x, y) and angle, centre of mass (x, y), velocity of the centre
            of mass (vx, vy, omega), all in the world frame [m, rad, s], and 1 if the body is awake,
            else 0; shape (n, 9).

        Raises:
            StaleHandleError: The world is closed.
            WorldLockedError: The world is stepping.
        """
        return self._core.body_states()

    def saved_motions(self) -> _core.World.SavedMotions:
        """Returns the poses, velocities and sleep of all bodies, for `restore_motions`."""
        return self._core.saved_motions()

    def restore_motions(self, saved: _core.World.SavedMotions) -> None:
        """Restores poses, velocities and sleep bit by bit.

        Args:
            saved: Result of `saved_motions`. Bodies that do not exist any more are ignored, and
                bodies that were created since are unchanged.
        """
        self._core.restore_motions(saved)

    def motions(self, bodies: Iterable[PhysicsBody]) -> DoubleArray:
        """Returns the poses and velocities of the origins of some bodies, in one call.

        Args:
            bodies: The bodies.

        Returns:
            (x, y, theta, vx, vy, omega) of each body in the world frame [m, rad, s], shape (n, 6).

        Raises:
            StaleHandleError: A body was destroyed, or the world is closed.
            WorldLockedError: The world is stepping.
        """
        return self._core.motions([body.id for body in bodies])

    # -- handles by id ---------------------------------------------------------------------

    def body(self, body_id: int) -> PhysicsBody:
        """Returns the handle of a body by its id, without checking that the body exists."""
        return PhysicsBody(self, body_id)

    def fixture(self, fixture_id: int) -> PhysicsFixture:
        """Returns the handle of a fixture by its id, without checking that the fixture exists."""
        return PhysicsFixture(self, fixture_id)

    def joint(self, joint_id: int) -> PhysicsJoint:
        """Returns the handle of a joint by its id, without checking that the joint exists."""
        return PhysicsJoint(self, joint_id)
