"""A range sensor with a cone: ultrasound or infrared."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from flatland.config.hints import degrees
from flatland.physics import RangeFinder
from flatland.plugin_api.parameters import at_key, read_choice, read_pose
from flatland.plugins._beams import MAX_BEAMS, end_points, read_layers, read_no_hit
from flatland.plugins._range_sensor import RangeSensor
from flatland.values import Range

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.geometry import FloatArray

RADIATION_TYPES: Final = ("ultrasound", "infrared")


class Sonar(RangeSensor):
    """Measures the distance to the nearest fixture in a cone.

    Attributes:
        field_of_view: Angle of the cone [rad].
        radiation_type: `ultrasound`, which glass and mirrors stop, or `infrared`, which passes and
            is reflected as the beams of a laser.
        origin: (x, y, theta) of the sensor in the body frame; the cone is symmetric about its x
            axis.
        beam_ends: End points of the rays in the sensor frame [m], shape (n, 2), read-only.
    """

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters and declares the output.

        Raises:
            YamlError: A parameter is invalid.
            PluginError: The topic is not a legal name.
        """
        self._read_mounting(config)
        self.field_of_view = self._read_field_of_view(config)
        self.radiation_type = read_choice(config, "radiation_type", RADIATION_TYPES)
        self.origin = read_pose(config, "origin")
        self.beam_ends = self._read_rays(config)
        noise = self._read_updates(config, "range")
        self._finder = RangeFinder(
            self.beam_ends,
            self.range,
            origin=self.origin,
            mask=read_layers(config, self.world),
            range_min=self.range_min,
            no_hit=read_no_hit(config, self.range, "inf"),
            noise=noise,
            out_of_range=self._out_of_range,
            uses_materials=self.radiation_type == "infrared",
            is_cone=True,
        )
        self._start(self.output(config.get("topic", "string", "range"), Range))

    @staticmethod
    def _read_field_of_view(config: YamlReader) -> float:
        angle: float = config.get("field_of_view", "float")
        if not 0 <= angle <= math.tau:
            raise at_key(config, "field_of_view").error(
                f'Invalid "field_of_view", must be from 0 to 2 pi, got {angle}', degrees(angle)
            )
        return angle

    def _read_rays(self, config: YamlReader) -> FloatArray:
        """Returns the end points of rays that no object of a given size fits between."""
        size: float = config.get("smallest_object", "float", 0.02)
        if not size > 0:
            raise config.invalid("smallest_object", f"must be greater than 0, got {size}")
        gaps = self.field_of_view * self.range / size
        if gaps > MAX_BEAMS - 2:
            raise config.invalid(
                "smallest_object",
                f"more than {MAX_BEAMS} rays would be needed to find it in the whole cone, "
                f"got {size}",
            )
        # An odd number, so that one ray is on the axis.
        count = 2 * math.ceil(gaps / 2) + 1
        angles = np.linspace(-0.5, 0.5, count) * self.field_of_view if count > 1 else np.zeros(1)
        return end_points(angles, self.range)

    def _measure(self, stamp: int) -> Range:
        scan = self._scan()
        return Range(
            stamp=stamp,
            frame_id=self.frame_id,
            radiation_type=self.radiation_type,
            field_of_view=self.field_of_view,
            min_range=self.range_min,
            max_range=self.range,
            range=float(scan.ranges[0]),
        )
