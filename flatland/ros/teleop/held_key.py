"""Velocities for the keys of a terminal, which reports presses and repetitions but no releases."""

from __future__ import annotations

import math
import re
from typing import Final

# Signs of the linear and the angular velocity. Backwards, the rear turns to the side of the key.
DIRECTIONS: Final[dict[str, tuple[int, int]]] = {
    "w": (1, 0),
    "s": (-1, 0),
    "a": (0, 1),
    "d": (0, -1),
    "q": (1, 1),
    "e": (1, -1),
    "z": (-1, -1),
    "c": (-1, 1),
}
STOP_KEYS: Final = (" ", "x")
FASTER_KEYS: Final = ("+", "=")
SLOWER_KEYS: Final = ("-", "_")

_ARROWS: Final = {b"A": "w", b"B": "s", b"C": "d", b"D": "a"}
_ESCAPE: Final = re.compile(rb"\x1b(?:\[[0-9;]*([A-Za-z~])|O([A-Za-z]))")
_PARTIAL_ESCAPE: Final = re.compile(rb"\x1b(?:\[[0-9;]*|O)?\Z")
_MAX_ESCAPE: Final = 16  # bytes; no key sends a longer sequence


def decode(data: bytes) -> tuple[list[str], bytes]:
    """Converts the input of a terminal to keys.

    Args:
        data: What was read; a connection can split the sequence of an arrow key.

    Returns:
        The keys in lower case, arrows as the letters with the same meaning, and the rest of the
        input, which is the start of a sequence.
    """
    keys: list[str] = []
    while data:
        if data.startswith(b"\x1b"):
            escape = _ESCAPE.match(data)
            if escape:
                keys += filter(None, [_ARROWS.get(escape[1] or escape[2])])
                data = data[escape.end() :]
                continue
            if _PARTIAL_ESCAPE.match(data) and len(data) < _MAX_ESCAPE:
                return keys, data
        elif data[0] < 0x80:
            keys.append(chr(data[0]).lower())
        data = data[1:]
    return keys, b""


class HeldKey:
    """The velocity of the key that is held.

    A key counts as held until a time without repetition. The first repetition of a terminal is
    later than the others: after `repeat_delay`, for which a single press therefore counts as well.
    Only the last key is repeated if several are held, so that the last key alone counts.

    Attributes:
        scale: Share of the maximum velocities that is used.
    """

    def __init__(
        self,
        max_linear: float,
        max_angular: float,
        *,
        repeat_delay: float,
        key_timeout: float,
    ) -> None:
        """Creates the state without a held key, at half of the maximum velocities.

        Args:
            max_linear: Maximum velocity [m/s].
            max_angular: Maximum angular velocity [rad/s].
            repeat_delay: Time from a press to the first repetition [s].
            key_timeout: Time after a repetition in which the next one is expected [s].
        """
        self.scale = 0.5
        self._max_linear = max_linear
        self._max_angular = max_angular
        self._repeat_delay = repeat_delay
        self._key_timeout = key_timeout
        self._key = ""
        self._end = -math.inf

    def press(self, key: str, now: float) -> None:
        """Handles a key.

        Args:
            key: The key, in lower case.
            now: Current time [s].
        """
        if key in DIRECTIONS:
            repeated = key == self._key and now <= self._end
            self._key = key
            self._end = now + (self._key_timeout if repeated else self._repeat_delay)
        elif key in STOP_KEYS:
            self._end = -math.inf
        elif key in FASTER_KEYS:
            self.scale = min(1.0, round(self.scale + 0.1, 1))
        elif key in SLOWER_KEYS:
            self.scale = max(0.1, round(self.scale - 0.1, 1))

    def remaining(self, now: float) -> float:
        """Returns the time until the held key counts as released [s]; 0 if none is held."""
        return max(0.0, self._end - now)

    def velocity(self, now: float) -> tuple[float, float]:
        """Returns the linear [m/s] and angular velocity [rad/s]; zeros if no key is held."""
        if not self.remaining(now):
            return 0.0, 0.0
        linear, angular = DIRECTIONS[self._key]
        return linear * self.linear, angular * self.angular

    @property
    def linear(self) -> float:
        """Velocity forwards [m/s]."""
        return self.scale * self._max_linear

    @property
    def angular(self) -> float:
        """Angular velocity [rad/s]."""
        return self.scale * self._max_angular
