"""The boundary of a bitmap, compared with a naive implementation in numpy."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from flatland.physics import boundary_edges, boundary_loops

Bits = npt.NDArray[np.bool_]
Piece = tuple[int, int, int, int]

bitmaps = arrays(np.bool_, st.tuples(st.integers(1, 24), st.integers(1, 24)))

CROSSING = np.array([[1, 0, 1], [0, 1, 0], [1, 0, 1]], bool)
FEW = settings(max_examples=15)


def naive_pieces(mask: Bits) -> set[Piece]:
    """Returns the boundary in pieces of one pixel, each from its lower or left corner."""
    rows = len(mask)
    padded = np.pad(mask, 1, constant_values=True)
    across = padded[1:, 1:-1] != padded[:-1, 1:-1]
    along = padded[1:-1, 1:] != padded[1:-1, :-1]
    horizontal = {
        (int(c), rows - int(r), int(c) + 1, rows - int(r)) for r, c in np.argwhere(across)
    }
    vertical = {(int(c), rows - 1 - int(r), int(c), rows - int(r)) for r, c in np.argwhere(along)}
    return horizontal | vertical


def unit_pieces(x1: float, y1: float, x2: float, y2: float) -> list[Piece]:
    """Divides a straight edge into pieces of one pixel."""
    low, high = sorted(((round(x1), round(y1)), (round(x2), round(y2))))
    assert (low[0] == high[0]) != (low[1] == high[1])
    if low[1] == high[1]:
        return [(x, low[1], x + 1, low[1]) for x in range(low[0], high[0])]
    return [(low[0], y, low[0], y + 1) for y in range(low[1], high[1])]


def is_on(mask: Bits, x: float, y: float) -> bool:
    """Returns the state of the pixel at a point relative to the lower left corner."""
    row, column = len(mask) - 1 - int(np.floor(y)), int(np.floor(x))
    inside = 0 <= row < mask.shape[0] and 0 <= column < mask.shape[1]
    return bool(mask[row, column]) if inside else True


@FEW
@given(bitmaps)
@example(CROSSING)
@example(~CROSSING)
@example(np.zeros((1, 1), bool))
@example(np.ones((3, 70), bool))
def test_edges_cover_the_boundary_once(mask: Bits) -> None:
    edges = boundary_edges(mask, 1.0)
    pieces = [piece for edge in edges for piece in unit_pieces(*edge)]
    assert len(pieces) == len(set(pieces))
    assert set(pieces) == naive_pieces(mask)


@FEW
@given(bitmaps)
@example(CROSSING)
def test_edges_are_maximal(mask: Bits) -> None:
    edges = boundary_edges(mask, 1.0)
    for along, across in ((0, 1), (1, 0)):
        same_line = edges[edges[:, across] == edges[:, across + 2]]
        starts = {(e[across], min(e[along], e[along + 2])) for e in same_line.tolist()}
        ends = {(e[across], max(e[along], e[along + 2])) for e in same_line.tolist()}
        assert not starts & ends


def test_coordinates_are_rounded_to_float32_once() -> None:
    mask = np.zeros((1, 3000), bool)
    mask[0, ::2] = True
    corners = np.arange(1, 3001)
    expected = (corners * 0.05).astype(np.float32)
    assert (expected != corners.astype(np.float32) * np.float32(0.05)).any()
    np.testing.assert_array_equal(np.unique(boundary_edges(mask, 0.05)[:, 0]), expected)
    y = np.unique(boundary_edges(mask.T, 0.05)[:, 1])
    np.testing.assert_array_equal(y, np.concatenate([[0], expected[:-1]]))


@FEW
@given(bitmaps)
@example(CROSSING)
@example(~CROSSING)
@example(np.pad(CROSSING, 1))
def test_loops_are_closed_and_keep_on_pixels_to_the_left(mask: Bits) -> None:
    pieces: list[Piece] = []
    doubled_area = 0
    for loop in boundary_loops(mask):
        assert loop.dtype == np.int32
        assert len(loop) >= 4
        assert len(loop) % 2 == 0
        following = np.roll(loop, -1, axis=0)
        steps = following - loop
        # Every corner is a turn: horizontal and vertical sides alternate.
        assert ((steps != 0).sum(axis=1) == 1).all()
        assert ((steps[:, 0] != 0) != (np.roll(steps, -1, axis=0)[:, 0] != 0)).all()
        for (x, y), (dx, dy) in zip(loop.tolist(), np.sign(steps).tolist(), strict=True):
            middle_x, middle_y = x + dx / 2, y + dy / 2
            assert is_on(mask, middle_x - dy / 2, middle_y + dx / 2)
            assert not is_on(mask, middle_x + dy / 2, middle_y - dx / 2)
        for start, end in zip(loop, following, strict=True):
            pieces += unit_pieces(*start, *end)
        doubled_area += int((loop[:, 0] * following[:, 1] - loop[:, 1] * following[:, 0]).sum())
    assert len(pieces) == len(set(pieces))
    assert set(pieces) == naive_pieces(mask)
    # The off pixels lie to the right of the loops, so the sum of their signed areas is negative.
    assert doubled_area == -2 * int((~mask).sum())


def test_number_of_loops() -> None:
    mask = np.ones((9, 9), bool)
    mask[1:8, 1:8] = False  # a room
    mask[3:6, 3:6] = True  # a pillar in it
    mask[4, 4] = False  # a hole in the pillar
    loops = boundary_loops(mask)
    assert [loop.tolist() for loop in loops] == [
        [[1, 8], [8, 8], [8, 1], [1, 1]],
        [[3, 6], [3, 3], [6, 3], [6, 6]],
        [[4, 5], [5, 5], [5, 4], [4, 4]],
    ]


def test_on_pixels_are_connected_only_through_sides() -> None:
    on_diagonal = np.zeros((4, 4), bool)
    on_diagonal[1, 1] = on_diagonal[2, 2] = True
    assert sorted(len(loop) for loop in boundary_loops(on_diagonal)) == [4, 4, 4]
    off_diagonal = ~on_diagonal
    assert [len(loop) for loop in boundary_loops(off_diagonal)] == [8]


@pytest.mark.parametrize("shape", [(0, 0), (0, 5), (5, 0)])
def test_an_empty_bitmap_has_no_boundary(shape: tuple[int, int]) -> None:
    mask = np.zeros(shape, bool)
    assert boundary_edges(mask, 1.0).shape == (0, 4)
    assert boundary_loops(mask) == []


def test_masks_of_all_types_and_strides_are_accepted() -> None:
    mask = np.arange(48).reshape(6, 8) % 5 == 0
    expected = boundary_edges(mask, 1.0)
    assert expected.dtype == np.float32
    for same in (mask.astype(np.uint8), mask.astype(np.uint8) * 200, np.asfortranarray(mask)):
        np.testing.assert_array_equal(boundary_edges(same, 1.0), expected)
    np.testing.assert_array_equal(
        boundary_edges(mask[::2, ::-1], 1.0), boundary_edges(mask[::2, ::-1].copy(), 1.0)
    )


@pytest.mark.parametrize(
    ("mask", "got"),
    [
        (np.zeros(4, bool), r"bool with shape \(4,\)"),
        (np.zeros((2, 2, 3), np.uint8), r"uint8 with shape \(2, 2, 3\)"),
        (np.zeros((2, 2)), r"float64 with shape \(2, 2\)"),
        (np.zeros((2, 2), np.int8), r"int8 with shape \(2, 2\)"),
    ],
)
def test_an_invalid_mask_is_rejected(mask: Bits, got: str) -> None:
    message = f"mask must be a two-dimensional array of bool or uint8, got {got}"
    with pytest.raises(ValueError, match=message):
        boundary_edges(mask, 1.0)
    with pytest.raises(ValueError, match=message):
        boundary_loops(mask)


@pytest.mark.parametrize("resolution", [0.0, -0.05, float("nan"), float("inf"), 1e-50, 1e38])
def test_an_invalid_resolution_is_rejected(resolution: float) -> None:
    with pytest.raises(ValueError, match="resolution must be positive"):
        boundary_edges(np.zeros((10, 10), bool), resolution)
