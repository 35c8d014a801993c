"""A motion along waypoints, for shuttles, doors, lifts and forklifts."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from flatland.geometry import IDENTITY, Pose, compose
from flatland.plugin_api.parameters import (
    MAX_COORDINATE,
    at_key,
    read_body_or_first,
    read_choice,
    read_not_negative,
    read_positive,
)
from flatland.plugin_api.plugin import ModelPlugin

if TYPE_CHECKING:
    from collections.abc import Mapping

    from flatland.config.convert import FloatKind
    from flatland.config.reader import YamlReader
    from flatland.physics import SpeedLimits
    from flatland.plugin_api.ports import Command

MODES = ("loop", "once", "there_and_back", "random")
FRAMES = ("start", "world")
HEADINGS = ("waypoint", "forward")

_NUMBERS = {"waypoint": (2, 3), "forward": (2,)}  # of a waypoint
_KINDS: Final[tuple[FloatKind, ...]] = ("float", "float", "angle")
_FORMS = {2: "[x, y]", 3: "[x, y, theta]"}


class PathFollower(ModelPlugin):
    """Moves a body along waypoints, with limits of speed and acceleration.

    The motion is prescribed: contacts neither stop nor deflect the body. The core carries it out in
    each step (`flatland.physics.PathController`).
    """

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters; the path starts at the current pose of the body."""
        self._body = read_body_or_first(config, self.model, "body")
        heading = read_choice(config, "heading", HEADINGS)
        frame = read_choice(config, "frame", FRAMES)
        origin = self._body.pose if frame == "start" else IDENTITY
        mode = read_choice(config, "mode", MODES)
        linear, angular = _read_limits(config, ""), _read_limits(config, "angular_")
        wait: float = config.get("wait", "float", 0.0, minimum=0, finite=True)
        self._redraws: bool = config.get("redraw", "bool", True)
        self._start_command: Command[bool] | None = None
        self._is_started: bool = config.get("start", "bool", True)
        self._starts = 0
        topic = config.get("start_topic", "string", "")
        if topic:
            self._start_command = self.command(topic, bool, default=self._is_started)
        elif not self._is_started:
            raise at_key(config, "start").error('"start: false" requires a "start_topic"')
        self._controller = self.control(
            self._body.control_path(
                [compose(origin, each) for each in _read_waypoints(config, heading)],
                mode=mode,
                faces_forward=heading == "forward",
                linear=linear,
                angular=angular,
                wait=wait,
                key=_draw_key(self.rng),
            )
        )
        self._controller.set_start(self._is_started, 0)
        if self._start_command is not None:
            self._start_command.on_change = self._start_changed

    def _start_changed(self) -> None:
        self.set_before_step(self._set_start)

    def _set_start(self) -> None:
        command = self._start_command
        if command is None:
            return
        self._is_started, received = command.state
        if self._is_started:
            self._starts = received
        self._controller.set_start(self._is_started, self._starts)

    @property
    def waypoint(self) -> int:
        """Number of the last waypoint that was reached; 0 is the initial pose of the body."""
        return self._controller.state.waypoint

    @property
    def is_moving(self) -> bool:
        """Whether the body is on its way to a waypoint, or waits to leave for it."""
        return self._controller.state.is_moving

    def reseed(self, rng: np.random.Generator) -> None:
        """Continues the random numbers from states that are drawn from a generator."""
        super().reseed(rng)
        self._controller.set_key(_draw_key(self.rng))

    def randomize(self, rng: np.random.Generator) -> None:
        """Draws new random numbers and, unless `redraw` is false, a place on the path."""
        super().randomize(rng)
        if self._redraws:
            self._controller.place(self.rng.random())

    def model_moved(self, previous: Mapping[str, Pose], keep_odometry: bool) -> None:
        """Continues to the same waypoint from the new pose."""
        del previous, keep_odometry
        self._controller.restart()

    def state(self) -> object:
        """Returns the state of the motion."""
        return (self._controller.state, self._is_started, self._starts)


def _draw_key(rng: np.random.Generator) -> int:
    return int(rng.integers(0, 2**64, dtype=np.uint64))


def _read_limits(config: YamlReader, prefix: str) -> SpeedLimits:
    """Reads the limits of speed, acceleration and deceleration of the translation or rotation."""
    speed = read_positive(config, f"{prefix}speed", 1.0)
    acceleration = read_not_negative(config, f"{prefix}acceleration", 0.0)
    deceleration = read_not_negative(config, f"{prefix}deceleration", acceleration)
    return (
        speed,
        0.0 if math.isinf(acceleration) else acceleration,
        0.0 if math.isinf(deceleration) else deceleration,
    )


def _read_waypoints(config: YamlReader, heading: str) -> list[Pose]:
    """Reads the waypoints in their frame; the angle is 0 if it is not given."""
    waypoints: list[Pose] = []
    sizes = _NUMBERS[heading]
    for entry in config.subnode("waypoints", "list").items():
        if not entry.is_list or len(entry) not in sizes:
            expected = " or ".join(_FORMS[size] for size in sizes)
            raise entry.error(f'A waypoint with "heading: {heading}" must be {expected}')
        numbers = [
            entry.get(i, kind, finite=True, minimum=-MAX_COORDINATE, maximum=MAX_COORDINATE)
            for i, kind in zip(range(len(entry)), _KINDS, strict=False)
        ]
        waypoints.append((numbers[0], numbers[1], numbers[2] if len(numbers) > 2 else 0.0))
    if not waypoints:
        raise at_key(config, "waypoints").error('Invalid "waypoints", must not be empty')
    return waypoints
