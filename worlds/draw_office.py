#!/usr/bin/env python3
"""Generates the maps of the office world: `office.png` (walls) and `tables.png` (table tops).

Without arguments, it overwrites the images in `office/`; the result is always the same. Black is
occupied, white is free, and the grey margin of `office.png` is unknown. A table consists of four
legs in `office.png`, which a low robot detects, and its top in `tables.png`.

Coordinates are metres from the lower left corner of the image, x to the right, y up.
"""

from __future__ import annotations

import sys
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

RESOLUTION = 0.05  # [m] per pixel
WIDTH, HEIGHT = 60.0, 25.0  # [m]
FREE, UNKNOWN, OCCUPIED = 254, 205, 0  # as written by map_saver

OUTER_WALL, INNER_WALL, LEAF = 0.3, 0.2, 0.05  # thickness [m]
DOOR = 1.0  # clear width [m]

# The interior of the building, and the centre lines of the walls along the two corridors.
WEST, EAST, SOUTH, NORTH = 0.8, 59.2, 0.8, 24.2
SOUTH_ROW, CORE_SOUTH, CORE_NORTH, NORTH_ROW = 5.9, 8.1, 16.9, 19.1
LOBBY, OPEN_PLAN = 9.0, 42.0  # walls between the offices and the two large rooms


class Office:
    """The two maps while they are being generated."""

    def __init__(self) -> None:
        """Starts with a free floor inside the outer wall."""
        shape = (pixel(HEIGHT), pixel(WIDTH))
        self.walls = np.full(shape, UNKNOWN, np.uint8)
        self.tables = np.full(shape, FREE, np.uint8)
        rim = OUTER_WALL
        self.block(WEST - rim, SOUTH - rim, EAST + rim, NORTH + rim)
        self.block(WEST, SOUTH, EAST, NORTH, FREE)

    def block(self, x1: float, y1: float, x2: float, y2: float, value: int = OCCUPIED) -> None:
        """Adds a box, or fills a rectangle with another value."""
        fill(self.walls, x1, y1, x2, y2, value)

    def post(self, x: float, y: float, radius: float) -> None:
        """Adds a round object: a column, a plant, the foot of a table."""
        disc(self.walls, x, y, radius)

    def wall_along_x(self, y: float, x1: float, x2: float, *doors: float) -> None:
        """Adds an inner wall at `y` with door openings centred at the given x."""
        half = INNER_WALL / 2
        self.block(x1 - half, y - half, x2 + half, y + half)
        for x in doors:
            self.block(x - DOOR / 2, y - half, x + DOOR / 2, y + half, FREE)

    def wall_along_y(self, x: float, y1: float, y2: float, *doors: float) -> None:
        """Adds an inner wall at `x` with door openings centred at the given y."""
        half = INNER_WALL / 2
        self.block(x - half, y1 - half, x + half, y2 + half)
        for y in doors:
            self.block(x - half, y - DOOR / 2, x + half, y + DOOR / 2, FREE)

    def door_leaf(self, x: float, y: float, into: float) -> None:
        """Adds an open door at the left side of the opening at (x, y) of a wall along x."""
        hinge = x - DOOR / 2
        start = y + into * INNER_WALL / 2
        bottom, top = sorted((start, start + into * 0.9))
        self.block(hinge - LEAF, bottom, hinge, top)

    def table(self, x: float, y: float, length: float, width: float) -> None:
        """Adds a rectangular table with four legs and its centre at (x, y)."""
        dx, dy, leg = length / 2, width / 2, 0.05
        fill(self.tables, x - dx, y - dy, x + dx, y + dy, OCCUPIED)
        for cx in (x - dx + 2 * leg, x + dx - 2 * leg):
            for cy in (y - dy + 2 * leg, y + dy - 2 * leg):
                self.block(cx - leg, cy - leg, cx + leg, cy + leg)

    def round_table(self, x: float, y: float, radius: float) -> None:
        """Adds a round table with one foot."""
        disc(self.tables, x, y, radius)
        self.post(x, y, 0.12)

    def desk(self, x: float, y: float, facing: float) -> None:
        """Adds a desk with a drawer unit; `facing` is the side of its user in y, +1 or -1."""
        self.table(x, y, 1.6, 0.8)
        self.block(x + 0.25, y - 0.25 + facing * 0.05, x + 0.65, y + 0.25 + facing * 0.05)


