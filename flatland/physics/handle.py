"""Base class of handles."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flatland.physics.world import PhysicsWorld


class Handle:
    """Reference to an object of a physics world, by an id that is unique in the world.

    Two handles are equal if they refer to the same object.
    """

    __slots__ = ("_core", "id", "world")

    def __init__(self, world: PhysicsWorld, handle_id: int) -> None:
        """Creates a handle without checking that the object exists.

        Args:
            world: World that contains the object.
            handle_id: Id of the object in the world.
        """
        self.world = world
        self.id = handle_id
        self._core = world._core

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Handle):
            return NotImplemented
        return self.id == other.id and self._core is other._core

    def __hash__(self) -> int:
        return hash((id(self._core), self.id))

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.id:#x}>"
