"""The physics world."""

from __future__ import annotations

from collections.abc import Callable

from flatland import _core
from flatland.physics.values import StepReport, to_report
from flatland.uncopied import uncopied

PreSolveHook = Callable[[_core.PreSolveContact, _core.OldManifold], object]


@uncopied("PhysicsWorld.copy() returns an independent copy")
class PhysicsWorld(_core.World):
    """A Box2D world without gravity; owns its bodies, fixtures, joints and contacts.

    Worlds are independent: different threads may step different worlds at the same time.

    Attributes:
        pre_solve_bodies: Ids of the bodies whose contacts are passed to `pre_solve`. Contacts of
            other bodies cause no overhead.
    """

    __slots__ = ("_pre_solve", "_pre_solve_errors", "pre_solve_bodies")

    def __init__(self) -> None:
        """Creates an empty world."""
        super().__init__()
        self._pre_solve: PreSolveHook | None = None
        self.pre_solve_bodies: set[int] = set()
        self._pre_solve_errors: list[BaseException] = []

    @property
    def pre_solve(self) -> PreSolveHook | None:
        """Function called before the solver processes a contact of one of `pre_solve_bodies`.

        It is called as `pre_solve(contact, old_manifold)` within `step`; None for no function;
        settable. The function may set `enabled`, `friction`, `restitution` and `tangent_speed` of
        the contact and read the world, but not change the world. In a step that reports invalid
        bodies, numbers of contacts may be NaN. `take_pre_solve_errors` returns the exceptions that
        it raises.
        """
        return self._pre_solve

    @pre_solve.setter
    def pre_solve(self, function: PreSolveHook | None) -> None:
        if function is not self._pre_solve:
            self._pre_solve = function
            self.jobs.interrupt()

    def close(self) -> None:
        """Destroys the world and all objects in it; idempotent.

        Raises:
            WorldLockedError: The world is stepping.
        """
        super().close()
        self.pre_solve = None

    def copy(self) -> PhysicsWorld:
        """Returns an independent copy with the same ids and without a function `pre_solve`.

        The copy is exact: the same calls have the same results, bit by bit. It shares only what
        never changes: trees of edges, sorted rays, and the walls after `share_walls`. Copies may
        be used in different threads.

        Raises:
            StaleHandleError: The world is closed.
            WorldLockedError: The world is stepping.
        """
        copy = type(self)()
        copy.become_copy_of(self)
        copy._share_fans(self)
        return copy

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
            return to_report(self._step(dt, velocity_iterations, position_iterations))
        return to_report(
            self._step_with_hook(
                dt,
                velocity_iterations,
                position_iterations,
                self.pre_solve,
                self.pre_solve_bodies,
                self._pre_solve_errors,
            )
        )

    def take_pre_solve_errors(self) -> list[BaseException]:
        """Returns the exceptions that `pre_solve` raised since the last call, in order."""
        errors = self._pre_solve_errors
        self._pre_solve_errors = []
        return errors