def pixel(metres: float) -> int:
    """Returns the pixel boundary nearest to a coordinate [m]."""
    return round(metres / RESOLUTION)


def fill(
    image: npt.NDArray[np.uint8], x1: float, y1: float, x2: float, y2: float, value: int
) -> None:
    """Fills a rectangle."""
    rows = len(image)
    image[rows - pixel(y2) : rows - pixel(y1), pixel(x1) : pixel(x2)] = value


def disc(image: npt.NDArray[np.uint8], x: float, y: float, radius: float) -> None:
    """Fills all pixels whose centres are inside a circle."""
    rows, columns = image.shape
    px = (np.arange(columns) + 0.5) * RESOLUTION
    py = (rows - np.arange(rows) - 0.5) * RESOLUTION
    inside = (px[None, :] - x) ** 2 + (py[:, None] - y) ** 2 <= radius**2
    image[inside] = OCCUPIED


def draw_structure(office: Office) -> None:
    """Adds the inner walls: two rows of rooms, two corridors and the core between them."""
    # South row of rooms: post room, six offices, a meeting room, a store.
    south = [WEST, LOBBY, 13.0, 17.0, 21.0, 25.0, 29.5, 34.0, 38.0, OPEN_PLAN]
    doors = [5.0, 10.0, 14.0, 18.0, 22.0, 26.0, 32.0, 35.0, 39.0]
    office.wall_along_x(SOUTH_ROW, WEST, OPEN_PLAN, *doors)
    for x in south[1:]:
        office.wall_along_y(x, SOUTH, SOUTH_ROW)
    for x in doors[1:]:
        office.door_leaf(x, SOUTH_ROW, into=-1)
    # North row: training room, large meeting room, three offices, director, project room.
    north = [WEST, LOBBY, 18.0, 22.0, 26.0, 30.0, 36.0, OPEN_PLAN]
    doors = [7.5, 10.2, 16.8, 19.0, 23.0, 27.0, 31.2, 37.2]
    office.wall_along_x(NORTH_ROW, WEST, OPEN_PLAN, *doors)
    for x in north[1:]:
        office.wall_along_y(x, NORTH_ROW, NORTH)
    for x in doors[1:]:
        office.door_leaf(x, NORTH_ROW, into=1)
    # Core, west of the cross corridor: toilets, stairs and lifts, kitchen, meeting room.
    office.wall_along_x(CORE_SOUTH, LOBBY, 29.0, 13.4, 15.4, 20.5, 27.0)
    office.wall_along_x(CORE_NORTH, LOBBY, 29.0, 13.4, 20.5)
    office.wall_along_x(12.5, LOBBY, 14.5)
    office.wall_along_x(12.5, 19.0, 29.0)
    office.wall_along_y(LOBBY, CORE_SOUTH, CORE_NORTH)
    office.wall_along_y(14.5, CORE_SOUTH, CORE_NORTH)
    office.wall_along_y(19.0, CORE_SOUTH, CORE_NORTH)
    office.wall_along_y(29.0, CORE_SOUTH, CORE_NORTH, 14.7)
    # Core, east of the cross corridor: small meeting room, copy room, server room, archive.
    office.wall_along_x(CORE_SOUTH, 31.0, OPEN_PLAN, 32.4, 38.2)
    office.wall_along_x(CORE_NORTH, 31.0, OPEN_PLAN, 32.4, 38.2)
    office.wall_along_x(12.5, 31.0, OPEN_PLAN)
    office.wall_along_y(31.0, CORE_SOUTH, CORE_NORTH)
    office.wall_along_y(36.5, CORE_SOUTH, CORE_NORTH)
    office.wall_along_y(OPEN_PLAN, CORE_SOUTH, CORE_NORTH)
    # A meeting box in the corner of the open-plan area.
    office.wall_along_x(NORTH_ROW, 53.5, EAST, 56.6)
    office.wall_along_y(53.5, NORTH_ROW, NORTH)
    # Columns of the open-plan area and the lobby, and pilasters of the facade.
    for x in (46.3, 50.6, 54.9):
        for y in (6.9, 18.1):
            office.block(x - 0.25, y - 0.25, x + 0.25, y + 0.25)
    for y in (9.5, 15.5):
        office.post(5.0, y, 0.3)
    for x in np.arange(5.0, 58.0, 4.3):
        office.block(x - 0.2, SOUTH, x + 0.2, SOUTH + 0.15)
        office.block(x - 0.2, NORTH - 0.15, x + 0.2, NORTH)


