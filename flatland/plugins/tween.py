"""A prescribed motion between two poses, for doors, lifts and moving obstacles."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from flatland.config.hints import did_you_mean
from flatland.plugin_api.parameters import at_key, read_body, read_finite, read_pose
from flatland.plugin_api.plugin import ModelPlugin
from flatland.plugins._easing import EASINGS

if TYPE_CHECKING:
    import numpy as np

    from flatland.config.reader import YamlReader
    from flatland.plugin_api.ports import Command

_LOG = logging.getLogger("flatland")

MODES = ("yoyo", "loop", "once", "trigger")


class Tween(ModelPlugin):
    """Moves a body between its initial pose and the pose at the offset `delta`.

    The motion is prescribed: contacts neither stop nor deflect the body. The core carries it out in
    each step (`flatland.physics.TweenController`).
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
            hint = did_you_mean(self._mode, MODES, "modes")
            raise at_key(config, "mode").error(f"Mode {self._mode} does not exist", hint)
        easing = config.get("easing", "string", "linear")
        if easing not in EASINGS:
            hint = did_you_mean(easing, EASINGS, "easings")
            raise at_key(config, "easing").error(f"Easing {easing} does not exist", hint)
        self._redraws: bool = config.get("redraw", "bool", True)
        self._trigger = self._read_trigger(config)
        self._controller = self.control(
            self._body.control_tween(
                self._delta, duration=self._duration, mode=self._mode, easing=easing
            )
        )
        if self._trigger is not None:
            self._trigger.on_change = self._trigger_changed

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

    def _trigger_changed(self) -> None:
        self.set_before_step(self._set_trigger)

    def _set_trigger(self) -> None:
        if self._trigger is not None:
            self._controller.set_trigger(self._trigger.value)

    def randomize(self, rng: np.random.Generator) -> None:
        """Draws new random numbers and, unless `redraw` is false, a place in the motion."""
        super().randomize(rng)
        if self._redraws:
            self._controller.place(self.rng.random())

    def state(self) -> object:
        """Returns the progress along the path, and whether the motion is forward."""
        return self._controller.state
