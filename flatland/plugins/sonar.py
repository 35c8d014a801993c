"""A range sensor with a cone: ultrasound or infrared."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from flatland.physics import RangeFinder
from flatland.plugin_api.after_step import update_after_step
from flatland.plugin_api.parameters import at_key, read_body, read_pose, read_rate
from flatland.plugin_api.plugin import ModelPlugin
from flatland.plugin_api.schedule import when_due
from flatland.plugin_api.update_timer import UpdateTimer
from flatland.plugins._beams import (
    MAX_BEAMS,
    read_layers,
    read_no_hit,
    read_range,
    read_range_min,
)
from flatland.plugins._range_noise import read_range_noise
from flatland.values import Range

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.geometry import FloatArray, Pose
    from flatland.timekeeper import Timekeeper

RADIATION_TYPES: Final = ("ultrasound", "infrared")


class Sonar(ModelPlugin):
    """Measures the distance to the nearest fixture in a cone.

    Attributes:
        body: The body on which the sensor is mounted.
        range: Maximum range [m].
        range_min: Shortest range that is measured [m]; a shorter one is reported as -inf.
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
        self.body = read_body(config, self.model)
        self.range = read_range(config)
        self.range_min = read_range_min(config, self.range)
        self.field_of_view = self._read_field_of_view(config)
        self.radiation_type = config.get("radiation_type", "string", RADIATION_TYPES[0])
        if self.radiation_type not in RADIATION_TYPES:
            raise at_key(config, "radiation_type").error(
                f'Invalid "radiation_type", must be one of: {", ".join(RADIATION_TYPES)}, '
                f"got {self.radiation_type}"
            )
        self.origin = read_pose(config, "origin")
        self.beam_ends = self._read_rays(config)
        self._timer = UpdateTimer(read_rate(config))
        hook = update_after_step(self, config, self._timer)
        noise = read_range_noise(config, self.range)
        self._noise = self.noise_stream("range")
        self._sends_transform: bool = config.get("broadcast_tf", "bool", True)
        self._body_frame_id = self.model.frame(self.body.name)
        self.frame_id = self.model.frame(config.get("frame", "string", self.name))
        self._finder = RangeFinder(
            self.beam_ends,
            self.range,
            origin=self.origin,
            mask=read_layers(config, self.world),
            range_min=self.range_min,
            no_hit=read_no_hit(config, self.range, "inf"),
            noise=noise,
            uses_materials=self.radiation_type == "infrared",
            is_cone=True,
        )
        self._output = self.output(config.get("topic", "string", "range"), Range)
        self.call_when_due(
            hook,
            self._timer,
            outputs=[self._output],
            transforms=self._sends_transform,
            skipped=self._skip,
        )

    @staticmethod
    def _read_field_of_view(config: YamlReader) -> float:
        angle: float = config.get("field_of_view", "float")
        if not 0 <= angle <= math.tau:
            raise at_key(config, "field_of_view").error(
                f'Invalid "field_of_view", must be from 0 to 2 pi, got {angle}'
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
        ends = self.range * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        points = np.ascontiguousarray(ends, dtype=np.float32)
        points.flags.writeable = False
        return points

    @when_due
    def before_physics_step(self, timekeeper: Timekeeper) -> None:
        """Sends the transform and emits a range, if it is wanted, when an update is due."""
        if not self._timer.check_update(timekeeper):
            return
        self._noise.begin_update()
        if self._sends_transform:
            self.send_transform(self._body_frame_id, self.frame_id, *self.origin)
        if self._output.wanted:
            self._output.emit(self._measure(timekeeper.sim_time_ns))

    def _measure(self, stamp: int) -> Range:
        scan = self._finder.scan(self.body, self._noise.key, self._noise.updates)
        return Range(
            stamp=stamp,
            frame_id=self.frame_id,
            radiation_type=self.radiation_type,
            field_of_view=self.field_of_view,
            min_range=self.range_min,
            max_range=self.range,
            range=float(scan.ranges[0]),
        )

    def _skip(self, count: int, stamp: int, poses: tuple[Pose, ...]) -> None:
        """Accounts for skipped updates; see `FlatlandPlugin.call_when_due`."""
        del poses
        self._noise.begin_update(count)
        if self._sends_transform:
            self.send_past_transform(stamp, self._body_frame_id, self.frame_id, *self.origin)