def furnish_core(office: Office) -> None:
    """Furnishes the lobby and the rooms between the corridors."""
    # Lobby: draught lobby of the entrance, reception, a waiting corner with two sofas, plants.
    for y in (10.9, 14.0):
        office.block(WEST, y, 2.6, y + 0.1)
    office.block(2.5, 10.9, 2.6, 11.7)
    office.block(2.5, 13.3, 2.6, 14.1)
    office.block(6.2, 10.8, 6.8, 14.2)
    office.block(6.8, 10.8, 7.6, 11.2)
    office.block(1.0, 16.6, 1.8, 18.6)
    office.block(2.3, 17.9, 4.3, 18.7)
    office.table(3.2, 16.9, 1.0, 0.6)
    for x, y in ((1.3, 6.6), (1.3, 15.9), (8.5, 8.5), (8.5, 16.5), (42.5, 16.4), (30.6, 16.5)):
        office.post(x, y, 0.2)
    # Toilets: stalls along the west side, basins along the opposite wall.
    for bottom, direction in ((CORE_SOUTH, 1.0), (CORE_NORTH, -1.0)):
        for stall in range(4):
            y = bottom + direction * (0.3 + 1.0 * stall)
            office.block(9.1, y - 0.03, 10.6, y + 0.03)
            low, high = sorted((y, y + direction * 1.0))
            office.block(9.1, low + 0.3, 9.6, high - 0.3)
        low, high = sorted((bottom + direction * 1.6, bottom + direction * 4.2))
        office.block(13.9, low, 14.4, high)
    # Stairs, tread by tread, and the two closed lift shafts.
    for tread in range(13):
        y = 12.6 + 0.3 * tread
        office.block(14.6, y, 18.9, y + 0.05)
    office.block(16.7, 12.6, 16.8, 16.8)
    for y in (8.2, 10.3):
        office.block(17.0, y, 18.9, y + 2.1)
        office.block(17.1, y + 0.1, 18.8, y + 2.0, UNKNOWN)
    # Kitchen: counter, fridge, island, tables.
    office.block(19.1, 11.8, 25.0, 12.4)
    office.block(19.1, 9.2, 19.7, 11.8)
    office.block(21.3, 10.1, 23.2, 10.7)
    office.round_table(25.8, 10.4, 0.45)
    office.round_table(27.7, 9.9, 0.45)
    office.round_table(27.5, 11.5, 0.45)
    # Meeting room B: a long table and a sideboard.
    office.table(24.2, 14.7, 4.8, 1.4)
    office.block(22.0, 16.35, 26.0, 16.8)
    # Small meeting room, copy room, server room with racks, archive with shelves.
    office.table(34.0, 10.5, 2.4, 1.2)
    office.block(32.8, 12.0, 35.2, 12.4)
    office.block(34.5, 16.1, 35.3, 16.8)
    office.block(31.2, 12.6, 33.0, 13.1)
    office.block(35.9, 13.0, 36.4, 15.6)
    for y in (13.9, 15.3):
        office.block(38.9, y, 41.3, y + 0.6)
    for x in (37.4, 39.0, 40.6):
        office.block(x, 9.6, x + 0.5, 12.4)


