"""What all handles have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flatland.physics.world import PhysicsWorld


class Handle:
    """Something in a physics world: the world, and an id that is never used twice in it."""

    __slots__ = ("_core", "id", "world")

    def __init__(self, world: PhysicsWorld, handle_id: int) -> None:
        """Names a thing of a world; does not look whether it is there."""
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
