"""What range finders with a single kind of reading have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from flatland.plugin_api.after_step import update_after_step
from flatland.plugin_api.parameters import read_body, read_rate
from flatland.plugin_api.plugin import ModelPlugin
from flatland.plugin_api.schedule import when_due
from flatland.plugin_api.update_timer import UpdateTimer
from flatland.plugins._beams import read_range, read_range_min
from flatland.plugins._range_noise import read_range_noise

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.geometry import Pose
    from flatland.physics import RangeNoise
    from flatland.plugin_api.ports import Output
    from flatland.timekeeper import Timekeeper


class RangeSensor(ModelPlugin):
    """Emits readings at a rate while they are wanted, and the transform of the sensor.

    `on_initialize` of a subclass calls `_read_mounting`, sets `origin`, and calls `_read_updates`
    and `_start` in this order.

    Attributes:
        body: The body on which the sensor is mounted.
        range: Maximum range [m].
        range_min: Shortest range that is measured [m]; a shorter one is reported as -inf.
        origin: (x, y, theta) of the sensor in the body frame.
        frame_id: Frame of the sensor.
    """

    origin: Pose

    def _read_mounting(self, config: YamlReader) -> None:
        """Reads the body and the limits of the range."""
        self.body = read_body(config, self.model)
        self.range = read_range(config)
        self.range_min = read_range_min(config, self.range)

    def _read_updates(self, config: YamlReader, stream: str) -> tuple[str, RangeNoise | None]:
        """Reads the rate, the noise and the frames.

        Args:
            config: Parameters of the plugin.
            stream: Name of the stream of random numbers.

        Returns:
            The hook in which updates are due, and the noise of ranges.
        """
        self._timer = UpdateTimer(read_rate(config))
        hook = update_after_step(self, config, self._timer)
        noise = read_range_noise(config, self.range)
        self._noise = self.noise_stream(stream)
        self._sends_transform: bool = config.get("broadcast_tf", "bool", True)
        self._body_frame_id = self.model.frame(self.body.name)
        self.frame_id = self.model.frame(config.get("frame", "string", self.name))
        return hook, noise

    def _start(self, hook: str, output: Output[Any]) -> None:
        """Begins to emit readings in a hook."""
        self._output = output
        self.call_when_due(
            hook,
            self._timer,
            outputs=[output],
            transforms=self._sends_transform,
            skipped=self._skip,
        )

    def _measure(self, stamp: int) -> object:
        """Returns a reading with the current random numbers.

        Args:
            stamp: Simulated time [ns].
        """
        raise NotImplementedError

    @when_due
    def before_physics_step(self, timekeeper: Timekeeper) -> None:
        """Sends the transform and emits a reading, if it is wanted, when an update is due."""
        if not self._timer.check_update(timekeeper):
            return
        self._noise.begin_update()
        if self._sends_transform:
            self.send_transform(self._body_frame_id, self.frame_id, *self.origin)
        if self._output.wanted:
            self._output.emit(self._measure(timekeeper.sim_time_ns))

    def _skip(self, count: int, stamp: int, poses: tuple[Pose, ...]) -> None:
        """Accounts for skipped updates; see `FlatlandPlugin.call_when_due`."""
        del poses
        self._noise.begin_update(count)
        if self._sends_transform:
            self.send_past_transform(stamp, self._body_frame_id, self.frame_id, *self.origin)
