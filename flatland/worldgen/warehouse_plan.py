"""Floor plans of warehouses: racks in rows, aisles, and a shipping area with docks."""

from __future__ import annotations

from typing import Final

import numpy as np

from flatland.worldgen.furniture import furnish
from flatland.worldgen.raster import FREE, FURNITURE, WALL, Raster, Rect
from flatland.worldgen.reach import Reach
from flatland.worldgen.room import Room, narrowest_opening

MIN_SIZE: Final = (14.0, 10.0)  # m, longer and shorter side

_OUTER, _INNER = 0.3, 0.15  # thickness of walls [m]
_RACK: Final = 1.1  # depth of a single rack [m]; double racks stand back to back
_BAY: Final = 2.7  # length of a bay [m]
_AISLE: Final = (2.2, 3.2)  # width [m]
_CROSS_AISLE: Final = (2.4, 3.2)  # width [m]
_SECTION: Final = 9.0  # greatest length of a rack without a cross aisle [m]
_EMPTY_BAYS: Final = 0.06  # fraction of the bays of single racks
_STACKS: Final = 0.25  # fraction of the rack sections that are stacks on the floor instead
_PALLET: Final = (1.2, 0.8)  # m
_DOCK_PITCH: Final = 4.5  # distance of docks [m]
_BUMPER: Final = (0.2, 0.4)  # at the sides of a dock: into the hall, along the wall [m]
_DOCK_DOOR: Final = 2.6  # width [m]
_LANE_START, _LANE_END = 2.4, 2.2  # m, free ends of a lane of pallets
_PALLETS: Final = 0.75  # fraction of the places in a lane with pallets
_TABLE: Final = (2.0, 0.8)  # m, packing tables
_TABLES: Final = 1.9  # m, width of the strip along a wall with tables
_SHIPPING: Final = (0.18, 0.26)  # of the length of the hall
_MIN_SHIPPING: Final = 8.0  # m, but not more than the next fraction
_MAX_SHIPPING: Final = 0.35  # of the length of the hall
_OFFICE: Final = (3.6, 5.0)  # m, width and depth of the office
_DOOR: Final = 1.0  # m
_DOCKS_AT_LONG_SIDE: Final = 0.4  # fraction of the warehouses with docks at the longer side
_COLUMN: Final = 0.4  # m, side


def draw_warehouse(raster: Raster, reach: Reach, radius: float, rng: np.random.Generator) -> None:
    """Draws a warehouse into an empty plan, whose width is at least its height.

    Args:
        raster: The plan.
        reach: Examines whether a disc reaches all of the plan.
        radius: Radius of the disc [m].
        rng: Random numbers.
    """
    width, height = raster.size
    if height >= MIN_SIZE[0] and rng.random() < _DOCKS_AT_LONG_SIDE:
        turned = Raster((height, width), raster.resolution)
        _WarehousePlan(turned, reach, radius, rng).draw()
        raster.cells[:] = turned.cells.T
    else:
        _WarehousePlan(raster, reach, radius, rng).draw()


