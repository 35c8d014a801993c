"""Collectors of contacts, which call no Python code at each contact."""

from __future__ import annotations

from typing import NamedTuple

from flatland.geometry import Vector2
from flatland.physics.handle import Handle


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


class Touches(Handle):
    """The contacts of some bodies; created by `PhysicsWorld.collect_touches`.

    The core collects them in each step. All members except `alive` raise `StaleHandleError` once
    the collector is removed or the world is closed.

    Attributes:
        id: Id of the collector, never reused in its world.
        world: Physics world that contains the bodies.
    """

    __slots__ = ()

    @property
    def alive(self) -> bool:
        """Whether the collector exists."""
        return self._core.has_touches(self.id)

    def remove(self) -> None:
        """Ends the collection.

        Raises:
            StaleHandleError: The collector has already been removed.
            WorldLockedError: The world is stepping.
        """
        self._core.remove_touches(self.id)

    @property
    def touched(self) -> bool:
        """Whether there are contacts now, or one began since the last call of `clear`."""
        return self._core.is_touched(self.id)

    @property
    def began(self) -> bool:
        """Whether a contact began since the last call of `clear`."""
        return self._core.was_touched(self.id)

    def clear(self) -> None:
        """Discards the contacts that have ended; those that exist remain."""
        self._core.clear_touches(self.id)

    def __len__(self) -> int:
        """Returns the number of contacts that exist now."""
        return self._core.count_touches(self.id)

    def __bool__(self) -> bool:
        """Returns True, also without contacts."""
        return True

    def read(self) -> list[Touch]:
        """Returns the contacts that exist now, the oldest first."""
        return [Touch(*row) for row in self._core.touch_rows(self.id)]

    def end_runs(self, ends_runs: bool) -> None:
        """Sets whether a run of steps ends after each step with contacts; for schedules."""
        self._core.end_runs_at_touches(self.id, ends_runs)
