"""Sensors of a model that measure ranges: lasers, and plugins that emit similar values."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from functools import partial
from typing import Any, Final

import numpy as np

from flatland.entities.body import Body
from flatland.geometry import IDENTITY, FloatArray, Pose, compose
from flatland.plugin_api.plugin import ModelPlugin
from flatland.plugin_api.ports import Output
from flatland.plugins.laser import Laser

_CONE_BEAMS: Final = 9  # by which a cone is drawn


@dataclass(frozen=True, slots=True, eq=False)
class RangingSensor:
    """A sensor with beams.

    Attributes:
        plugin: Its plugin.
        output: The output with its scans.
        body: The body on which it is mounted.
        origin: Its pose in the frame of the body.
        angle_min: Angle of the first beam as seen from above [rad].
        angle_increment: Angle between two beams as seen from above [rad].
        count: Number of beams.
        range_max: Maximum range [m].
        latest: Returns the last measurement, None before the first one; another object for each
            one. To be called between two steps.
    """

    plugin: ModelPlugin
    output: Output[Any]
    body: Body
    origin: Pose
    angle_min: float
    angle_increment: float
    count: int
    range_max: float
    latest: Callable[[], Any]

    def scan_of(self, value: Any) -> tuple[Pose, FloatArray] | None:
        """Returns the pose of the sensor, and the range of each beam; None for an invalid value.

        The pose is that at the time of the scan for a `Laser`, else the current one.

        Args:
            value: A measurement that was returned by `latest`.
        """
        if isinstance(self.plugin, Laser):
            pose, ranges = value
            # The caller of `compute_scans` may overwrite an array of its own.
            return pose, ranges if ranges.base is None else ranges.copy()
        pose = compose(self.body.pose, self.origin)
        if hasattr(value, "ranges"):
            ranges = np.asarray(value.ranges, np.float32)
        else:
            ranges = np.full(self.count, value.range, np.float32)
        return (pose, ranges) if ranges.shape == (self.count,) else None


def find_sensor(plugin: ModelPlugin, outputs: Iterable[Output[Any]]) -> RangingSensor | None:
    """Returns the sensor of a plugin, None if the plugin is none.

    A sensor has the attributes `body`, `range` and optionally `origin`. Either it has `angles` like
    those of `Laser`, and emits values with `ranges`; or it has a `field_of_view` [rad], and emits
    values with a single `range`.

    Args:
        plugin: The plugin.
        outputs: Its outputs.
    """
    body, length = getattr(plugin, "body", None), getattr(plugin, "range", None)
    if not isinstance(body, Body) or not isinstance(length, int | float) or not length > 0:
        return None
    origin = getattr(plugin, "origin", IDENTITY)
    angles, width = getattr(plugin, "angles", None), getattr(plugin, "field_of_view", None)
    for output in outputs:
        names = {f.name for f in fields(output.value_type)} if _is_dataclass(output) else set()
        if angles is not None and "ranges" in names:
            # As seen from above, beams of a sensor that is mounted upside down turn the other way.
            turn = -1.0 if isinstance(plugin, Laser) and _is_upside_down(plugin) else 1.0
            first, step, count = turn * angles.minimum, turn * angles.increment, angles.count
        elif isinstance(width, int | float) and "range" in names:
            first, step, count = -width / 2, width / (_CONE_BEAMS - 1), _CONE_BEAMS
        else:
            continue
        latest = partial(getattr, *_source(plugin, output))
        return RangingSensor(
            plugin, output, body, origin, first, step, count, float(length), latest
        )
    return None


def _source(plugin: ModelPlugin, output: Output[Any]) -> tuple[object, str]:
    """Returns the object that has the last measurement, and the name of its attribute."""
    return (plugin, "last_scan") if isinstance(plugin, Laser) else (output, "latest")


def _is_dataclass(output: Output[Any]) -> bool:
    return hasattr(output.value_type, "__dataclass_fields__")


def _is_upside_down(laser: Laser) -> bool:
    angles = laser.angles
    y = laser.beam_ends[:2, 1] / laser.range
    upright = np.sin(angles.minimum + angles.increment * np.arange(len(y)))
    return bool(np.abs(y - upright).sum() > np.abs(y + upright).sum())
