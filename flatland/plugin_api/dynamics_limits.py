"""Limits of velocity and acceleration."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from flatland.checks import checked_limit
from flatland.plugin_api.parameters import read_not_negative

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.physics import SpeedLimits


class DynamicsLimits:
    """Limits of a velocity and of its rate of change; 0 means no limit.

    Units are [m/s] and [m/s²], or [rad/s] and [rad/s²].

    Attributes:
        velocity_limit: Maximum speed.
        acceleration_limit: Maximum rate of change of the velocity away from zero.
        deceleration_limit: Maximum rate of change of the velocity towards zero.
    """

    __slots__ = ("acceleration_limit", "deceleration_limit", "velocity_limit")

    def __init__(
        self,
        velocity_limit: float = 0.0,
        acceleration_limit: float = 0.0,
        deceleration_limit: float | None = None,
    ) -> None:
        """Creates limits; 0 or infinity means no limit.

        Args:
            velocity_limit: Maximum speed.
            acceleration_limit: Maximum rate of change of the velocity away from zero.
            deceleration_limit: The same towards zero; None for the acceleration limit.

        Raises:
            ValueError: A limit is negative or NaN.
        """
        if deceleration_limit is None:
            deceleration_limit = acceleration_limit
        self.velocity_limit = _checked("velocity_limit", velocity_limit)
        self.acceleration_limit = _checked("acceleration_limit", acceleration_limit)
        self.deceleration_limit = _checked("deceleration_limit", deceleration_limit)

    @classmethod
    def from_config(cls, reader: YamlReader) -> DynamicsLimits:
        """Reads the limits from an optional map.

        Args:
            reader: Reader of the map, as returned by `YamlReader.optional_subnode`.

        Raises:
            YamlError: A limit is negative or not a number, or a key is unknown.
        """
        if reader.is_null:
            return cls()
        velocity = read_not_negative(reader, "velocity_limit", 0.0)
        acceleration = read_not_negative(reader, "acceleration_limit", 0.0)
        deceleration = read_not_negative(reader, "deceleration_limit", acceleration)
        reader.ensure_accessed_all()
        return cls(velocity, acceleration, deceleration)

    def as_tuple(self) -> SpeedLimits:
        """Returns the limits of velocity, acceleration and deceleration."""
        return (self.velocity_limit, self.acceleration_limit, self.deceleration_limit)

    def limit(self, v: float, target: float, dt: float) -> float:
        """Returns the velocity after one step towards a target.

        Args:
            v: Current velocity.
            target: Commanded velocity.
            dt: Step size [s].
        """
        limit = self.velocity_limit
        if limit:
            target = min(max(target, -limit), limit)
        if target == v:
            return target
        acceleration, deceleration = self.acceleration_limit, self.deceleration_limit
        if v * target < 0:
            change = self._crossing_change(abs(v), dt)
        elif abs(target) > abs(v):
            change = acceleration * dt if acceleration else math.inf
        else:
            change = deceleration * dt if deceleration else math.inf
        return v + min(max(target - v, -change), change)

    def _crossing_change(self, speed: float, dt: float) -> float:
        """Returns the maximum change of velocity in a step whose target has the opposite sign."""
        acceleration, deceleration = self.acceleration_limit, self.deceleration_limit
        if deceleration and speed > deceleration * dt:
            return deceleration * dt
        if not acceleration:
            return math.inf
        time_to_zero = speed / deceleration if deceleration else 0.0
        return speed + acceleration * (dt - time_to_zero)


def _checked(name: str, limit: float) -> float:
    number = checked_limit(name, limit)
    return 0.0 if math.isinf(number) else number
