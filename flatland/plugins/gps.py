"""A satellite navigation receiver."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flatland.geometry import compose
from flatland.plugin_api.parameters import at_key, read_body, read_finite, read_pose, read_rate
from flatland.plugin_api.plugin import ModelPlugin
from flatland.plugins._geodesy import TangentPlane
from flatland.values import NavSatFix

if TYPE_CHECKING:
    from collections.abc import Sequence

    from flatland.config.reader import YamlReader
    from flatland.geometry import Pose
    from flatland.timekeeper import Timekeeper

_DEFAULT_RATE = 10.0  # Hz


class Gps(ModelPlugin):
    """Emits the latitude and longitude of its antenna (`flatland.NavSatFix`)."""

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters."""
        self._body = read_body(config, self.model)
        self._origin = read_pose(config, "origin")
        rate = read_rate(config, default=_DEFAULT_RATE)
        self._broadcast_tf: bool = config.get("broadcast_tf", "bool", True)
        self._frame_id = self.model.frame(config.get("frame", "string", self.name))
        latitude = read_finite(config, "ref_lat", 0.0)
        if not -90.0 <= latitude <= 90.0:
            raise at_key(config, "ref_lat").error(
                f'Invalid "ref_lat", must be from -90 to 90, got {latitude}'
            )
        self._plane = TangentPlane(latitude, read_finite(config, "ref_lon", 0.0))
        self._output = self.output(config.get("topic", "string", "gps/fix"), NavSatFix)
        if self._broadcast_tf:
            parent = self.model.frame(self._body.name)
            self.declare_transform(
                parent, self._frame_id, pose=self._origin, switch="broadcast_tf: false"
            )
        self.on_update(
            self._publish,
            rate,
            phase="before",
            outputs=[self._output],
            transforms=self._broadcast_tf,
            skipped=self._skip,
        )

    def _publish(self, timekeeper: Timekeeper) -> None:
        """Emits the position and sends the transform."""
        if self._output.wanted:
            stamp = timekeeper.sim_time_ns
            self._output.emit(NavSatFix(stamp, self._frame_id, *self.compute_position(), 0.0))
        if self._broadcast_tf:
            parent = self.model.frame(self._body.name)
            self.send_transform(parent, self._frame_id, *self._origin)

    def _skip(self, count: int, stamp: int, poses: Sequence[Pose]) -> None:
        del count, poses
        if self._broadcast_tf:
            parent = self.model.frame(self._body.name)
            self.send_past_transform(stamp, parent, self._frame_id, *self._origin)

    def compute_position(self) -> tuple[float, float]:
        """Returns the current latitude and longitude of the antenna [deg]."""
        east, north, _ = compose(self._body.pose, self._origin)
        return self._plane.geodetic(east, north)
