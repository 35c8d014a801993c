"""Rooms with doors, into which furniture is placed without blocking the way."""

from __future__ import annotations

from typing import Final

import numpy as np

from flatland.worldgen.raster import FREE, FURNITURE, WALL, Raster, Rect
from flatland.worldgen.reach import Reach

DOOR_DEPTH: Final = 1.0  # free space behind a door [m]
_DOOR_SIDE: Final = 0.1  # free space beside a door [m]
_PORCH: Final = 1.0  # length of the free strip in front of a door, outside the room [m]


def narrowest_opening(radius: float, resolution: float) -> float:
    """Returns the width of a wall opening in which the cells show a way for a disc [m]."""
    return 2 * radius + max(0.2, 2.5 * resolution)


class Room:
    """A rectangular room with furniture.

    Furniture is placed in a frame of the room: u along the front wall, v away from it, from the
    inner corner (0, 0). The plan of the room may be mirrored.

    Attributes:
        kind: Use of the room, for example `meeting`.
        rect: Its inner area in the plan.
        width: Extent along u [m].
        depth: Extent along v [m].
        rng: Random numbers for the furniture.
    """

    def __init__(
        self,
        kind: str,
        rect: Rect,
        raster: Raster,
        reach: Reach,
        rng: np.random.Generator,
        *,
        front_is_north: bool = False,
        mirrored: bool = False,
    ) -> None:
        """Creates a room without doors and furniture.

        Args:
            kind: Use of the room.
            rect: Its inner area in the plan [m].
            raster: The plan, in which walls and doors are drawn already.
            reach: Examines whether all of the room is reached.
            rng: Random numbers for the furniture.
            front_is_north: Whether the front wall is the wall with the greatest y.
            mirrored: Whether u runs against x.
        """
        self.kind, self.rect, self.rng = kind, rect, rng
        self.width, self.depth = rect.width, rect.height
        self._raster, self._reach = raster, reach
        self._north, self._mirrored = front_is_north, mirrored
        self._kept_free: list[Rect] = []
        # Only the room, with a border for the strips in front of its doors.
        self._corner = Rect(rect.x_min - _PORCH, rect.y_min - _PORCH, 0, 0)
        size = (rect.width + 2 * _PORCH, rect.height + 2 * _PORCH)
        self._view = Raster(size, raster.resolution, WALL)
        self._view.fill(self._in_view(rect), FREE)

    def add_door(self, opening: Rect) -> None:
        """Keeps the way through a door free.

        Args:
            opening: The part of the wall that is open, in the plan [m].
        """
        x1, y1, x2, y2 = opening
        if y2 <= self.rect.y_min + 1e-9 or y1 >= self.rect.y_max - 1e-9:
            strip = Rect(x1, y1 - DOOR_DEPTH, x2, y2 + DOOR_DEPTH)
            kept = Rect(
                x1 - _DOOR_SIDE, strip.y_min, x2 + _DOOR_SIDE, strip.y_max
            )  # in front of and behind the wall
        else:
            strip = Rect(x1 - DOOR_DEPTH, y1, x2 + DOOR_DEPTH, y2)
            kept = Rect(strip.x_min, y1 - _DOOR_SIDE, strip.x_max, y2 + _DOOR_SIDE)
        self._view.fill(self._in_view(strip), FREE)
        self._kept_free.append(kept)

    def add(self, u: float, v: float, width: float, depth: float) -> bool:
        """Places a rectangular object if there is room.

        Args:
            u: Position along u of the corner nearest to the origin [m].
            v: Position along v of this corner [m].
            width: Extent along u [m].
            depth: Extent along v [m].

        Returns:
            Whether the object was placed. It must be inside the room, neither on other furniture
            nor in front of a door, and all free places must remain connected.
        """
        rect = self._to_plan(u, v, width, depth)
        return self._is_allowed(rect) and self._place(rect, None)

    def add_disc(self, u: float, v: float, radius: float) -> bool:
        """Places a round object with a centre and a radius [m], under the same conditions."""
        rect = self._to_plan(u - radius, v - radius, 2 * radius, 2 * radius)
        return self._is_allowed(rect) and self._place(rect, radius)

    def _to_plan(self, u: float, v: float, width: float, depth: float) -> Rect:
        room, snap = self.rect, self._raster.snap
        x = room.x_max - u - width if self._mirrored else room.x_min + u
        y = room.y_max - v - depth if self._north else room.y_min + v
        return Rect(snap(x), snap(y), snap(x + width), snap(y + depth))

    def _in_view(self, rect: Rect) -> Rect:
        x, y = self._corner[:2]
        return Rect(rect.x_min - x, rect.y_min - y, rect.x_max - x, rect.y_max - y)

    def _is_allowed(self, rect: Rect) -> bool:
        tiny = self._raster.resolution / 2
        room = self.rect
        if rect.x_min < room.x_min - tiny or rect.x_max > room.x_max + tiny:
            return False
        if rect.y_min < room.y_min - tiny or rect.y_max > room.y_max + tiny:
            return False
        if any(rect.overlaps(kept) for kept in self._kept_free):
            return False
        part = self._view.cells[self._view.window(self._in_view(rect))]
        return part.size > 0 and not part.any()

    def _place(self, rect: Rect, radius: float | None) -> bool:
        view = self._view
        before = view.cells.copy()
        _fill(view, self._in_view(rect), radius)
        if not self._reach.is_connected(view.cells):
            view.cells = before
            return False
        _fill(self._raster, rect, radius)
        return True


def _fill(raster: Raster, rect: Rect, radius: float | None) -> None:
    if radius is None:
        raster.fill(rect, FURNITURE)
    else:
        x, y = (rect.x_min + rect.x_max) / 2, (rect.y_min + rect.y_max) / 2
        raster.fill_disc(x, y, radius, FURNITURE)
