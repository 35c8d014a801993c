"""Angles and speeds of wheels, computed from the motion of their bodies."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from flatland.physics import RollingWheel
from flatland.plugin_api.parameters import (
    at_key,
    find_body,
    read_body_or_first,
    read_finite,
    read_point,
    read_rate,
)
from flatland.plugin_api.plugin import ModelPlugin
from flatland.values import JointState

if TYPE_CHECKING:
    from collections.abc import Mapping

    from flatland.config.reader import YamlReader
    from flatland.entities.body import Body
    from flatland.geometry import Pose
    from flatland.timekeeper import Timekeeper

_MOST_TICKS = 1_000_000_000
_SMALLEST_RADIUS = 1e-6  # m; angles remain finite


class WheelStates(ModelPlugin):
    """Emits the angles and speeds of wheels that roll on the ground (`flatland.JointState`).

    The core adds up the angles in each step (`flatland.physics.WheelsController`).
    """

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters."""
        body = read_body_or_first(config, self.model, "body")
        rate = read_rate(config)
        self._ticks = config.get("ticks_per_turn", "int", 0, minimum=0, maximum=_MOST_TICKS)
        names: list[str] = []
        wheels: list[RollingWheel] = []
        for entry in config.subnode("wheels", "list").items():
            name = entry.get("name", "string")
            if name in names:
                raise entry.subnode("name").error(f'Wheel with name "{name}" exists twice')
            names.append(name)
            wheels.append(self._read_wheel(entry, body))
            entry.ensure_accessed_all()
        if not wheels:
            raise at_key(config, "wheels").error('Invalid "wheels", must not be empty')
        self._names = tuple(names)
        self._controller = self.control(self.model.world.physics.measure_wheels(wheels))
        self._output = self.output(config.get("topic", "string", "joint_states"), JointState)
        self.on_update(self._publish, rate, outputs=[self._output])

    def _read_wheel(self, entry: YamlReader, default: Body) -> RollingWheel:
        name = entry.get("body", "string", default.name)
        radius = entry.get("radius", "float", finite=True, minimum=_SMALLEST_RADIUS)
        free = read_finite(entry, "roller_angle", math.pi / 2)
        if abs(math.sin(free)) < 1e-6:
            raise at_key(entry, "roller_angle").error(
                f'Invalid "roller_angle", the wheel must not move freely where it rolls, got {free}'
            )
        return RollingWheel(
            find_body(entry, "body", self.model, name),
            read_point(entry, "position"),
            read_finite(entry, "heading", 0.0),
            radius,
            # Exactly 0 for a wheel that slides sideways.
            0.0 if free == math.pi / 2 else 1.0 / math.tan(free),
        )

    @property
    def angles(self) -> tuple[float, ...]:
        """Exact angles of the wheels since the start, positive if they roll forwards [rad]."""
        return tuple(angle for angle, _ in self._controller.states)

    @property
    def speeds(self) -> tuple[float, ...]:
        """Speeds of the wheels [rad/s]."""
        return tuple(speed for _, speed in self._controller.states)

    def _publish(self, timekeeper: Timekeeper) -> None:
        """Emits the angles and speeds."""
        if self._output.wanted:
            positions = tuple(self._encoded(angle) for angle in self.angles)
            self._output.emit(
                JointState(timekeeper.sim_time_ns, self._names, positions, self.speeds)
            )

    def _encoded(self, angle: float) -> float:
        """Returns an angle as an encoder measures it: the angle of the last tick passed."""
        if not self._ticks:
            return angle
        return math.floor(angle / math.tau * self._ticks) * math.tau / self._ticks

    def model_moved(self, previous: Mapping[str, Pose], keep_odometry: bool) -> None:
        """Continues from the new pose; a move does not turn the wheels."""
        del previous, keep_odometry
        self._controller.skip()

    def state(self) -> object:
        """Returns the angles of the wheels."""
        return self.angles
