"""Detection of line segments along the walls of bitmaps."""

from __future__ import annotations

import math

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from flatland.physics import boundary_edges
from flatland.tools.wall_segments import WallBoundary, find_wall_segments

SCALES = [1.05, 2.0]


def edges_of(mask: npt.NDArray[np.bool_]) -> npt.NDArray[np.float64]:
    """Returns the exact boundary, with y down."""
    edges = np.asarray(boundary_edges(mask.astype(np.uint8), 1.0), dtype=np.float64)
    edges[:, 1::2] = len(mask) - edges[:, 1::2]
    return edges


def distances(
    points: npt.NDArray[np.float64], segments: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Returns the distance of each point from the nearest segment."""
    start, extent = segments[:, :2], segments[:, 2:] - segments[:, :2]
    square = np.maximum((extent**2).sum(axis=1), 1e-12)
    nearest = []
    for some in np.array_split(points, 1 + len(points) // 100):
        offsets = some[:, None] - start
        t = np.clip((offsets * extent).sum(axis=2) / square, 0, 1)
        apart = offsets - t[..., None] * extent
        nearest.append(np.hypot(apart[..., 0], apart[..., 1]).min(axis=1))
    return np.concatenate(nearest)


def distance(points: npt.NDArray[np.float64], segments: npt.NDArray[np.float64]) -> float:
    """Returns the largest distance of points from the nearest segment."""
    return float(distances(points, segments).max())


def samples(segments: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    return np.concatenate(
        [np.linspace(s[:2], s[2:], 2 + int(3 * math.hypot(*(s[2:] - s[:2])))) for s in segments]
    )


def sample_mask() -> npt.NDArray[np.bool_]:
    """A room with thick, thin, slanted and round obstacles."""
    image = np.full((160, 220), 255, np.uint8)
    cv2.rectangle(image, (10, 10), (209, 149), 0, 2)
    image[40:70, 30:80] = 0
    image[90, 30:180] = 0
    image[110:112, 30:150] = 0
    image[20:130, 190] = 0
    cv2.line(image, (100, 30), (170, 75), 0, 4)
    cv2.circle(image, (60, 130), 9, 0, -1)
    return image > 100


@pytest.mark.parametrize("scale", SCALES)
def test_segments_are_within_a_pixel_of_the_walls(scale: float) -> None:
    mask = sample_mask()
    segments = find_wall_segments(mask, scale)
    assert len(segments) > 20
    assert distance(samples(segments), edges_of(mask)) <= 1.0


def test_noisy_walls() -> None:
    rng = np.random.default_rng(3)
    mask = sample_mask()[:100, :150]
    # Every tenth pixel at a wall is flipped.
    walls = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_GRADIENT, np.ones((3, 3))) > 0
    mask ^= walls & (rng.random(mask.shape) < 0.1)
    segments = find_wall_segments(mask, SCALES[0])
    assert distance(samples(segments), edges_of(mask)) <= 1.0
    assert len(segments) < len(edges_of(mask))


@pytest.mark.parametrize("scale", SCALES)
def test_straight_walls_are_exact(scale: float) -> None:
    mask = np.ones((100, 150), bool)
    mask[30:60, 40:120] = False
    segments = find_wall_segments(mask, scale)
    sides = edges_of(mask)
    assert len(sides) == 4
    # Each side is found within 0.1 pixels, except for its corners.
    middles = np.concatenate([np.linspace(s[:2], s[2:], 20)[2:-2] for s in sides])
    assert distance(middles, segments) < 0.1


@pytest.mark.parametrize("scale", SCALES)
def test_wall_of_one_pixel_keeps_its_thickness(scale: float) -> None:
    mask = np.ones((60, 150), bool)
    mask[30, 20:130] = False
    segments = find_wall_segments(mask, scale)
    ys = sorted(
        {round(float(y), 2) for y in segments[np.abs(np.ptp(segments[:, ::2], 1)) > 50][:, 1]}
    )
    assert ys == pytest.approx([30.0, 31.0], abs=0.1)


@pytest.mark.parametrize("scale", SCALES)
def test_edge_of_the_image_is_a_wall_next_to_off_pixels(scale: float) -> None:
    mask = np.zeros((60, 80), bool)
    mask[5:-5, 5:-5] = True
    segments = find_wall_segments(mask, scale)
    for wall in ([0, 30], [80, 30], [40, 0], [40, 60], [5, 30], [40, 55]):
        assert distance(np.array([wall], dtype=float), segments) < 0.5


@pytest.mark.parametrize("value", [True, False])
def test_uniform_image_has_no_segments(value: bool) -> None:
    found = find_wall_segments(np.full((1, 1), value), 1.5)
    assert found.shape[1] == 4
    assert len(find_wall_segments(np.ones((50, 50), bool), 1.5)) == 0


def test_offsets_agree_with_a_search_over_all_edges() -> None:
    rng = np.random.default_rng(5)
    mask = rng.random((12, 17)) < 0.8
    points = rng.uniform((-3, -3), (20, 15), (500, 2))
    offsets = WallBoundary(mask).offsets(points)
    edges = edges_of(mask)
    expected = distances(points, edges)
    near = expected <= 2.0
    assert 50 < near.sum() < 450
    assert np.hypot(*offsets[near].T) == pytest.approx(expected[near], abs=1e-9)
    assert distance(points[near] + offsets[near], edges) == pytest.approx(0.0, abs=1e-9)
    assert np.isinf(offsets[~near]).all()
