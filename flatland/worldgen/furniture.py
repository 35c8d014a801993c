"""Furniture of the rooms of an office."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from flatland.worldgen.room import Room

_DESK: Final = (1.6, 0.8)  # m
_CHAIR: Final = 0.45  # m
_CABINET: Final = 0.4  # m, depth
_SHELF: Final = 0.5  # m, depth
_COUNTER: Final = 0.6  # m, depth
_PLANT: Final = 0.2  # m, radius
_AISLE: Final = 1.2  # m, between groups of desks, with chairs in between


def furnish(room: Room) -> None:
    """Places the furniture of a room, as its kind requires."""
    _KINDS[room.kind](room)


def _single(room: Room) -> None:
    """A desk at a side wall or below the window, cabinets and a plant."""
    rng = room.rng
    v = room.depth - rng.uniform(1.9, 2.3)
    if rng.random() < 0.6 and room.add(0.0, v, *_DESK):
        room.add(rng.uniform(0.3, 0.8), v + _DESK[1], _CHAIR, _CHAIR)
        if rng.random() < 0.5:  # for a visitor
            room.add(0.5, v - _CHAIR, _CHAIR, _CHAIR)
    else:
        v = room.depth - _DESK[1]
        if room.add(0.0, v, *_DESK):
            room.add(rng.uniform(0.4, 0.8), v - _CHAIR, _CHAIR, _CHAIR)
    length = rng.uniform(0.8, 2.0)
    room.add(room.width - _CABINET, room.depth - length - rng.uniform(0, 0.6), _CABINET, length)
    room.add(0.0, rng.uniform(0.0, 0.4), _CABINET, rng.uniform(0.8, 1.4))
    _plant(room)


def _double(room: Room) -> None:
    """Two desks that face each other at the window, and cabinets."""
    rng = room.rng
    middle, v = room.width / 2 + rng.uniform(-0.1, 0.1), room.depth - _DESK[0]
    room.add(middle - _DESK[1], v, _DESK[1], _DESK[0])
    room.add(middle, v, _DESK[1], _DESK[0])
    for u in (middle - _DESK[1] - _CHAIR, middle + _DESK[1]):
        # Farther from the window if the place behind the chair would be cut off.
        for dv in (rng.uniform(0.4, 0.8), 0.2, 0.0):
            if room.add(u, v + dv, _CHAIR, _CHAIR):
                break
    _cabinets(room, 1.0, 1.8)
    _plant(room)


def _open_plan(room: Room) -> None:
    """Groups of desks in rows, with aisles between them."""
    rng = room.rng
    pitch = 2 * (_DESK[1] + _CHAIR) + rng.uniform(_AISLE, _AISLE + 0.4)
    columns = max(1, int((room.width - 0.8) / pitch))
    pitch = (room.width - 0.4) / columns
    front = 1.5
    length = room.depth - front
    if room.depth > 8.0:  # with doors on both sides
        length -= front
    for column in range(columns):
        _desk_group(room, 0.2 + (column + 0.5) * pitch, front, length)
    _cabinets(room, 1.6, 3.2)
    _plant(room)


def _desk_group(room: Room, middle: float, v: float, length: float) -> None:
    """Adds two columns of desks that face each other, with most of their chairs."""
    count = int(length / _DESK[0] + 0.01)
    for number in range(count):
        # At the back wall, so that no gap remains there.
        at = v + length - (number + 1) * _DESK[0]
        for u, chair in (
            (middle - _DESK[1], middle - _DESK[1] - _CHAIR),
            (middle, middle + _DESK[1]),
        ):
            if not room.add(u, at, _DESK[1], _DESK[0]):
                continue
            if room.rng.random() < 0.85:
                room.add(chair, at + room.rng.uniform(0.3, 0.8), _CHAIR, _CHAIR)


def _meeting(room: Room) -> None:
    """A table with chairs around it, and a sideboard."""
    rng = room.rng
    width = min(room.width - 3.2, 4.8)
    depth = min(max(room.depth - 3.2, 0.8), 1.4)
    u, v = (room.width - width) / 2 + 0.2, (room.depth - depth) / 2 + 0.1
    if width < 0.8 or not room.add(u, v, width, depth):
        room.add_disc(room.width / 2, room.depth / 2 + 0.2, 0.6)
        return
    seats = int(width / 0.75)
    for number in range(seats):
        at = u + (number + 0.5) * width / seats - _CHAIR / 2
        room.add(at, v - _CHAIR, _CHAIR, _CHAIR)
        room.add(at, v + depth, _CHAIR, _CHAIR)
    for end in (u - _CHAIR, u + width):
        room.add(end, v + depth / 2 - _CHAIR / 2, _CHAIR, _CHAIR)
    length = rng.uniform(1.2, 2.0)
    room.add(0.0, (room.depth - length) / 2 + 0.1, _CABINET, length)
    _plant(room)


def _kitchen(room: Room) -> None:
    """A counter along the back wall, and tables with chairs."""
    room.add(0.0, room.depth - _COUNTER, room.width, _COUNTER)
    room.add(0.0, room.depth - _COUNTER - 0.7, 0.7, 0.7)  # the refrigerator
    count = max(1, int((room.width - 1.2) / 2.6))
    for number in range(count):
        u = 0.6 + (number + 0.5) * (room.width - 1.2) / count
        v = min(2.0, room.depth - 2.6)
        if not room.add(u - 0.4, v - 0.4, 0.8, 0.8):
            continue
        for du, dv in ((-0.85, -0.2), (0.4, -0.2), (-0.2, -0.85), (-0.2, 0.4)):
            room.add(u + du, v + dv, _CHAIR, _CHAIR)


def _store(room: Room) -> None:
    """Shelves along the walls, and in rows if there is room."""
    room.add(0.0, room.depth - _SHELF, room.width, _SHELF)
    for u in (0.0, room.width - _SHELF):
        room.add(u, 1.2, _SHELF, room.depth - 1.2 - _SHELF)
    if room.width >= 3.6:
        room.add(room.width / 2 - _SHELF, 1.4, 2 * _SHELF, room.depth - 3.0)


def _washroom(room: Room) -> None:
    """Cubicles along the back wall, and basins along a side."""
    count = int(room.width / 0.95)
    room.add(0.0, room.depth - 1.5, count * 0.95, 1.5)
    if room.width - count * 0.95 < 0.9:
        room.add(count * 0.95, room.depth - 1.5, room.width - count * 0.95, 1.5)
    room.add(0.0, 0.2, _SHELF, room.depth - 2.7)


def _lounge(room: Room) -> None:
    """Sofas at the walls around low tables, and plants in the corners."""
    rng = room.rng
    count = max(1, int(room.width / 4.2))
    for number in range(count):
        u = (number + 0.5) * room.width / count
        room.add(u - 1.0, room.depth - 0.9, 2.0, 0.9)
        room.add(u - 0.5, room.depth - 2.5, 1.0, 0.6)
    if rng.random() < 0.7:
        room.add(0.0, 1.4, 0.9, min(1.8, room.depth - 2.6))
    for u in (_PLANT, room.width - _PLANT):
        room.add_disc(u, room.depth - _PLANT, _PLANT)


def _cabinets(room: Room, shortest: float, longest: float) -> None:
    """Adds cabinets along the side walls."""
    for u in (0.0, room.width - _CABINET):
        length = room.rng.uniform(shortest, longest)
        if room.rng.random() < 0.75:
            room.add(u, room.rng.uniform(0.0, 0.6), _CABINET, length)


def _plant(room: Room) -> None:
    """Adds a plant in a corner."""
    if room.rng.random() < 0.5:
        u = _PLANT if room.rng.random() < 0.5 else room.width - _PLANT
        room.add_disc(u, room.depth - _PLANT, _PLANT)


_KINDS: Final[dict[str, Callable[[Room], None]]] = {
    "single": _single,
    "double": _double,
    "open": _open_plan,
    "meeting": _meeting,
    "kitchen": _kitchen,
    "store": _store,
    "washroom": _washroom,
    "lounge": _lounge,
}
