"""WGS84 conversions, compared with the forward conversion and the geometry of the ellipsoid."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from flatland.plugins._geodesy import TangentPlane, geodetic_from_ecef

A = 6378137.0
E2 = 0.0066943799831668
TOLERANCE = 1e-9  # deg

LATITUDES = [-90.0, -89.9999999, -60.0, -1e-7, 0.0, 1e-9, 43.4516, 45.0, 89.5, 89.9999999, 90.0]
LONGITUDES = [-180.0, -80.4925, 0.0, 1e-8, 90.0, 179.9999999]


def up(latitude: float, longitude: float) -> np.ndarray:
    """Returns the unit normal of the ellipsoid."""
    phi, lam = math.radians(latitude), math.radians(longitude)
    return np.array([math.cos(phi) * math.cos(lam), math.cos(phi) * math.sin(lam), math.sin(phi)])


def surface(latitude: float, longitude: float) -> np.ndarray:
    """Returns the point of the ellipsoid with a given normal, from its implicit equation."""
    normal = up(latitude, longitude)
    squares = np.array([A * A, A * A, A * A * (1 - E2)])
    return squares * normal / math.sqrt(float(squares @ normal**2))


@pytest.mark.parametrize("height", [0.0, 30.0, 1e4, 1e6])
def test_inverse_of_the_forward_conversion(height: float) -> None:
    for latitude, longitude in itertools.product(LATITUDES, LONGITUDES):
        point = surface(latitude, longitude) + height * up(latitude, longitude)
        phi, lam = geodetic_from_ecef(*point)
        assert math.degrees(phi) == pytest.approx(latitude, abs=TOLERANCE)
        if math.hypot(point[0], point[1]) > 1.0:
            turn = math.remainder(math.degrees(lam) - longitude, 360.0)
            assert turn == pytest.approx(0.0, abs=TOLERANCE)


def test_poles_are_exact() -> None:
    b = A * math.sqrt(1 - E2)
    assert geodetic_from_ecef(0.0, 0.0, b) == (math.pi / 2, 0.0)
    assert geodetic_from_ecef(0.0, 0.0, -b) == (-math.pi / 2, 0.0)


@pytest.mark.parametrize("latitude", LATITUDES)
@pytest.mark.parametrize("reach", [0.5, 1e3, 1e5, 5e6])
def test_points_of_the_plane_are_on_the_normal_of_the_result(latitude: float, reach: float) -> None:
    longitude = -80.4925
    plane = TangentPlane(latitude, longitude)
    # Axes of the plane from differences of the normal, which suffice for directions.
    lam = math.radians(longitude)
    east = np.array([-math.sin(lam), math.cos(lam), 0.0])
    north = np.cross(up(latitude, longitude), east)
    for x, y in (
        (0.0, 0.0),
        (reach, 0.0),
        (0.0, reach),
        (-reach, 0.3 * reach),
        (0.2 * reach, -reach),
    ):
        point = surface(latitude, longitude) + x * east + y * north
        found = plane.geodetic(x, y)
        foot, normal = surface(*found), up(*found)
        height = float((point - foot) @ normal)
        aside = np.linalg.norm(point - foot - height * normal)
        # The angle at the center of curvature.
        assert math.degrees(aside / (A + height)) < TOLERANCE
        assert height > -1e-6


def test_longitude_along_the_equator_is_an_arc_tangent() -> None:
    latitude, longitude = TangentPlane(0.0, 0.0).geodetic(100.0, 0.0)
    assert latitude == 0.0
    assert longitude == pytest.approx(math.degrees(math.atan2(100.0, A)), abs=1e-14)


def test_plane_at_the_pole() -> None:
    plane = TangentPlane(90.0, 0.0)
    # North of the pole, the meridian of the reference point continues on the opposite longitude.
    latitude, longitude = plane.geodetic(0.0, 1000.0)
    assert latitude < 90.0
    assert abs(longitude) == pytest.approx(180.0, abs=TOLERANCE)
    # East of the pole, as seen along the meridian of 0 degrees, is 90 degrees east.
    assert plane.geodetic(1000.0, 0.0)[1] == pytest.approx(90.0, abs=TOLERANCE)
