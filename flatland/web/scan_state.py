"""The latest scan of each laser of one world, encoded once for all clients."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from flatland.geometry import FloatArray
from flatland.web import encoding
from flatland.web.capture import NewScan
from flatland.web.client_view import Seen


class _Group:
    """New scans of one capture with the same number of beams."""

    def __init__(self, scans: list[NewScan]) -> None:
        self._ids = np.array([scan.laser for scan in scans], np.uint32)
        self._poses = np.array([scan.pose for scan in scans], np.float32)
        self._ranges: FloatArray = np.concatenate([scan.ranges for scan in scans]).reshape(
            len(scans), -1
        )

    def encoded(self, rows: list[int] | None = None) -> bytes:
        """Returns the group in a message, with all scans or some."""
        if rows is None:
            return encoding.scan_group(self._ids, self._poses, self._ranges)
        return encoding.scan_group(self._ids[rows], self._poses[rows], self._ranges[rows])


class ScanState:
    """The latest scan of each laser of one world."""

    def __init__(self, index: int) -> None:
        """Creates a state without scans.

        Args:
            index: Index of the world in messages.
        """
        self._index = index
        self._tick = 0
        # By laser: the capture, the group of its scan, and the row in this group.
        self._scans: dict[int, tuple[int, _Group, int]] = {}
        self._newest: list[bytes] = []  # groups of the last capture

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
        for same in by_count.values():
            group = _Group(same)
            self._newest.append(group.encoded())
            for row, scan in enumerate(same):
                self._scans[scan.laser] = (tick, group, row)

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
        groups = self._newest if since == self._tick - 1 else self._groups_since(since)
        if not groups:
            return None
        return encoding.scans_message(self._index, revision, time, groups)

    def _groups_since(self, since: int) -> list[bytes]:
        rows: dict[_Group, list[int]] = {}
        for tick, group, row in self._scans.values():
            if tick > since:
                rows.setdefault(group, []).append(row)
        return [group.encoded(some) for group, some in rows.items()]
