"""Edges of map images: threshold and simplification."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from flatland.maps.map_image import image_edges, threshold_in_place
from flatland.physics import boundary_edges

Image = npt.NDArray[np.uint8]


@pytest.fixture
def grey() -> Image:
    return np.arange(256, dtype=np.uint8).reshape(16, 16)


@pytest.mark.parametrize(
    "threshold", [0.0, 1e-9, 0.2, 0.4, 0.5, 0.65, 0.196, 102 / 255, 1.0, 1.01, -3.0]
)
def test_the_threshold_applies_to_the_value_divided_by_255(grey: Image, threshold: float) -> None:
    expected = [[int(value) / 255 >= threshold for value in row] for row in grey]
    mask = threshold_in_place(grey, threshold)
    np.testing.assert_array_equal(mask, expected)
    assert mask is grey  # no second large array


def drawn_walls() -> Image:
    """Returns free space (1) with a pillar, a bent wall and a wall with a rough surface."""
    mask = np.ones((120, 160), np.uint8)
    mask[:3] = mask[-3:] = 0
    mask[:, :3] = mask[:, -3:] = 0
    mask[20:30, 20:30] = 0
    for column in range(40, 150):
        row = 20 + abs(column - 95) // 4
        mask[row : row + 4, column] = 0
    mask[90:95, 40:140] = 0
    mask[89, 41:139:4] = 0
    return mask


def distance_to_edges(points: npt.NDArray[np.floating], edges: npt.NDArray[np.floating]) -> float:
    """Returns the maximum distance of a point from its nearest edge."""
    start, along = edges[:, :2], edges[:, 2:] - edges[:, :2]
    relative = points[:, None] - start[None]
    fraction = np.clip((relative * along).sum(-1) / (along**2).sum(-1), 0, 1)
    nearest = start + fraction[..., None] * along
    return float(np.hypot(*np.moveaxis(points[:, None] - nearest, -1, 0)).min(axis=1).max())


def blobs() -> Image:
    """Returns shapes with curved outlines."""
    noise = np.random.default_rng(5).random((120, 160), np.float32)
    smooth: Image = (cv2.GaussianBlur(noise, (0, 0), 5) > 0.5).astype(np.uint8)
    return smooth


@pytest.mark.parametrize("mask", [drawn_walls(), blobs()], ids=["walls", "blobs"])
def test_the_simplified_boundary_is_closed_and_within_a_pixel(mask: Image) -> None:
    exact_edges = boundary_edges(mask, 1.0)
    edges, exact = image_edges(mask, 1.0, simplify=1)
    assert edges.dtype == np.float32
    assert exact == len(exact_edges)
    assert len(edges) < exact / 2
    # The distance of the corners of the exact boundary from the simplified one is at most a pixel.
    assert distance_to_edges(exact_edges[:, :2].astype(float), edges.astype(float)) <= 1.0 + 1e-6
    # The loops are closed: each point is the start of one edge and the end of another.
    starts = sorted(map(tuple, edges[:, :2].tolist()))
    assert starts == sorted(map(tuple, edges[:, 2:].tolist()))


def test_loops_that_would_be_reduced_to_four_points_stay_exact() -> None:
    mask = np.ones((40, 40), np.uint8)
    mask[5, 5] = 0  # one pixel
    mask[10:20, 10:20] = 0  # a pillar
    mask[9, 14] = 0  # with a burr, whose removal would leave 4 points
    edges, exact = image_edges(mask, 1.0, simplify=1)
    assert exact == len(edges) == 4 + 8
    found = {tuple(sorted(((a, b), (c, d)))) for a, b, c, d in edges.tolist()}
    expected = boundary_edges(mask, 1.0).tolist()
    assert found == {tuple(sorted(((a, b), (c, d)))) for a, b, c, d in expected}


def test_opening_removes_narrow_free_space() -> None:
    mask = drawn_walls()
    mask[60:85, 50:53] = 0  # two walls with a narrow slit between them
    mask[60:85, 56:60] = 0
    edges_1, exact_1 = image_edges(mask, 1.0, simplify=1)
    edges_2, exact_2 = image_edges(mask, 1.0, simplify=2)
    assert exact_1 == exact_2 == len(boundary_edges(mask, 1.0))  # of the original map
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (7, 7))
    opened = cv2.morphologyEx(mask, cv2.MORPH_OPEN, kernel)
    expected, _ = image_edges(opened, 1.0, simplify=1)
    np.testing.assert_array_equal(edges_2, expected)

    def in_slit(edges: npt.NDArray[np.float32]) -> bool:
        x1, y1, x2, y2 = edges.T
        return bool(((x1 == x2) & (x1 > 51) & (x1 < 58) & (abs(y1 - y2) > 20)).any())

    assert in_slit(edges_1)
    assert not in_slit(edges_2)


@pytest.mark.parametrize("simplify", [0, 1, 2])
def test_a_map_without_off_pixels_has_no_edges(simplify: int) -> None:
    edges, exact = image_edges(np.ones((20, 20), np.uint8), 0.05, simplify)
    assert edges.shape == (0, 4)
    assert edges.dtype == np.float32
    assert exact == 0
