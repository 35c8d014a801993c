"""Shapes in three dimensions and their projection, compared with closed-form values."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import pytest

from flatland.node.shapes import (
    MAX_TEXTS,
    UNIT_BOX,
    UNIT_CYLINDER,
    Shapes,
    colors_of,
    limited,
    packed_colors,
    transformed,
)

RED = (1.0, 0.0, 0.0, 1.0)
SIDES = 24


def volume(triangles: np.ndarray) -> float:
    """Returns the volume of a closed surface whose faces are seen from outside."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize(
    ("surface", "count", "expected"),
    [
        (UNIT_BOX, 12, 1.0),
        (UNIT_CYLINDER, 4 * SIDES, SIDES / 8 * math.sin(2 * math.pi / SIDES)),
    ],
)
def test_unit_solids_are_closed_and_centred(
    surface: np.ndarray, count: int, expected: float
) -> None:
    assert surface.shape == (count, 3, 3)
    assert volume(surface) == pytest.approx(expected)
    np.testing.assert_allclose(surface.min(axis=(0, 1)), -0.5)
    np.testing.assert_allclose(surface.max(axis=(0, 1)), 0.5)
    assert set(np.abs(surface[:, :, 2]).ravel()) <= {0.5}
    # Each edge belongs to two faces, in opposite directions.
    edges: Counter[tuple[bytes, bytes]] = Counter()
    for face in np.round(surface, 6) + 0.0:
        for start, end in zip(face, np.roll(face, -1, axis=0), strict=True):
            edges[start.tobytes(), end.tobytes()] += 1
    assert set(edges.values()) == {1}
    assert all((end, start) in edges for start, end in edges)


def moved_by(x: float, y: float, z: float, yaw: float = 0.0) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:2, :2] = [[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]]
    matrix[:3, 3] = x, y, z
    return matrix


def test_only_the_upper_faces_of_a_solid_are_drawn() -> None:
    shapes = Shapes()
    colors = colors_of(RED, 12)
    colors[:, 1] = range(12)
    shapes.add_triangles(UNIT_BOX, colors, closed=True)
    flat = np.array([[[0, 0, 0], [0, 1, 0], [1, 0, 0]]], float)  # seen from below
    shapes.add_triangles(flat, colors_of(RED, 1))
    marks = shapes.projected(moved_by(5.0, 7.0, 9.0))
    assert len(marks.triangles) == 3
    box = marks.triangles[:2].reshape(-1, 2)
    assert box.min(axis=0).tolist() == [4.5, 6.5]
    assert box.max(axis=0).tolist() == [5.5, 7.5]
    assert marks.triangles[2].tolist() == [5, 7, 5, 8, 6, 7]
    top = [i for i, face in enumerate(UNIT_BOX) if (face[:, 2] == 0.5).all()]
    assert marks.triangle_colors[:2, 1].tolist() == top
    # Without solids, all are drawn.
    shapes = Shapes()
    shapes.add_triangles(flat, colors_of(RED, 1))
    assert len(shapes.projected(np.eye(4)).triangles) == 1


@pytest.mark.parametrize(
    ("head", "drawn"), [(0.5, 0.5), (0.0, 0.23 * 2.0), (-1.0, 0.23 * 2.0), (9.0, 2.0)]
)
def test_an_arrow_is_a_line_with_a_head(head: float, drawn: float) -> None:
    shapes = Shapes()
    start, tip = np.array([[1.0, 2.0, 3.0]]), np.array([[1.0, 4.0, 3.0]])
    shapes.add_arrows(start, tip, (0.1, 0.4, head), colors_of(RED, 1))
    marks = shapes.projected(np.eye(4))
    base = 4.0 - drawn
    np.testing.assert_allclose(marks.lines, [[1, 2, 1, base, 0.1]], atol=1e-6)
    np.testing.assert_allclose(marks.triangles, [[0.8, base, 1.2, base, 1, 4]], atol=1e-6)
    assert marks.line_colors.tolist() == marks.triangle_colors.tolist() == [[255, 0, 0, 255]]


def test_shapes_are_moved_to_another_frame() -> None:
    shapes = Shapes()
    first, second = np.array([[1.0, 0.0, 0.0]]), np.array([[2.0, 0.0, 0.0]])
    shapes.add_lines(first, second, 0.25, colors_of(RED, 1))
    shapes.add_arrows(first, second, (0.1, 0.2, 0.5), colors_of(RED, 1))
    shapes.add_triangles(np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], float), colors_of(RED, 1))
    shapes.add_text(np.array([1.0, 0.0, 0.0]), "  a \n b ")
    matrix = moved_by(10.0, 20.0, 30.0, math.pi / 2)
    before = shapes.projected(np.eye(4))
    for marks in (shapes.moved(matrix).projected(np.eye(4)), shapes.projected(matrix)):
        expected = [[10, 21, 10, 22, 0.25], [10, 21, 10, 21.5, 0.1]]
        np.testing.assert_allclose(marks.lines, expected, atol=1e-5)
        head = [9.9, 21.5, 10.1, 21.5, 10, 22]
        np.testing.assert_allclose(marks.triangles, [[10, 20, 10, 21, 9, 20], head], atol=1e-5)
        [(x, y, text)] = marks.texts
        assert (x, y, text) == (pytest.approx(10), pytest.approx(21), "a b")
    np.testing.assert_array_equal(shapes.projected(np.eye(4)).lines, before.lines)


def test_shapes_with_invalid_numbers_are_omitted() -> None:
    shapes = Shapes()
    points = np.array([[1.0, 0.0, 0.0], [np.nan, 0.0, 0.0], [2.0, 0.0, 0.0]])
    shapes.add_lines(points, points + 1.0, 0.0, packed_colors([(0, 0, b, 1) for b in (0, 0.5, 1)]))
    shapes.add_lines(points[:1], points[:1], math.inf, colors_of(RED, 1))
    shapes.add_text(points[1], "lost")
    for number in range(MAX_TEXTS + 1):
        shapes.add_text(points[0], f"{number}" * 200)
    marks = shapes.projected(np.eye(4))
    assert marks.lines[:, 0].tolist() == [1, 2]
    assert marks.line_colors.tolist() == [[0, 0, 0, 255], [0, 0, 255, 255]]
    assert len(marks.texts) == 999  # of the first 1000, one of which is lost
    assert {len(text) for _, _, text in marks.texts} == {200}
    assert np.isnan(limited([math.inf, -1e300, math.nan])).all()
    assert limited([1.5, -2.0]).tolist() == [1.5, -2.0]
    assert transformed(moved_by(1, 2, 3), [[1, 1, 1]]).tolist() == [[2, 3, 4]]


def test_colours_are_bytes() -> None:
    colors = packed_colors([(0.0, 0.5, 1.0, 2.0), (-1.0, math.nan, 0.999, 0.001)])
    assert colors.tolist() == [[0, 128, 255, 255], [0, 0, 255, 0]]
    assert colors.dtype == np.uint8
