"""The latest scan of each laser of one world, encoded once for all clients."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from flatland.web import encoding
from flatland.web.capture import NewScan
from flatland.web.client_view import Seen


class ScanState:
    """The latest scan of each laser of one world."""

    def __init__(self, index: int) -> None:
        """Creates a state without scans.

        Args:
            index: Index of the world in messages.
        """
        self._index = index
        self._tick = 0
        # By laser: the capture, the encoded scans of this capture, and the row of this laser.
        self._scans: dict[int, tuple[int, encoding.ScanParts, int]] = {}
        self._newest: list[tuple[int, bytes]] = []  # of the last capture, with their number

    def apply(self, scans: list[NewScan], tick: int) -> None:
        """Takes over the scans of a capture.

        Args:
            scans: The scans that are new.
            tick: Number of the capture.
        """
        self._tick = tick
        by_count: dict[int, list[NewScan]] = {}
        for scan in scans:
            by_count.setdefault(len(scan.ranges), []).append(scan)
        self._newest = []
        for count, same in by_count.items():
            fractions = encoding.quantized(
                np.concatenate([scan.ranges for scan in same]).reshape(-1, count),
                np.array([scan.range_max for scan in same], np.float32),
            )
            parts = encoding.ScanParts(
                [scan.laser for scan in same], [scan.pose for scan in same], fractions
            )
            self._newest.append((len(same), parts.all))
            for row, scan in enumerate(same):
                self._scans[scan.laser] = (tick, parts, row)

    def keep_only(self, lasers: Iterable[int]) -> None:
        """Forgets the scans of all other lasers, which do not exist any more."""
        kept = set(lasers)
        self._scans = {number: scan for number, scan in self._scans.items() if number in kept}

    def clear(self) -> None:
        """Forgets all scans."""
        self._scans.clear()
        self._newest = []

    def next_message(self, seen: Seen, revision: int, time: float) -> bytes | None:
        """Returns the scans that a client has not received, None without any.

        Args:
            seen: What the client has received; updated.
            revision: Revision of the world.
            time: Simulated time [s].
        """
        if seen.scans >= self._tick:
            return None
        since, seen.scans = seen.scans, self._tick
        if since == self._tick - 1:
            count = sum(number for number, _ in self._newest)
            parts = [data for _, data in self._newest]
        else:
            parts = [scans[row] for tick, scans, row in self._scans.values() if tick > since]
            count = len(parts)
        if not count:
            return None
        return encoding.scans_message(self._index, revision, time, count, parts)