def furnish_offices(office: Office) -> None:
    """Furnishes the rooms along the facades."""
    # South row: two desks and a cabinet in each of six offices.
    for west, east in ((9, 13), (13, 17), (17, 21), (21, 25), (34, 38), (25, 29.5)):
        middle = (west + east) / 2
        office.desk(middle - 0.9, 2.0, facing=1)
        office.desk(middle + 0.9, 2.0, facing=1)
        office.block(east - 0.53, 3.4, east - 0.08, 5.2)
    office.table(31.75, 2.6, 2.6, 1.2)  # the meeting room between them
    for x in (38.6, 40.2):  # the store
        office.block(x, 1.2, x + 0.5, 4.2)
    office.block(1.0, 0.8, 4.5, 1.4)  # the post room: shelves, sorting table
    office.block(0.8, 1.8, 1.3, 5.0)
    office.table(5.2, 3.2, 2.4, 1.0)
    # North row.
    for row in range(3):  # the training room: rows of tables and a lectern
        for x in (2.6, 5.4):
            office.table(x, 20.6 + 1.0 * row, 2.0, 0.5)
    office.block(8.3, 21.6, 8.7, 22.4)
    office.table(13.5, 21.8, 6.0, 1.6)  # the large meeting room
    office.block(11.5, 23.6, 15.5, 24.1)
    for west, east in ((18, 22), (22, 26), (26, 30)):
        middle = (west + east) / 2
        office.desk(middle - 0.9, 23.0, facing=-1)
        office.desk(middle + 0.9, 23.0, facing=-1)
        office.block(east - 0.53, 19.6, east - 0.08, 21.4)
    office.desk(34.0, 22.6, facing=1)  # the director: desk, round table, sofa
    office.round_table(32.2, 21.6, 0.6)
    office.block(30.3, 22.6, 31.1, 24.0)
    office.block(33.0, 19.25, 35.6, 19.7)
    office.table(39.3, 22.2, 3.2, 1.4)  # the project room
    office.block(41.4, 19.8, 41.9, 23.0)


def furnish_open_plan(office: Office) -> None:
    """Furnishes the open-plan area: islands of desks, lockers, a seating group."""
    for x in (44.7, 49.5, 54.3):
        for y in (3.2, 10.4, 14.4, 21.2):
            if x > 53 and y > 19:
                continue  # position of the meeting box
            for column in (0.0, 1.7):
                office.desk(x + column - 0.2, y - 0.45, facing=-1)
                office.desk(x + column - 0.2, y + 0.45, facing=1)
            office.block(x - 1.1, y - 0.03, x + 2.4, y + 0.03)  # a screen between the desks
    office.table(56.6, 21.9, 2.2, 1.1)
    office.block(58.7, 9.0, 59.2, 15.5)  # lockers
    office.block(57.6, 2.0, 58.4, 4.2)
    office.block(56.0, 1.0, 57.4, 1.7)
    for x, y in ((43.0, 23.5), (52.9, 23.6), (58.7, 6.0), (43.0, 1.5)):
        office.post(x, y, 0.2)


def draw() -> dict[str, npt.NDArray[np.uint8]]:
    """Generates both maps.

    Returns:
        Grey images by file name, top row first, shape (500, 1200).
    """
    office = Office()
    draw_structure(office)
    furnish_core(office)
    furnish_offices(office)
    furnish_open_plan(office)
    return {"office.png": office.walls, "tables.png": office.tables}


def main(folder: Path) -> None:
    """Writes both images."""
    for name, image in draw().items():
        if not cv2.imwrite(str(folder / name), image):
            sys.exit(f"cannot write {folder / name}")


if __name__ == "__main__":
    main(Path(__file__).resolve().parent / "office")
