"""A prescribed motion between two poses, for doors, lifts and moving obstacles."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

import numpy as np

from flatland.geometry import Pose
from flatland.plugin_api.parameters import at_key, read_body, read_finite, read_pose
from flatland.plugin_api.plugin import ModelPlugin
from flatland.plugins._easing import EASINGS

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.plugin_api.ports import Command
    from flatland.timekeeper import Timekeeper

_LOG = logging.getLogger("flatland")

MODES = ("yoyo", "loop", "once", "trigger")

# Difference at which the 32-bit progress is corrected to the exact one, and progress below which a
# backward motion is complete.
_ROUNDING_TOLERANCE = 1e-5


class Tween(ModelPlugin):
    """Moves a body between its initial pose and the pose at the offset `delta`.

    The motion is prescribed: contacts neither stop nor deflect the body.
    """

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters; the motion starts at the current pose of the body."""
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
        self._is_dynamic = self._body.type == "dynamic"
        self._progress = np.float32(0.0)
        self._exact_progress = 0.0
        self._forward = True
        self._pose: Pose = self._start

    def _read_trigger(self, config: YamlReader) -> Command[bool] | None:
        topic = config.get("trigger_topic", "string", "")
        if self._mode == "trigger":
            if topic:
                return self.command(topic, bool)
            _LOG.warning(
                'tween "%s" of model "%s" never moves: mode trigger requires a trigger_topic',
                self.name,
                self.model.name,
            )
        elif topic:
            _LOG.warning(
                'tween "%s" of model "%s" ignores its trigger_topic in mode %s',
                self.name,
                self.model.name,
                self._mode,
            )
        return None

    def before_physics_step(self, timekeeper: Timekeeper) -> None:
        """Advances the motion by one step."""
        self._advance(min(timekeeper.step_size / self._duration, 1.0))
        eased = self._ease(float(self._progress))
        start, delta = self._start, self._delta
        self._pose = (
            start[0] + delta[0] * eased,
            start[1] + delta[1] * eased,
            start[2] + delta[2] * eased,
        )
        self._hold()

    def after_physics_step(self, timekeeper: Timekeeper) -> None:
        """Reverts the effect of the physics step on the body."""
        self._hold()

    def state(self) -> object:
        """Returns the progress along the path, and whether the motion is forward."""
        return (self._progress, self._exact_progress, self._forward)

    def _hold(self) -> None:
        # Also wakes the body: Box2D puts bodies without velocity to sleep and then finds no new
        # contacts for them.
        self._body.set_pose(*self._pose)
        # A dynamic body would keep the velocity from contacts and act like a conveyor belt.
        if self._is_dynamic:
            self._body.set_velocity(0.0, 0.0, 0.0)

    def _advance(self, step: float) -> None:
        if self._mode == "trigger":
            self._forward = self._trigger is not None and self._trigger.value
        elif self._mode == "loop" and self._progress == 1.0:
            self._set_progress(0.0)
        elif self._mode == "yoyo" and self._progress in (0.0, 1.0):
            self._forward = self._progress == 0.0
        signed = step if self._forward else -step
        # The reference accumulates 32-bit floats, whose rounding decides in which of two steps the
        # motion ends; the same sum is used here. Unlike the reference: an additional exact sum
        # corrects it where the steps are too small or too many for 32 bits.
        self._progress += np.float32(signed)
        self._exact_progress += signed
        if abs(self._progress - self._exact_progress) > _ROUNDING_TOLERANCE:
            self._progress = np.float32(self._exact_progress)
        if self._forward and self._progress >= 1.0:
            self._set_progress(1.0)
        elif not self._forward and self._progress < _ROUNDING_TOLERANCE:
            self._set_progress(0.0)

    def _set_progress(self, progress: float) -> None:
        self._progress = np.float32(progress)
        self._exact_progress = progress
