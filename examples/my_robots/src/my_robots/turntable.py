"""A body that rotates on command, translated from C++."""

from flatland import ModelPlugin, Timekeeper, UpdateTimer, YamlReader
from flatland.plugins.parameters import read_body, read_finite, read_rate


class Turntable(ModelPlugin):
    """Rotates a body while `run` is true, and publishes whether it rotates."""

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters and declares the ports."""
        self._body = read_body(config, self.model)
        self._speed = read_finite(config, "speed", 1.0)
        self._timer = UpdateTimer(read_rate(config, default=10.0))
        self._turning = self.output("turning", bool)
        self._run = self.command("run", bool)

    def before_physics_step(self, timekeeper: Timekeeper) -> None:
        """Sets the velocity for this step, and publishes if an update is due."""
        self._body.set_velocity(0.0, 0.0, self._speed if self._run.value else 0.0)
        if self._timer.check_update(timekeeper) and self._turning.wanted:
            self._turning.emit(self._run.value)
