"""The beams of range finders, and the parameters that these have in common."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flatland.config.hints import MAX_TURNS, did_you_mean
from flatland.physics import BeamFan
from flatland.plugin_api.parameters import at_key, read_choice

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.geometry import DoubleArray, FloatArray
    from flatland.plugin_api.plugin_world import PluginWorld

MAX_BEAMS = 1_000_000
_FEW_BEAMS = 3  # which may have any angles
_WIDE = 0.5  # rad between beams, 29 degrees
OUT_OF_RANGE = ("keep", "clamp", "drop")
MAX_RANGE = 1e6  # m; the spacing of single-precision numbers is 6 cm there


@dataclass(frozen=True, slots=True)
class BeamAngles:
    """The beam angles of a laser [rad]; beam i is at `minimum + i * increment`."""

    minimum: float
    maximum: float
    increment: float
    count: int

    @classmethod
    def from_config(cls, config: YamlReader) -> BeamAngles:
        """Reads the beam angles.

        Args:
            config: Parameters of the plugin, with the map `angle`.

        Raises:
            YamlError: A number is missing or not finite, the sign of the increment does not fit
                the limits, or there would be more than `MAX_BEAMS` beams.
        """
        reader = config.subnode("angle", "map")
        numbers = [reader.get(key, "float") for key in ("min", "max", "increment")]
        reader.ensure_accessed_all()
        if not all(map(math.isfinite, numbers)):
            raise reader.error(f'Invalid "angle" params, must be finite, got {numbers}')
        minimum, maximum, increment = numbers
        if increment == 0:
            raise reader.error('Invalid "angle" params, increment must not be zero!')
        if increment > 0 and maximum < minimum:
            raise reader.error('Invalid "angle" params, must have max > min when increment > 0')
        if increment < 0 and minimum < maximum:
            raise reader.error('Invalid "angle" params, must have min > max when increment < 0')
        # A product, as the quotient overflows for a tiny increment.
        if abs(maximum - minimum) >= (MAX_BEAMS - 0.5) * abs(increment):
            raise reader.error(
                f'Invalid "angle" params, more than {MAX_BEAMS} beams between {minimum} and '
                f"{maximum} in steps of {increment}"
            )
        count = math.floor((maximum - minimum) / increment + 0.5) + 1
        _warn_about_degrees(config, minimum, maximum, increment, count)
        return cls(minimum, maximum, increment, count)

    @functools.lru_cache(maxsize=16)  # noqa: B019 - shared by all robots of one kind
    def end_points(self, length: float, upside_down: bool) -> FloatArray:
        """Returns the ends of beams of a length [m], sensor frame, shape (count, 2), read-only."""
        angles = self.minimum + self.increment * np.arange(self.count, dtype=np.float64)
        if upside_down:
            angles = -angles
        return end_points(angles, length)

    @functools.lru_cache(maxsize=16)  # noqa: B019 - shared by all robots of one kind
    def fan(self, length: float, upside_down: bool) -> BeamFan:
        """Returns the beams of a length [m] prepared for scans, sensor frame."""
        return BeamFan(self.end_points(length, upside_down))


def _warn_about_degrees(
    config: YamlReader, minimum: float, maximum: float, increment: float, count: int
) -> None:
    """Logs a warning about angles that are probably in degrees, if the reader collects errors."""
    angles = f"min: {minimum:g}, max: {maximum:g}, increment: {increment:g}"
    turns = max(map(abs, (minimum, maximum, maximum - minimum))) / math.tau
    if turns > MAX_TURNS:
        what = f"{{{angles}}}, which is more than a full turn"
        low, high, step = map(math.radians, (minimum, maximum, increment))
        hint = f"{{min: {low:.6g}, max: {high:.6g}, increment: {step:.6g}}}"
        config.warn("angle", what, f"angles are in radians; for degrees, write {hint}")
    elif (
        count > _FEW_BEAMS
        and abs(increment) >= _WIDE
        and (2 * increment).is_integer()
        and any(math.remainder(angle, increment) for angle in (minimum, maximum))
    ):
        what = f"{{{angles}}}, which are only {count} beams"
        only = f"increment: {math.radians(increment):.6g}"
        config.warn("angle", what, f"angles are in radians; for degrees, write {only}")


def end_points(angles: DoubleArray, length: float) -> FloatArray:
    """Returns the ends of beams, sensor frame, shape (n, 2), read-only.

    Args:
        angles: Angles of the beams [rad].
        length: Length of the beams [m].
    """
    ends = length * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    points = np.ascontiguousarray(ends, dtype=np.float32)
    points.flags.writeable = False
    return points


def read_range(config: YamlReader) -> float:
    """Reads the maximum range [m].

    Raises:
        YamlError: The value is not a number, not positive or above `MAX_RANGE`.
    """
    length: float = config.get("range", "float")
    if not 0 < length <= MAX_RANGE:
        raise at_key(config, "range").error(
            f'Invalid "range", must be greater than 0 and at most {MAX_RANGE:g} m, got {length}'
        )
    return length


def read_range_min(config: YamlReader, length: float) -> float:
    """Reads the minimum range [m].

    Args:
        config: Parameters of the plugin.
        length: Maximum range [m].

    Raises:
        YamlError: The value is not a number, negative, or not less than the maximum range.
    """
    shortest: float = config.get("range_min", "float", 0.0)
    if not 0 <= shortest < length:
        raise config.invalid(
            "range_min",
            f'must not be negative and less than "range", {length:g} m, got {shortest}',
        )
    return shortest


def read_no_hit(config: YamlReader, length: float, default: str = "nan") -> float:
    """Reads the range that is reported without a hit [m].

    Args:
        config: Parameters of the plugin.
        length: Maximum range [m].
        default: Name of the default value.

    Raises:
        YamlError: The value is not one of the names.
    """
    values = {"nan": math.nan, "inf": math.inf, "range": length}
    return values[read_choice(config, "no_hit", list(values), default)]


def read_out_of_range(config: YamlReader) -> str:
    """Reads what becomes of a hit that noise moves out of the limits of the sensor.

    Raises:
        YamlError: The value is not one of the names.
    """
    return read_choice(config, "out_of_range", OUT_OF_RANGE)


def read_layers(config: YamlReader, world: PluginWorld) -> int:
    """Reads the names of the detected layers, and returns their category bits.

    Raises:
        YamlError: A layer does not exist.
    """
    layers = config.get_list("layers", "string", ["all"])
    collision_filter = world.collision_filter
    unknown = collision_filter.unknown(layers)
    if unknown:
        hint = did_you_mean(unknown[0], collision_filter.names, "layers of the world")
        text = f"Cannot find layer(s): {{{','.join(unknown)}}}"
        raise at_key(config, "layers").error(text, hint)
    return collision_filter.category_bits(layers)
