"""Conversion of local coordinates in metres to latitude and longitude on WGS84."""

from __future__ import annotations

import math

SEMI_MAJOR_AXIS = 6378137.0
"""Equatorial radius of WGS84 [m]."""
ECCENTRICITY_SQUARED = 0.0066943799831668
"""Square of the first eccentricity of WGS84."""

_AXIS_RATIO = math.sqrt(1.0 - ECCENTRICITY_SQUARED)
_SEMI_MINOR_AXIS = SEMI_MAJOR_AXIS * _AXIS_RATIO
_SECOND_ECCENTRICITY_SQUARED = ECCENTRICITY_SQUARED / (1.0 - ECCENTRICITY_SQUARED)
_MAX_ITERATIONS = 20
_TOLERANCE = 1e-15  # rad


def geodetic_from_ecef(x: float, y: float, z: float) -> tuple[float, float]:
    """Returns the latitude and longitude of a point that is not deep inside the Earth.

    Args:
        x: Earth-centred, Earth-fixed coordinate towards longitude 0 on the equator [m].
        y: Coordinate towards longitude 90 degrees east on the equator [m].
        z: Coordinate towards the north pole [m].

    Returns:
        Geodetic latitude and longitude [rad]; the longitude of a point on the axis is 0.
    """
    p = math.hypot(x, y)
    # Bowring's formula, iterated until the parametric latitude converges. One iteration suffices
    # on the surface, but a tangent plane is far above it at a distance from the tangent point.
    beta = math.atan2(z, p * _AXIS_RATIO)
    for _ in range(_MAX_ITERATIONS):
        latitude = math.atan2(
            z + _SECOND_ECCENTRICITY_SQUARED * _SEMI_MINOR_AXIS * math.sin(beta) ** 3,
            p - ECCENTRICITY_SQUARED * SEMI_MAJOR_AXIS * math.cos(beta) ** 3,
        )
        previous = beta
        beta = math.atan2(_AXIS_RATIO * math.sin(latitude), math.cos(latitude))
        if abs(beta - previous) <= _TOLERANCE:
            break
    return latitude, math.atan2(y, x)


class TangentPlane:
    """The plane that touches the ellipsoid at a reference point, x east and y north."""

    def __init__(self, latitude: float, longitude: float) -> None:
        """Creates the plane.

        Args:
            latitude: Latitude of the reference point [deg], -90 to 90.
            longitude: Longitude of the reference point [deg].
        """
        phi, lam = math.radians(latitude), math.radians(longitude)
        sin_phi, cos_phi = math.sin(phi), math.cos(phi)
        sin_lam, cos_lam = math.sin(lam), math.cos(lam)
        n = SEMI_MAJOR_AXIS / math.sqrt(1.0 - ECCENTRICITY_SQUARED * sin_phi**2)
        self._origin = (
            n * cos_phi * cos_lam,
            n * cos_phi * sin_lam,
            n * (1.0 - ECCENTRICITY_SQUARED) * sin_phi,
        )
        self._east = (-sin_lam, cos_lam, 0.0)
        self._north = (-sin_phi * cos_lam, -sin_phi * sin_lam, cos_phi)

    def geodetic(self, east: float, north: float) -> tuple[float, float]:
        """Returns the latitude and longitude [deg] of a point of the plane [m]."""
        x, y, z = (
            o + e * east + n * north
            for o, e, n in zip(self._origin, self._east, self._north, strict=True)
        )
        latitude, longitude = geodetic_from_ecef(x, y, z)
        return math.degrees(latitude), math.degrees(longitude)
