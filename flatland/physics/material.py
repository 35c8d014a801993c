"""Materials: what surfaces do to the beams of range finders."""

from __future__ import annotations

from typing import NamedTuple


class Material(NamedTuple):
    """What a surface does to the beams of range finders; all shares are from 0 to 1.

    Of the beams that hit the surface, a share `transmission` passes, a share `specular` is
    reflected as by a mirror, and the others are scattered: they are measured. The sum of
    `transmission` and `specular` is at most 1.

    Attributes:
        reflectance: Share of the light that is scattered (albedo), for intensities.
        transmission: Share of the beams that pass.
        specular: Share of the beams that are reflected as by a mirror.
    """

    reflectance: float = 0.5
    transmission: float = 0.0
    specular: float = 0.0