class _WarehousePlan:
    def __init__(
        self, raster: Raster, reach: Reach, radius: float, rng: np.random.Generator
    ) -> None:
        self._raster, self._reach, self._rng = raster, reach, rng
        self._gap = 2 * radius + 0.4  # between pallets
        self._door = max(_DOOR, narrowest_opening(radius, raster.resolution))
        width, height = raster.size
        snap = raster.snap
        self._inner = Rect(snap(_OUTER), snap(_OUTER), snap(width - _OUTER), snap(height - _OUTER))

    def draw(self) -> None:
        raster, inner, rng, snap = self._raster, self._inner, self._rng, self._raster.snap
        raster.fill(Rect(0, 0, *raster.size), WALL)
        raster.fill(inner, FREE)
        least = min(_MIN_SHIPPING, _MAX_SHIPPING * inner.width)
        length = snap(max(least, inner.width * rng.uniform(*_SHIPPING)))
        shipping = Rect(inner.x_min, inner.y_min, inner.x_min + length, inner.y_max)
        self._draw_shipping(shipping)
        # A cross aisle remains at the far end.
        storage = Rect(
            shipping.x_max, inner.y_min, snap(inner.x_max - rng.uniform(*_CROSS_AISLE)), inner.y_max
        )
        self._draw_racks(storage)

    # -- storage ---------------------------------------------------------------------------

    def _draw_racks(self, area: Rect) -> None:
        rows = self._rows(area)
        sections = self._sections(area)
        for number, (y_min, y_max) in enumerate(rows):
            is_single = number in (0, len(rows) - 1)
            for x_min, x_max in sections:
                if not is_single and self._rng.random() < _STACKS:
                    self._draw_stacks(Rect(x_min, y_min, x_max, y_max))
                else:
                    self._draw_rack(x_min, x_max, y_min, y_max, is_single)
                if not is_single:
                    # Columns carry the roof, between the racks at both ends of a section.
                    for x in (x_min - _COLUMN, x_max):
                        self._draw_column(x, (y_min + y_max - _COLUMN) / 2)

    def _rows(self, area: Rect) -> list[tuple[float, float]]:
        """Returns the extents of racks along y: single ones at the walls, else double ones."""
        snap = self._raster.snap
        least = max(_AISLE[0], 2 * self._gap)
        wanted = max(self._rng.uniform(*_AISLE), least)
        aisles = max(1, round(area.height / (2 * _RACK + wanted)))
        while aisles > 1 and area.height / aisles - 2 * _RACK < least:
            aisles -= 1
        middles = [area.y_min + number * area.height / aisles for number in range(aisles + 1)]
        return [
            (snap(max(middle - _RACK, area.y_min)), snap(min(middle + _RACK, area.y_max)))
            for middle in middles
        ]

    def _sections(self, area: Rect) -> list[tuple[float, float]]:
        """Returns the extents of racks along x, with cross aisles between them."""
        snap, rng = self._raster.snap, self._rng
        count = max(1, round(area.width / (_SECTION + _CROSS_AISLE[1])))
        while area.width / count > _SECTION + _CROSS_AISLE[1]:
            count += 1
        gap = snap(rng.uniform(*_CROSS_AISLE))
        length = (area.width - (count - 1) * gap) / count
        starts = [area.x_min + number * (length + gap) for number in range(count)]
        return [(snap(start), snap(start + length)) for start in starts]

    def _draw_rack(
        self, x_min: float, x_max: float, y_min: float, y_max: float, is_single: bool
    ) -> None:
        bays = max(1, round((x_max - x_min) / _BAY))
        length = (x_max - x_min) / bays
        for number in range(bays):
            is_inner = 0 < number < bays - 1
            if is_single and is_inner and self._rng.random() < _EMPTY_BAYS:
                continue
            start = x_min + number * length
            self._raster.fill(Rect(start, y_min, start + length, y_max), FURNITURE)

    def _draw_stacks(self, rect: Rect) -> None:
        """Draws blocks of pallets on the floor, with passages through the row between them."""
        x, rng, snap = rect.x_min, self._rng, self._raster.snap
        while x < rect.x_max - 1e-6:
            columns = int(rng.integers(3, 7))
            end = min(x + columns * _PALLET[1], rect.x_max)
            if rect.x_max - end < self._gap + 2 * _PALLET[1]:
                end = rect.x_max
            depth = 2 * _PALLET[0] if rng.random() < 0.6 else _PALLET[0]
            depth = min(depth, rect.height)
            y = snap(rect.y_min + (rect.height - depth) / 2)
            self._raster.fill(Rect(x, y, snap(end), y + depth), FURNITURE)
            x = snap(end + rng.uniform(self._gap, self._gap + 0.6))

    def _draw_column(self, x: float, y: float) -> None:
        self._raster.fill(Rect(x, y, x + _COLUMN, y + _COLUMN), WALL)

    # -- shipping --------------------------------------------------------------------------

    def _draw_shipping(self, area: Rect) -> None:
        """Draws docks, pallets, packing tables and an office."""
        office = self._draw_office(area)
        low, high = area.y_min, area.y_max
        if office is not None and office.y_min == area.y_min:
            low = office.y_max + _TABLES
        elif office is not None:
            high = office.y_min - _TABLES
        # Tables stand at the side walls without the office.
        if low == area.y_min and high - low > 2 * _DOCK_PITCH:
            low += _TABLES
            self._add_tables(Rect(area.x_min, area.y_min, area.x_max, low), at_north=False)
        if high == area.y_max and high - low > 2 * _DOCK_PITCH:
            high -= _TABLES
            self._add_tables(Rect(area.x_min, high, area.x_max, area.y_max), at_north=True)
        docks = max(1, int((high - low) / _DOCK_PITCH))
        pitch = (high - low) / docks
        for number in range(docks):
            y = low + number * pitch
            self._add_dock(Rect(area.x_min, y, area.x_max, y + pitch))

    def _add_dock(self, area: Rect) -> None:
        """Adds a dock, and behind the dock a lane of pallets, the goods of a lorry."""
        rng = self._rng
        room = Room("dock", area, self._raster, self._reach, rng)
        middle = area.height / 2
        for side in (-_DOCK_DOOR / 2 - _BUMPER[1], _DOCK_DOOR / 2):
            room.add(0.0, middle + side, *_BUMPER)
        u = _LANE_START
        while u + _PALLET[0] <= room.width - _LANE_END:
            if rng.random() < _PALLETS:
                count = int(rng.integers(1, 4))
                room.add(u, middle - count * _PALLET[1] / 2, _PALLET[0], count * _PALLET[1])
            u += _PALLET[0] + (0.0 if rng.random() < 0.4 else self._gap)

    def _add_tables(self, area: Rect, *, at_north: bool) -> None:
        """Adds packing tables along a wall."""
        rng = self._rng
        room = Room("packing", area, self._raster, self._reach, rng, front_is_north=at_north)
        for number in range(int((room.width - 3.0) / 3.4)):
            if rng.random() < 0.7:
                room.add(1.6 + number * 3.4, 0.0, *_TABLE)

    def _draw_office(self, area: Rect) -> Rect | None:
        """Draws a small office in a corner; returns its area with walls, None without an office."""
        raster, rng, snap = self._raster, self._rng, self._raster.snap
        if area.height < 14.0 or area.width < _OFFICE[0] + 3.5:
            return None
        wall = max(snap(_INNER), raster.resolution)
        width = snap(rng.uniform(_OFFICE[0], min(_OFFICE[0] + 2.0, area.width - 3.4)))
        depth = snap(rng.uniform(*_OFFICE))
        at_north = rng.random() < 0.5
        y = area.y_max - depth if at_north else area.y_min
        inner = Rect(area.x_min, y, area.x_min + width, y + depth)
        outer = Rect(
            inner.x_min,
            inner.y_min - (wall if at_north else 0.0),
            inner.x_max + wall,
            inner.y_max + (0.0 if at_north else wall),
        )
        raster.fill(outer, WALL)
        raster.fill(inner, FREE)
        kind = "double" if width >= 4.2 else "single"
        room = Room(kind, inner, raster, self._reach, rng, front_is_north=not at_north)
        x = snap(inner.x_max - self._door - 0.3)
        y_min = outer.y_min if at_north else inner.y_max
        opening = Rect(x, y_min, x + self._door, y_min + wall)
        raster.fill(opening, FREE)
        room.add_door(opening)
        furnish(room)
        return outer
