"""Scans of lasers, and of other plugins that emit ranges."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Any, Final

import numpy as np

from flatland.entities.body import Body
from flatland.geometry import (
    IDENTITY,
    BoolArray,
    DoubleArray,
    FloatArray,
    Pose,
    compose,
    transform_points,
)
from flatland.plugin_api.plugin import ModelPlugin
from flatland.plugin_api.ports import Output
from flatland.plugins.laser import Laser

_CONE_BEAMS: Final = 9  # beams that represent a cone


@dataclass(frozen=True, slots=True, eq=False)
class ScanDescription:
    """A scan.

    Attributes:
        pose: Pose of the sensor in the world frame at the time of the scan [m, rad].
        ranges: Range of each beam [m], shape (n,); never modified.
        range_max: Maximum range, which is the length of a beam [m].
    """

    pose: Pose
    ranges: FloatArray
    range_max: float


@dataclass(frozen=True, slots=True, eq=False)
class LaserDescription:
    """A laser and its last scan.

    Attributes:
        scan: The last scan, or an exact scan from the current pose before the first one.
        beam_ends: End point of each beam of full length in the sensor frame [m], shape (n, 2).
    """

    scan: ScanDescription
    beam_ends: FloatArray

    def hits(self) -> BoolArray:
        """Returns which beams hit something, shape (n,)."""
        # A beam without a hit reports NaN, infinity or the full range; a beam whose hit is too
        # close reports -inf.
        ranges = self.scan.ranges
        hits: BoolArray = np.isfinite(ranges) & (ranges != np.float32(self.scan.range_max))
        return hits

    def ends(self) -> DoubleArray:
        """Returns the end point of each beam in the world frame [m], shape (n, 2)."""
        ranges = self.scan.ranges
        fractions = np.where(self.hits(), ranges.astype(np.float64) / self.scan.range_max, 1.0)
        fractions[np.isneginf(ranges)] = 0.0
        return transform_points(self.scan.pose, self.beam_ends * fractions[:, np.newaxis])


@dataclass(frozen=True, slots=True, eq=False)
class RangingSensor:
    """A sensor with beams, of a model.

    Attributes:
        plugin: Plugin of the sensor.
        output: Output of the plugin with the scans.
        body: Body on which the sensor is mounted.
        origin: Pose of the sensor in the frame of the body.
        angle_min: Angle of the first beam as seen from above [rad].
        angle_increment: Angle between two beams as seen from above [rad].
        count: Number of beams.
        range_max: Maximum range [m].
    """

    plugin: ModelPlugin
    output: Output[Any]
    body: Body
    origin: Pose
    angle_min: float
    angle_increment: float
    count: int
    range_max: float

    def latest(self) -> Any:
        """Returns the last measurement, None before the first one.

        Each measurement is a new object. Must be called between two steps.
        """
        return self.plugin.last_scan if isinstance(self.plugin, Laser) else self.output.latest

    def scan_of(self, value: Any) -> ScanDescription | None:
        """Returns the scan of a measurement, None for an invalid measurement.

        The pose is that at the time of the scan for a `Laser`, and the current pose for other
        plugins. Must be called between two steps.

        Args:
            value: A measurement that was returned by `latest`.
        """
        if isinstance(self.plugin, Laser):
            pose, ranges = value
            return _describe_scan(pose, ranges, self.range_max)
        if hasattr(value, "ranges"):
            ranges = np.asarray(value.ranges, np.float32)
        else:
            ranges = np.full(self.count, value.range, np.float32)
        if ranges.shape != (self.count,):
            return None
        return ScanDescription(compose(self.body.pose, self.origin), ranges, self.range_max)


def describe_laser(laser: Laser) -> LaserDescription:
    """Describes a laser and its last scan; does not change the state of the laser."""
    pose, ranges = laser.last_scan or laser.cast_without_noise()
    return LaserDescription(_describe_scan(pose, ranges, laser.range), laser.beam_ends)


def _describe_scan(pose: Pose, ranges: FloatArray, range_max: float) -> ScanDescription:
    # A view belongs to an array that a caller of `compute_scans` may overwrite.
    return ScanDescription(pose, ranges if ranges.base is None else ranges.copy(), range_max)


def find_sensor(plugin: ModelPlugin, outputs: Iterable[Output[Any]]) -> RangingSensor | None:
    """Returns the sensor of a plugin, None if the plugin does not measure ranges.

    The plugin of a sensor has the attributes `body`, `range` and optionally `origin`. Either the
    plugin has `angles` like a `Laser`, and emits values with `ranges`; or the plugin has a
    `field_of_view` [rad], and emits values with a single `range`.

    Args:
        plugin: The plugin.
        outputs: Outputs of the plugin.
    """
    body, length = getattr(plugin, "body", None), getattr(plugin, "range", None)
    if not isinstance(body, Body) or not isinstance(length, int | float) or not length > 0:
        return None
    origin = getattr(plugin, "origin", IDENTITY)
    angles, width = getattr(plugin, "angles", None), getattr(plugin, "field_of_view", None)
    for output in outputs:
        names = {f.name for f in fields(output.value_type)} if _is_dataclass(output) else set()
        if angles is not None and "ranges" in names:
            # As seen from above, the beams of a sensor that is mounted upside down are clockwise.
            turn = -1.0 if isinstance(plugin, Laser) and _is_upside_down(plugin) else 1.0
            first, step, count = turn * angles.minimum, turn * angles.increment, angles.count
        elif isinstance(width, int | float) and "range" in names:
            first, step, count = -width / 2, width / (_CONE_BEAMS - 1), _CONE_BEAMS
        else:
            continue
        return RangingSensor(plugin, output, body, origin, first, step, count, float(length))
    return None


def _is_dataclass(output: Output[Any]) -> bool:
    return hasattr(output.value_type, "__dataclass_fields__")


def _is_upside_down(laser: Laser) -> bool:
    angles = laser.angles
    y = laser.beam_ends[:2, 1] / laser.range
    upright = np.sin(angles.minimum + angles.increment * np.arange(len(y)))
    return bool(np.abs(y - upright).sum() > np.abs(y + upright).sum())
