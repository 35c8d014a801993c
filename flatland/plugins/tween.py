"""A motion along a fixed way: doors, lifts, things that go to and fro."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

import numpy as np

from flatland.geometry import Pose
from flatland.plugin import ModelPlugin
from flatland.plugins.easing import EASINGS
from flatland.plugins.parameters import at_key, read_body, read_finite, read_pose

if TYPE_CHECKING:
    from flatland.ports import Command
    from flatland.timekeeper import Timekeeper
    from flatland.yaml_reader import YamlReader

_LOG = logging.getLogger("flatland")

MODES = ("yoyo", "loop", "once", "trigger")

# How near to its end a motion counts as there: the sum of many steps misses 1 by some rounding,
# and the end would come a step late.
_END_TOLERANCE = 1e-6

# The reference adds up its progress in 32-bit floats. One curve shows the last bit of that sum:
# circularInOut is vertical in the middle, where 6e-8 of progress are 0.24 mm in a metre. So the
# same sum is taken, as long as it is as good as this; 64 bits beside it keep it there, for steps
# that are too small for 32.
_ROUNDING_TOLERANCE = 1e-6


class Tween(ModelPlugin):
    """Moves a body to and fro between its pose at the start and one `delta` away.

    The way is prescribed: nothing that the body touches holds it up or pushes it off.
    """

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters and takes the body's pose as the start."""
        self._body = read_body(config, self.model)
        self._delta = read_pose(config, "delta")
        self._duration = read_finite(config, "duration", 1.0)
        if self._duration <= 0.0:
            raise at_key(config, "duration").error(
                f'Invalid "duration", must be greater than 0, got {self._duration}'
            )
        self._mode: str = config.get("mode", "string", "yoyo")
        if self._mode not in MODES:
            raise at_key(config, "mode").error(f"Mode {self._mode} does not exist")
        easing = config.get("easing", "string", "linear")
        if easing not in EASINGS:
            raise at_key(config, "easing").error(f"Easing {easing} does not exist")
        self._ease = EASINGS[easing]
        self._trigger = self._read_trigger(config)

        self._start = self._body.pose
        self._progress = 0.0
        self._rounded = np.float32(0.0)
        self._forward = True
        self._pose: Pose = self._start

    def _read_trigger(self, config: YamlReader) -> Command[bool] | None:
        topic = config.get("trigger_topic", "string", "")
        if self._mode == "trigger":
            if topic:
                return self.command(topic, bool)
            _LOG.warning(
                'tween "%s" of model "%s" never moves: mode trigger needs a trigger_topic',
                self.name,
                self.model.name,
            )
        elif topic:
            _LOG.warning(
                'tween "%s" of model "%s" has no use for a trigger_topic in mode %s',
                self.name,
                self.model.name,
                self._mode,
            )
        return None

    def before_physics_step(self, timekeeper: Timekeeper) -> None:
        """Moves the body on."""
        self._advance(timekeeper.step_size / self._duration)
        eased = self._ease(float(self._rounded))
        start, delta = self._start, self._delta
        self._pose = (
            start[0] + delta[0] * eased,
            start[1] + delta[1] * eased,
            start[2] + delta[2] * eased,
        )
        self._hold()
        # Box2D lets what does not move by itself fall asleep, and then asks for no contacts.
        self._body.awake = True

    def after_physics_step(self, timekeeper: Timekeeper) -> None:
        """Takes back what the physics step did to the body."""
        self._hold()

    def _hold(self) -> None:
        self._body.set_pose(*self._pose)
        # A dynamic body keeps what others gave it, and would push like a conveyor belt.
        if self._body.type == "dynamic":
            self._body.set_velocity(0.0, 0.0, 0.0)

    def _advance(self, step: float) -> None:
        if self._mode == "trigger":
            self._forward = self._trigger is not None and self._trigger.value
        elif self._mode == "loop" and self._progress == 1.0:
            self._progress = 0.0
            self._rounded = np.float32(0.0)
        elif self._mode == "yoyo" and self._progress in (0.0, 1.0):
            self._forward = self._progress == 0.0
        signed = step if self._forward else -step
        self._progress += signed
        if self._forward and self._progress > 1.0 - _END_TOLERANCE:
            self._progress = 1.0
        elif not self._forward and self._progress < _END_TOLERANCE:
            self._progress = 0.0
        self._rounded += np.float32(signed)
        at_end = self._progress in (0.0, 1.0)
        if at_end or abs(self._rounded - self._progress) > _ROUNDING_TOLERANCE:
            self._rounded = np.float32(self._progress)
