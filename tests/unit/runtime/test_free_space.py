"""The free space between walls: no place is missed, and connected places have a path."""

from __future__ import annotations

import math

import cv2
import numpy as np
import numpy.typing as npt
import pytest

import flatland.runtime.free_space as free_space_module
from flatland.errors import WorldError
from flatland.runtime.free_space import FreeSpace, Spread

DoubleArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]


def distance_to(walls: DoubleArray, points: DoubleArray) -> DoubleArray:
    """Returns the distance of each point to the nearest edge, shape (n,)."""
    start, along = walls[:, :2], walls[:, 2:] - walls[:, :2]
    to_point = points[:, np.newaxis] - start
    fraction = np.clip((to_point * along).sum(-1) / (along**2).sum(-1), 0, 1)
    distances: DoubleArray = np.hypot(
        *(to_point - fraction[..., np.newaxis] * along).transpose(2, 0, 1)
    ).min(axis=1, initial=math.inf)
    return distances


def space(
    walls: DoubleArray,
    radius: float,
    clearance: float = 0.0,
    bounds: tuple[float, float, float, float] = (0.0, 0.0, 10.0, 6.0),
) -> FreeSpace:
    def fits(points: DoubleArray, disc: float) -> BoolArray:
        return distance_to(walls, points) >= disc

    return FreeSpace(walls, bounds, radius, clearance, fits)


def box(x1: float, y1: float, x2: float, y2: float) -> list[tuple[float, float, float, float]]:
    return [(x1, y1, x2, y1), (x2, y1, x2, y2), (x2, y2, x1, y2), (x1, y2, x1, y1)]


def two_rooms(door: float) -> DoubleArray:
    """Returns a room of 10 m by 6 m, divided by a wall at x = 5 with a door at y = 3.02."""
    middle = [(5.0, 0.0, 5.0, 3.02 - door / 2), (5.0, 3.02 + door / 2, 5.0, 6.0)]
    return np.array([*box(0, 0, 10, 6), *middle])


def places(free_space: FreeSpace, connected_to: tuple[float, float] | None) -> DoubleArray:
    return free_space.places_in(free_space.cells(connected_to), np.random.default_rng(1))


