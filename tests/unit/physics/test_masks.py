"""Shapes, regions, distances and simplified loops, compared with naive implementations."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from flatland.physics import (
    are_connected,
    boundary_loops,
    connected_regions,
    dilated,
    distances_to_off,
    simplified_loop,
)

Bits = npt.NDArray[np.bool_]

masks = arrays(np.bool_, st.tuples(st.integers(1, 20), st.integers(1, 20)))
runs = st.tuples(st.integers(-4, 4), st.integers(-4, 4), st.integers(0, 6))
FEW = settings(max_examples=25)


@FEW
@given(masks, st.lists(runs, max_size=5), st.booleans())
def test_dilated(mask: Bits, shape: list[tuple[int, int, int]], outside: bool) -> None:
    rows = np.array([(row, first, first + more) for row, first, more in shape]).reshape(-1, 3)
    padded = np.pad(mask, 16, constant_values=outside)
    expected = np.zeros(mask.shape, bool)
    for row, first, last in rows.tolist():
        for column in range(first, last + 1):
            rolled = np.roll(padded, (-row, -column), axis=(0, 1))
            expected |= rolled[16:-16, 16:-16]
    np.testing.assert_array_equal(dilated(mask, rows, outside=outside), expected)


def naive_regions(mask: Bits, diagonally: bool) -> npt.NDArray[np.int32]:
    """Fills one region after the other."""
    labels = np.zeros(mask.shape, np.int32)
    block = 2 if diagonally else 1
    places = sorted(np.argwhere(mask).tolist(), key=lambda p: (p[0] // block, p[1] // block))
    for first in places:
        if labels[tuple(first)]:
            continue
        number = labels.max() + 1
        waiting = [tuple(first)]
        while waiting:
            y, x = waiting.pop()
            inside = 0 <= y < mask.shape[0] and 0 <= x < mask.shape[1]
            if not inside or not mask[y, x] or labels[y, x]:
                continue
            labels[y, x] = number
            steps = [(-1, 0), (1, 0), (0, -1), (0, 1)]
            steps += [(-1, -1), (-1, 1), (1, -1), (1, 1)] if diagonally else []
            waiting += [(y + dy, x + dx) for dy, dx in steps]
    return labels


@FEW
@given(masks, st.booleans())
@example(np.eye(9, dtype=bool)[:, ::-1] | np.eye(9, dtype=bool), True)
def test_connected_regions(mask: Bits, diagonally: bool) -> None:
    regions = connected_regions(mask, diagonally=diagonally)
    np.testing.assert_array_equal(regions, naive_regions(mask, diagonally))


@FEW
@given(arrays(np.bool_, st.tuples(*[st.integers(1, 9)] * 2), fill=st.just(True)), st.data())
def test_connected_pixels(mask: Bits, data: st.DataObject) -> None:
    """All pairs of pixels of a window, by the regions of the window alone."""
    first = tuple(data.draw(st.integers(0, size - 1)) for size in mask.shape)
    last = tuple(
        data.draw(st.integers(low, size - 1)) for low, size in zip(first, mask.shape, strict=True)
    )
    regions = np.zeros(mask.shape, np.int32)
    window = tuple(slice(low, high + 1) for low, high in zip(first, last, strict=True))
    regions[window] = naive_regions(mask[window], diagonally=True)
    pixels = list(itertools.product(*(range(each.start, each.stop) for each in window)))
    for start, goal in itertools.product(pixels, repeat=2):
        expected = regions[start] > 0 and regions[start] == regions[goal]
        assert are_connected(mask, start, goal, first, last) == expected


@pytest.mark.parametrize(
    ("pixels", "message"),
    [
        (((0, 0), (0, 0), (0, 0), (3, 4)), r"last must be from \(0, 0\) to \(2, 4\), got \(3, 4\)"),
        (((0, 0), (0, 0), (-1, 0), (2, 4)), r"first must be from \(0, 0\) to .*, got \(-1, 0\)"),
        (((2, 2), (2, 2), (2, 2), (1, 4)), r"last must be from \(2, 2\) to .*, got \(1, 4\)"),
        (((1, 0), (1, 1), (1, 1), (2, 4)), r"start must be from \(1, 1\) to .*, got \(1, 0\)"),
        (((1, 1), (2, 4), (1, 1), (2, 3)), r"goal must be from \(1, 1\) to .*, got \(2, 4\)"),
    ],
)
def test_pixels_outside_of_the_window(pixels: tuple[tuple[int, int], ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        are_connected(np.ones((3, 5), bool), *pixels)


def test_no_pixels_are_connected_in_an_empty_mask() -> None:
    with pytest.raises(ValueError, match="mask must not be empty"):
        are_connected(np.ones((0, 5), bool), (0, 0), (0, 0), (0, 0), (0, 0))


@FEW
@given(masks)
def test_distances_to_off(mask: Bits) -> None:
    off = np.argwhere(~mask)
    places = np.argwhere(np.ones_like(mask))
    squares = ((places[:, None] - off[None]) ** 2).sum(axis=-1)
    expected = np.sqrt(squares.min(axis=1, initial=2**30)).reshape(mask.shape)
    expected[mask & (not len(off))] = np.inf
    np.testing.assert_allclose(distances_to_off(mask), expected, rtol=1e-6)


def test_distances_are_exact_in_a_long_corridor() -> None:
    mask = np.ones((3, 40_000), bool)
    mask[1, [0, 39_000]] = False
    distances = distances_to_off(mask)
    assert distances[1, 19_500] == 19_500
    np.testing.assert_array_equal(distances[1, 38_900:39_100], np.abs(np.arange(-100, 100)))


@FEW
@given(masks, st.sampled_from([0.5, 1.0, 2.5]))
def test_a_simplified_loop_consists_of_points_of_the_loop(mask: Bits, tolerance: float) -> None:
    for loop in boundary_loops(mask):
        kept = simplified_loop(loop, tolerance)
        places = {tuple(point) for point in loop.tolist()}
        assert {tuple(point) for point in kept.tolist()} <= places
        assert 1 <= len(kept) <= len(loop)


@pytest.mark.parametrize("seed", range(20))
def test_results_are_those_of_opencv(seed: int) -> None:
    cv2: Any = pytest.importorskip("cv2")
    rng = np.random.default_rng(seed)
    noise = rng.random(rng.integers(20, 120, 2)).astype(np.float32)
    mask = (cv2.GaussianBlur(noise, (0, 0), rng.uniform(0.5, 4)) > 0.5).astype(np.uint8)
    for diagonally, connectivity in ((True, 8), (False, 4)):
        regions = cv2.connectedComponents(mask, connectivity=connectivity)[1]
        found = connected_regions(mask, diagonally=diagonally)
        assert found.max() == regions.max()
        if diagonally:
            np.testing.assert_array_equal(found, regions)
    distances = cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    np.testing.assert_array_equal(distances_to_off(mask), distances)
    if tuple(map(int, cv2.__version__.split(".")[:2])) >= (4, 8):
        return  # From then on, `approxPolyDP` measures distances from segments instead of lines.
    for loop in boundary_loops(mask):
        expected = cv2.approxPolyDP(loop, 1.0, closed=True)[:, 0]
        np.testing.assert_array_equal(simplified_loop(loop, 1.0), expected)


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        ([(0, 0)], r"shape must have shape \(n, 3\), got \(1, 2\)"),
        ([(0, 0, 1), (0, 2, 1)], r"got row 1: \(0, 2, 1\)"),
        ([(2**30, 0, 0)], r"within \+-16777216"),
    ],
)
def test_invalid_shapes(shape: list[tuple[int, ...]], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        dilated(np.ones((2, 2), bool), np.array(shape))


@pytest.mark.parametrize("tolerance", [-1.0, float("nan")])
def test_invalid_tolerances(tolerance: float) -> None:
    with pytest.raises(ValueError, match="tolerance must not be negative, got"):
        simplified_loop(np.zeros((4, 2), np.int32), tolerance)


def test_masks_must_be_bytes() -> None:
    for function in (distances_to_off, lambda mask: connected_regions(mask, diagonally=True)):
        with pytest.raises(ValueError, match="mask must be a two-dimensional array"):
            function(np.ones((2, 2), np.int32))
