"""The nearest free place, compared with closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flatland.runtime.nearest_place import SEARCH_RADIUS, nearest_offset


@pytest.mark.parametrize("angle", np.linspace(0, math.tau, 12, endpoint=False))
@pytest.mark.parametrize("distance", [1.234, 0.05])
def test_offset_out_of_a_half_plane(angle: float, distance: float) -> None:
    normal = np.array([math.cos(angle), math.sin(angle)])
    offset = nearest_offset(lambda offsets: offsets @ normal >= distance)
    assert offset is not None
    assert math.hypot(*offset) == pytest.approx(distance, abs=0.005)
    assert offset @ normal >= distance - 1e-9


def test_the_closer_of_two_sides_is_found() -> None:
    # The first free candidates are on the left, at 0.30 m, but the right side is closer.
    offset = nearest_offset(lambda o: (o[:, 0] <= -0.299) | (o[:, 0] >= 0.255))
    assert offset is not None
    assert offset[0] == pytest.approx(0.255, abs=0.003)
    assert offset[1] == pytest.approx(0.0, abs=0.05)


def test_offset_out_of_a_corner() -> None:
    offset = nearest_offset(lambda o: (o[:, 0] >= 0.777) & (o[:, 1] >= -0.31) & (o[:, 1] <= -0.2))
    assert offset is not None
    assert offset == pytest.approx((0.777, -0.2), abs=0.005)


@pytest.mark.parametrize(("distance", "is_found"), [(4.95, True), (5.01, False)])
def test_the_search_radius_is_limited(distance: float, is_found: bool) -> None:
    offset = nearest_offset(lambda o: np.hypot(*o.T) >= distance)
    assert (offset is not None) is is_found
    if offset is not None:
        assert math.hypot(*offset) <= SEARCH_RADIUS


def test_offset_into_a_small_disc() -> None:
    rng = np.random.default_rng(1)
    for angle, distance, radius in rng.uniform((0, 0.2, 0.06), (math.tau, 2.0, 0.2), (40, 3)):
        center = (distance + radius) * np.array([math.cos(angle), math.sin(angle)])
        offset = nearest_offset(lambda o, c=center, r=radius: np.hypot(*(o - c).T) <= r)
        assert offset is not None
        assert math.hypot(*offset) == pytest.approx(distance, abs=0.005)
