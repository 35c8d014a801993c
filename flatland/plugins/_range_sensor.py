"""What range finders have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from flatland.plugin_api.parameters import read_body, read_phase, read_rate
from flatland.plugin_api.plugin import ModelPlugin
from flatland.plugins._beams import read_out_of_range, read_range, read_range_min
from flatland.plugins._range_noise import read_range_noise

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from flatland.config.reader import YamlReader
    from flatland.geometry import Pose
    from flatland.physics import RangeFinder, RangeNoise, Scan
    from flatland.plugin_api.ports import Output
    from flatland.plugin_api.updates import Update
    from flatland.timekeeper import Timekeeper


class RangeSensor(ModelPlugin):
    """Emits readings at a rate while they are wanted, and the transform of the sensor.

    `on_initialize` of a subclass calls `_read_mounting`, sets `origin`, calls `_read_updates`, sets
    `_finder`, and calls `_start`, in this order.

    Attributes:
        body: The body on which the sensor is mounted.
        range: Maximum range [m].
        range_min: Shortest range that is measured [m]; a shorter one is reported as -inf.
        origin: (x, y, theta) of the sensor in the body frame.
        frame_id: Frame of the sensor.
        sends_transform: Whether the transform from the body to this frame is sent.
    """

    origin: Pose
    _finder: RangeFinder
    _roll = 0.0  # of the sensor in the body frame [rad]

    def _read_mounting(self, config: YamlReader) -> None:
        """Reads the body and the limits of the range."""
        self.body = read_body(config, self.model)
        self.range = read_range(config)
        self.range_min = read_range_min(config, self.range)

    def _read_updates(self, config: YamlReader, stream: str) -> RangeNoise | None:
        """Reads the rate, the noise and the frames.

        Args:
            config: Parameters of the plugin.
            stream: Name of the stream of random numbers.

        Returns:
            The noise of ranges.
        """
        self._rate = read_rate(config)
        self._phase = read_phase(config, self._rate)
        noise = read_range_noise(config, self.range)
        self._out_of_range = read_out_of_range(config)
        self._noise = self.noise_stream(stream)
        self.sends_transform: bool = config.get("broadcast_tf", "bool", True)
        self._body_frame_id = self.model.frame(self.body.name)
        self.frame_id = self.model.frame(config.get("frame", "string", self.name))
        return noise

    def _start(
        self, output: Output[Any], prepare: Callable[[Sequence[Any]], object] | None = None
    ) -> Update:
        """Begins to emit readings, and returns the update; see `on_update` for `prepare`."""
        self._output = output
        if self.sends_transform:
            self.declare_transform(
                self._body_frame_id, self.frame_id, pose=self.origin, switch="broadcast_tf: false"
            )
        return self.on_update(
            self._publish,
            self._rate,
            phase=self._phase,
            outputs=[output],
            transforms=self.sends_transform,
            skipped=self._skip,
            prepare=prepare,
        )

    @property
    def _is_wanted(self) -> bool:
        """Whether to emit a reading."""
        return self._output.wanted

    def _scan(self) -> Scan:
        """Casts the rays from the current pose, with the current random numbers."""
        return self._finder.scan(self.body, self._noise.key, self._noise.updates)

    def _measure(self, stamp: int) -> object:
        """Returns a reading with the current random numbers.

        Args:
            stamp: Simulated time [ns].
        """
        raise NotImplementedError

    def _publish(self, timekeeper: Timekeeper) -> None:
        """Sends the transform and emits a reading, if it is wanted."""
        self._noise.begin_update()
        if self.sends_transform:
            self.send_transform(self._body_frame_id, self.frame_id, *self.origin, roll=self._roll)
        if self._is_wanted:
            self._output.emit(self._measure(timekeeper.sim_time_ns))

    def _skip(self, count: int, stamp: int, poses: Sequence[Pose]) -> None:
        """Accounts for skipped updates; see `FlatlandPlugin.on_update`."""
        del poses
        self._noise.begin_update(count)
        if self.sends_transform:
            self.send_past_transform(
                stamp, self._body_frame_id, self.frame_id, *self.origin, roll=self._roll
            )