def test_cells_that_are_wider_than_the_radius_requires_are_named(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    walls = two_rooms(1.0)
    assert space(walls, 0.3).size == 200 * 120
    assert not caplog.records
    monkeypatch.setattr(free_space_module, "_MAX_CELLS", 6000)
    wide = space(walls, 0.3)
    assert wide.size == 100 * 60
    (text,) = caplog.messages
    assert text.startswith(
        "free places in 10 m x 6 m: cells are 0.1 m wide instead of 0.05 m, since their number is "
        "limited to 6000; a disc of radius 0.3 m may not find its way through gaps of less than "
    )
    # What the text states: gaps of that width are passable.
    width = float(text.split(" m: use")[0].rsplit(" ", 1)[1])
    places_of_both = places(space(two_rooms(width), 0.3), (1.0, 1.0))
    assert places_of_both[:, 0].max() > 6


def test_no_place_is_missed() -> None:
    rng = np.random.default_rng(3)
    walls = np.concatenate((rng.uniform((0, 0, 0, 0), (10, 6, 10, 6), (12, 4)), two_rooms(1.0)))
    radius, clearance = 0.3, 0.11
    free_space = space(walls, radius, clearance)
    points = rng.uniform((0, 0), (10, 6), (5000, 2))
    fitting = points[distance_to(walls, points) >= radius + clearance]
    assert len(fitting) > 200
    cells = (fitting // 0.05).astype(int)
    assert np.isin(cells[:, 1] * 200 + cells[:, 0], free_space.cells(None)).all()
    # Cells without a place are excluded: no point is far too close to a wall.
    slack = 0.05 * (1 + 2 * math.sqrt(0.5) + 1)
    found = places(free_space, None)
    assert (distance_to(walls, found) >= radius + clearance - slack).all()


def test_walls_out_of_bounds_matter_within_the_clearance() -> None:
    walls = np.array([(-0.5, -1.0, -0.5, 7.0)])
    free_space = space(walls, 0.2, clearance=0.6)
    cells = free_space.cells(None)
    assert free_space.cell_at(0.05, 3.0) not in cells
    assert free_space.cell_at(0.45, 3.0) in cells


@pytest.mark.parametrize(("door", "is_open"), [(0.595, False), (0.68, True), (0.9, True)])
def test_a_door_connects_the_rooms_if_the_disc_fits(door: float, is_open: bool) -> None:
    found = places(space(two_rooms(door), 0.3), (2.0, 3.0))
    assert (found[:, 0] < 4.7).sum() > 1000
    assert (found[:, 0] > 5.3).any() == is_open


def test_the_regions_of_two_rooms_and_of_the_surroundings() -> None:
    # A wall at x = 4 separates a small room from a large one.
    walls = np.array([*box(1, 2, 20, 12), (4.0, 2.0, 4.0, 12.0)])
    free_space = space(walls, 0.3, bounds=(0.0, 1.0, 21.0, 13.0))
    cells = free_space.largest_region()
    x, y = free_space.places_in(cells, np.random.default_rng(1)).T
    assert 4.3 <= x.min() < 4.5
    assert 19.5 < x.max() <= 19.7
    assert 2.3 <= y.min() < y.max() <= 11.7
    left, right = (free_space.regions_at(x, 4.0) for x in (2.0, 8.0))
    assert right == free_space.regions_of(cells)
    assert left
    assert not left & right
    outside = free_space.regions_at(0.2, 4.0)
    assert outside == free_space.regions_at(20.7, 12.8) == free_space.regions_at(-50.0, 100.0)
    assert not outside & (left | right)


def test_no_region_is_the_largest_one_if_the_disc_fits_nowhere() -> None:
    free_space = space(np.array(box(1, 2, 2, 3)), 0.6, bounds=(1.0, 2.0, 2.0, 3.0))
    assert free_space.largest_region().size == 0
    assert free_space.regions_at(1.5, 2.5) == frozenset()


def test_a_slanted_passage_connects() -> None:
    """A corridor at 30° that is 10 cm wider than the disc."""
    turn = math.radians(30)
    along, normal = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    start = np.array([1.0, 0.8])
    middle = np.concatenate((start, start + 8 * along))
    walls = np.array([middle + side * 0.35 * np.tile(normal, 2) for side in (-1, 1)])
    found = places(space(walls, 0.3), tuple(start + along))
    assert (np.hypot(*(found - (start + 7 * along)).T) < 0.1).any()


def test_a_diagonal_passage_connects() -> None:
    """Only the cells on the diagonal are wide enough, which touch at their corners."""
    half = math.hypot(0.3, 0.05 * math.sqrt(0.5)) + 0.001
    sides = [half * math.sqrt(0.5) * np.array([-side, side] * 2) for side in (-1, 1)]
    walls = np.array([np.array([1.025, 1.025, 4.025, 4.025]) + side for side in sides])
    free_space = space(walls, 0.3)
    found = places(free_space, (1.025, 1.025))
    for k in np.arange(1.0, 4.0, 0.5):
        assert (np.hypot(*(found - k).T) < 0.1).any()
    assert free_space.is_connected_within((1.525, 1.525), (3.525, 3.525), 0.0)
    assert free_space.size == 200 * 120


def test_a_connection_stays_near_the_points() -> None:
    """The points are on both sides of a wall with a door 2 m from them."""
    free_space = space(two_rooms(0.9), 0.3)
    ends = (4.0, 5.0), (6.0, 5.0)
    assert free_space.is_connected_within(*ends, 2.1)
    assert free_space.is_connected_within(*ends[::-1], 2.1)
    assert not free_space.is_connected_within(*ends, 1.7)
    assert not free_space.is_connected_within(ends[0], (5.0, 5.0), 3.0)  # in the wall
    assert not free_space.is_connected_within(ends[0], (4.0, 6.1), 3.0)  # out of bounds
    closed = space(two_rooms(0.5), 0.3)
    assert not closed.is_connected_within(*ends, 9.0)
    assert closed.is_connected_within(ends[0], (1.0, 1.0), 0.0)


def test_connected_places_have_a_path() -> None:
    """Each place in random mazes is reached by a search with steps of 1 cm."""
    for seed in range(3):
        rng = np.random.default_rng(seed)
        walls = np.array([*box(0, 0, 4, 4), *rng.uniform(0, 4, (9, 4))])
        radius, step = 0.2, 0.02
        axis = np.arange(0, 4 + step / 2, step)
        grid = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1)
        # Cells of the fine grid that a disc can certainly pass, and cells that it may pass.
        distances = distance_to(walls, grid.reshape(-1, 2)).reshape(len(axis), len(axis))
        free_space = space(walls, radius, 0.0, (0.0, 0.0, 4.0, 4.0))
        row, column = np.unravel_index(np.argmax(distances), distances.shape)
        start = (float(axis[row]), float(axis[column]))
        certainly = flood(distances >= radius + step, (int(row), int(column)))
        perhaps = flood(distances >= radius - step, (int(row), int(column)))
        found = places(free_space, start)
        fitting = found[distance_to(walls, found) >= radius]
        assert len(fitting) > 50
        nearest = np.rint(fitting / step).astype(int)
        assert perhaps[nearest[:, 0], nearest[:, 1]].all()
        # Conversely, all places that are reached with a margin of one cell are returned.
        roomy = flood(distances >= radius + 0.1, (int(row), int(column)))
        assert (roomy <= certainly).all()
        offered = set(free_space.cells(start).tolist())
        for i, j in np.argwhere(roomy)[::7]:
            x, y = min(int(axis[i] / 0.05), 79), min(int(axis[j] / 0.05), 79)
            assert y * 80 + x in offered


def flood(passable: BoolArray, start: tuple[int, int]) -> BoolArray:
    """Returns the cells that are connected to a cell by the sides of passable cells."""
    _, regions = cv2.connectedComponents(passable.astype(np.uint8), connectivity=4)
    return passable & (regions == regions[start])


def test_walls_near_the_bounds_are_included_and_distant_ones_ignored() -> None:
    walls = np.array([(-0.1, -1, -0.1, 7), (-1e9, 3, 1e9, 3), (1e8, 1e8, 1e8 + 1, 1e8)])
    free_space = space(walls, 0.5)
    found = places(free_space, (5.0, 1.0))
    assert found[:, 0].min() >= 0.4
    assert found[:, 1].max() < 3.0
    assert places(free_space, None)[:, 1].max() > 5.9


@pytest.mark.parametrize(
    ("wall", "point"),
    [
        ((0.0, 5.6, 10.0, 5.6), (2.0, 5.98)),
        ((0.0, 0.4, 10.0, 0.4), (2.0, 0.02)),
        ((9.6, 0.0, 9.6, 6.0), (9.98, 2.0)),
        ((0.4, 0.0, 0.4, 6.0), (0.02, 2.0)),
    ],
)
def test_a_strip_along_the_bounds_is_a_place(
    wall: tuple[float, float, float, float], point: tuple[float, float]
) -> None:
    """Only the outermost cells are wide enough, because there are no walls out of bounds."""
    found = places(space(np.array([wall]), 0.35), point)
    assert len(found) >= 100
    assert (np.abs(found - point).min(axis=1) < 0.1).all()


def test_without_walls_all_cells_are_free() -> None:
    found = places(space(np.empty((0, 4)), 0.5), (1.0, 1.0))
    assert len(found) == 200 * 120
    assert found.min(axis=0) == pytest.approx((0, 0), abs=0.05)
    assert found.max(axis=0) == pytest.approx((10, 6), abs=0.05)


@pytest.mark.parametrize("height", [1e6, 1.0])
def test_large_areas_have_larger_cells(monkeypatch: pytest.MonkeyPatch, height: float) -> None:
    monkeypatch.setattr("flatland.runtime.free_space._MAX_CELLS", 10_000)
    free_space = space(np.array([(0.0, 0.0, 1e6, height)]), 0.1, bounds=(0.0, 0.0, 1e6, height))
    assert 5_000 < free_space.size <= 10_100
    assert len(free_space.cells(None)) > 0


@pytest.mark.parametrize(
    ("point", "text"),
    [
        ((11.0, 3.0), r"connected_to \(11, 3\) is out of bounds"),
        ((0.1, 3.0), r"connected_to \(0.1, 3\) is not free for a disc of radius 0.3 m"),
    ],
)
def test_an_invalid_start_raises(point: tuple[float, float], text: str) -> None:
    with pytest.raises(WorldError, match=text):
        space(two_rooms(1.0), 0.3).cells(point)


def test_a_spread_takes_each_candidate_that_is_distant_from_those_before() -> None:
    candidates = np.random.default_rng(2).uniform(-3, 3, (400, 2))
    spread = Spread(0.5)
    assert not spread.fill(candidates, 400)
    expected: list[tuple[float, float]] = []
    for x, y in candidates.tolist():
        if all(math.hypot(x - a, y - b) >= 0.5 for a, b in expected):
            expected.append((x, y))
    assert spread.places == expected
    few = Spread(0.5)
    assert few.fill(candidates, 3)
    assert few.places == expected[:3]
