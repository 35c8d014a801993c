"""The message `status` of one world, with the real-time factor."""

from __future__ import annotations

import math
from collections import deque
from typing import Final

from flatland.web.capture import CapturedWorld
from flatland.web.encoding import text_message
from flatland.web.views import Received

STATUS_PERIOD: Final = 0.2  # s of wall time between two messages `status`
RATE_WINDOW: Final = 1.0  # s of wall time over which the real-time factor is measured
STALE_TIMEOUT: Final = 0.5  # s without an answer of the simulator before clients are informed
_MARGIN: Final = 1 / 30  # s by which a capture may be late and remains in the window


class WorldStatus:
    """Time, rate and real-time factor of one world, for clients.

    All wall times are times of the same clock [s].
    """

    def __init__(self, index: int) -> None:
        """Creates the status of a world that has not been captured.

        Args:
            index: Index of the world in messages.
        """
        self._index = index
        self._last: CapturedWorld | None = None
        self._answered = -math.inf
        self._times: deque[tuple[float, float]] = deque()  # wall time, simulated time
        self._text = ""
        self._version = 0
        self._due = -math.inf

    def apply(self, captured: CapturedWorld, asked: float, answered: float) -> None:
        """Updates the status; the message is renewed after its period, a pause or a new rate.

        Args:
            captured: The captured world.
            asked: Wall time at which the capture was requested.
            answered: Wall time at which the capture was received.
        """
        previous, self._last = self._last, captured
        self._answered = answered
        self._times.append((asked, captured.time))
        if captured.time < self._times[0][1]:  # The world was reset.
            self._times.clear()
        while self._times and asked - self._times[0][0] > RATE_WINDOW + _MARGIN:
            self._times.popleft()
        changed = previous is None or (previous.paused, previous.rate) != (
            captured.paused,
            captured.rate,
        )
        if changed or asked >= self._due:
            self.renew(asked)

    def renew(self, now: float) -> None:
        """Creates a new message with the wall time since the last answer."""
        self._due = now + STATUS_PERIOD
        last = self._last
        if last is None:
            return
        self._version += 1
        silence = now - self._answered
        rate = last.rate
        self._text = text_message(
            {
                "type": "status",
                "world": self._index,
                "time": last.time,
                "paused": last.paused,
                "rate": None if rate is None else 0 if math.isinf(rate) else rate,
                "real_time_factor": None if last.lockstep else self._real_time_factor(),
                "lockstep": last.lockstep,
                "stale": round(silence, 1) if silence > STALE_TIMEOUT else 0,
            }
        )

    def restart(self) -> None:
        """Restarts the measurement of the real-time factor, after a time without captures."""
        self._times.clear()

    def next_message(self, received: Received) -> str | None:
        """Returns the message if a client has not received it, else None.

        Args:
            received: What the client has received; updated.
        """
        if received.status >= self._version:
            return None
        received.status = self._version
        return self._text

    def _real_time_factor(self) -> float:
        if len(self._times) < 2:
            return 0.0
        (wall_0, time_0), (wall_1, time_1) = self._times[0], self._times[-1]
        return round((time_1 - time_0) / (wall_1 - wall_0), 4) if wall_1 > wall_0 else 0.0
