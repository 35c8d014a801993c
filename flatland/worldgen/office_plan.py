"""Floor plans of offices: rows of rooms along corridors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from flatland.worldgen.furniture import furnish
from flatland.worldgen.raster import FREE, WALL, Raster, Rect
from flatland.worldgen.reach import Reach
from flatland.worldgen.room import Room, narrowest_opening

MIN_SIZE: Final = (12.0, 10.0)  # m, longer and shorter side

_OUTER, _INNER = 0.3, 0.15  # thickness of walls [m]
_BLOCK: Final = 12.2  # depth of a corridor with the rooms on both of its sides [m]
_MIN_ROW: Final = 3.6  # least depth of a row of rooms [m]
_CORRIDOR: Final = (1.8, 2.4)  # width [m]
_CROSS_CORRIDORS_EVERY: Final = 28.0  # m
_HALL: Final = (9.0, 14.0)  # width of a room between two corridors [m]
_DOORS: Final = (0.9, 1.0, 1.1, 1.2)  # width [m]
_DOOR_MARGIN: Final = 0.3  # least distance of a door from the corner of its room [m]


@dataclass(frozen=True, slots=True)
class _Kind:
    """A kind of room.

    Attributes:
        widths: Least and greatest width [m].
        weight: How often it occurs.
        repeat: Factor of the weight each time it has occurred.
    """

    widths: tuple[float, float]
    weight: float
    repeat: float = 1.0


_KINDS: Final = {
    "single": _Kind((2.8, 4.0), 4.0),
    "double": _Kind((4.2, 5.6), 4.0),
    "open": _Kind((8.5, 14.0), 1.4, 0.7),
    "meeting": _Kind((4.6, 7.5), 1.6, 0.8),
    "kitchen": _Kind((3.8, 5.5), 1.2, 0.3),
    "store": _Kind((2.4, 3.8), 1.0, 0.4),
    "washroom": _Kind((2.8, 4.2), 1.2, 0.4),
    "lounge": _Kind((4.0, 7.0), 0.8, 0.4),
}


@dataclass(frozen=True, slots=True)
class _Row:
    """A row of rooms along a corridor.

    Attributes:
        y_min: Lower end of the inner area [m].
        y_max: Upper end of the inner area [m].
        wall: Lower end of the wall to the corridor [m].
        is_below: Whether the corridor is above the row.
    """

    y_min: float
    y_max: float
    wall: float
    is_below: bool


def draw_office(raster: Raster, reach: Reach, radius: float, rng: np.random.Generator) -> None:
    """Draws an office into an empty plan, whose width is at least its height.

    Args:
        raster: The plan.
        reach: Examines whether a disc reaches all of the plan.
        radius: Radius of the disc [m].
        rng: Random numbers.
    """
    _OfficePlan(raster, reach, radius, rng).draw()


class _OfficePlan:
    def __init__(
        self, raster: Raster, reach: Reach, radius: float, rng: np.random.Generator
    ) -> None:
        self._raster, self._reach, self._rng = raster, reach, rng
        width, height = raster.size
        snap = raster.snap
        self._inner = Rect(snap(_OUTER), snap(_OUTER), snap(width - _OUTER), snap(height - _OUTER))
        self._wall = max(snap(_INNER), raster.resolution)
        least = narrowest_opening(radius, raster.resolution)
        self._doors = [width for width in _DOORS if width >= least - 1e-9]
        self._weights = {name: kind.weight for name, kind in _KINDS.items()}
        self._rooms: list[Room] = []

    def draw(self) -> None:
        raster, inner = self._raster, self._inner
        raster.fill(Rect(0, 0, *raster.size), WALL)
        raster.fill(inner, FREE)
        blocks = self._blocks()
        cuts = self._cross_corridors(len(blocks))
        # The rows between two corridors are interrupted by the cross corridors.
        for number, (south, north) in enumerate(blocks):
            if number == 0:
                self._draw_row(south, [(inner.x_min, inner.x_max)])
            if number == len(blocks) - 1:
                self._draw_row(north, [(inner.x_min, inner.x_max)])
            else:
                self._draw_core(north, blocks[number + 1][0], cuts)
        for room in self._rooms:
            furnish(room)

    # -- corridors -------------------------------------------------------------------------

    def _blocks(self) -> list[tuple[_Row, _Row]]:
        """Draws the corridors along x; returns the rows on both sides of each."""
        inner, rng, snap = self._inner, self._rng, self._raster.snap
        count = max(1, round(inner.height / _BLOCK))
        bounds = [snap(inner.y_min + inner.height * i / count) for i in range(count + 1)]
        blocks = []
        for number in range(count):
            # A wall between the rows of neighbouring blocks.
            y_min = bounds[number] + (self._wall if number else 0.0)
            y_max = bounds[number + 1]
            if number:
                self._wall_along_x(bounds[number], inner.x_min, inner.x_max)
            width = snap(rng.uniform(*_CORRIDOR))
            spare = y_max - y_min - width - 2 * self._wall - 2 * _MIN_ROW
            shift = rng.uniform(-0.1, 0.1) * max(spare, 0.0)
            low = snap((y_min + y_max - width) / 2 + shift)
            high = low + width
            self._wall_along_x(low - self._wall, inner.x_min, inner.x_max)
            self._wall_along_x(high, inner.x_min, inner.x_max)
            south = _Row(y_min, low - self._wall, low - self._wall, is_below=True)
            north = _Row(high + self._wall, y_max, high, is_below=False)
            blocks.append((south, north))
        return blocks

    def _cross_corridors(self, blocks: int) -> list[tuple[float, float]]:
        """Returns the extents along x of the corridors that connect the others."""
        if blocks == 1:
            return []
        inner, rng, snap = self._inner, self._rng, self._raster.snap
        count = max(1, round(inner.width / _CROSS_CORRIDORS_EVERY))
        cuts = []
        for number in range(count):
            middle = inner.x_min + inner.width * (number + 0.5 + rng.uniform(-0.15, 0.15)) / count
            width = snap(rng.uniform(*_CORRIDOR))
            x_min = snap(middle - width / 2)
            cuts.append((x_min, x_min + width))
        return cuts

    def _draw_core(self, below: _Row, above: _Row, cuts: list[tuple[float, float]]) -> None:
        """Draws the two rows between two corridors, with halls that extend over both."""
        raster, inner, rng = self._raster, self._inner, self._rng
        low, high = below.wall, above.wall + self._wall
        segments, start = [], inner.x_min
        for x_min, x_max in cuts:
            raster.fill(Rect(x_min - self._wall, low, x_max + self._wall, high), WALL)
            raster.fill(Rect(x_min, low, x_max, high), FREE)
            segments.append((start, x_min - self._wall))
            start = x_max + self._wall
        segments.append((start, inner.x_max))
        for x_min, x_max in segments:
            width = rng.uniform(*_HALL)
            at_start = rng.random() < 0.5
            if x_max - x_min < width + 4.0 or rng.random() < 0.4:
                parts = [(x_min, x_max)]
            elif at_start:
                split = raster.snap(x_min + width)
                self._draw_hall(below, above, x_min, split)
                parts = [(split + self._wall, x_max)]
            else:
                split = raster.snap(x_max - width)
                self._draw_hall(below, above, split, x_max)
                parts = [(x_min, split - self._wall)]
            for row in (below, above):
                self._draw_row(row, parts)

    def _draw_hall(self, below: _Row, above: _Row, x_min: float, x_max: float) -> None:
        """Draws an open-plan office or a meeting hall between two corridors."""
        raster, inner = self._raster, self._inner
        rect = Rect(x_min, below.y_min, x_max, above.y_max)
        raster.fill(rect, FREE)
        for x in (x_min - self._wall, x_max):
            if inner.x_min < x < inner.x_max - self._wall:
                raster.fill(Rect(x, rect.y_min, x + self._wall, rect.y_max), WALL)
        room = Room("open", rect, raster, self._reach, self._rng)
        for row in (below, above):
            self._add_door(room, row, at_start=self._rng.random() < 0.5)
        self._rooms.append(room)

    # -- rooms -----------------------------------------------------------------------------

    def _draw_row(self, row: _Row, parts: list[tuple[float, float]]) -> None:
        for x_min, x_max in parts:
            start = x_min
            kinds = self._choose_rooms(x_max - x_min)
            for number, (kind, width) in enumerate(kinds):
                is_last = number == len(kinds) - 1
                end = x_max if is_last else self._raster.snap(start + width - self._wall)
                self._draw_room(kind, row, start, end)
                if not is_last:
                    self._raster.fill(Rect(end, row.y_min, end + self._wall, row.y_max), WALL)
                start = end + self._wall

    def _choose_rooms(self, length: float) -> list[tuple[str, float]]:
        """Returns kinds and widths of rooms, including a wall each, whose sum is a length [m]."""
        names = list(_KINDS)
        rooms: list[tuple[str, float]] = []
        total = 0.0
        while total < length:
            weights = np.array([self._weights[name] for name in names])
            # A large room only where it fits.
            fits = np.array([_KINDS[name].widths[0] <= length - total for name in names])
            weights = weights * fits if fits.any() else weights * (np.array(names) == "single")
            name = names[self._rng.choice(len(names), p=weights / weights.sum())]
            self._weights[name] *= _KINDS[name].repeat
            width = self._rng.uniform(*_KINDS[name].widths)
            rooms.append((name, width))
            total += width
        # Of all rooms, or of all but the last one, whichever changes the widths less.
        without = total - rooms[-1][1]
        if len(rooms) > 1 and length / without < total / length:
            rooms.pop()
            total = without
        return [(name, width * length / total) for name, width in rooms]

    def _draw_room(self, kind: str, row: _Row, x_min: float, x_max: float) -> None:
        rng = self._rng
        mirrored = rng.random() < 0.5
        room = Room(
            kind,
            Rect(x_min, row.y_min, x_max, row.y_max),
            self._raster,
            self._reach,
            rng,
            front_is_north=row.is_below,
            mirrored=mirrored,
        )
        if kind == "lounge":
            margin = min(0.3, (x_max - x_min) / 4)
            self._open(room, Rect(x_min + margin, row.wall, x_max - margin, row.wall + self._wall))
        elif kind == "open":
            for at_start in (True, False):
                self._add_door(room, row, at_start=at_start)
        else:
            # Opposite to the furniture at the side wall.
            self._add_door(room, row, at_start=mirrored)
        self._rooms.append(room)

    def _add_door(self, room: Room, row: _Row, *, at_start: bool) -> None:
        """Adds a door near the start or the end of a room along x."""
        snap, rect = self._raster.snap, room.rect
        width = self._doors[self._rng.integers(len(self._doors))]
        offset = self._rng.uniform(_DOOR_MARGIN, max(min(1.0, rect.width / 4), _DOOR_MARGIN))
        x = snap(rect.x_min + offset if at_start else rect.x_max - offset - width)
        self._open(room, Rect(x, row.wall, x + width, row.wall + self._wall))

    def _open(self, room: Room, opening: Rect) -> None:
        self._raster.fill(opening, FREE)
        room.add_door(opening)

    def _wall_along_x(self, y: float, x_min: float, x_max: float) -> None:
        self._raster.fill(Rect(x_min, y, x_max, y + self._wall), WALL)
