"""The latest scan of each laser of one world, encoded once for all clients."""

from __future__ import annotations

from collections.abc import Container, Mapping

import numpy as np

from flatland.geometry import FloatArray
from flatland.scene.scans import ScanDescription
from flatland.web import encoding
from flatland.web.encoding import Head
from flatland.web.views import Received


class _ScanGroup:
    """New scans of one capture with the same number of beams."""

    def __init__(self, scans: Mapping[int, ScanDescription]) -> None:
        self._ids = np.array(list(scans), np.uint32)
        self._poses = np.array([scan.pose for scan in scans.values()], np.float32)
        ranges = [scan.ranges for scan in scans.values()]
        self._ranges: FloatArray = np.concatenate(ranges).reshape(len(scans), -1)

    def encoded(self, rows: list[int] | None = None) -> bytes:
        """Returns the part of a message with all scans, or with those of some rows."""
        if rows is None:
            return encoding.scan_group(self._ids, self._poses, self._ranges)
        return encoding.scan_group(self._ids[rows], self._poses[rows], self._ranges[rows])


class LatestScans:
    """The latest scan of each laser of one world."""

    def __init__(self) -> None:
        """Creates an object without scans."""
        self._tick = 0
        # By laser: number of the capture, group of the scan, and row of the scan in the group.
        self._scans: dict[int, tuple[int, _ScanGroup, int]] = {}
        self._newest: list[bytes] = []  # groups of the last capture

    def apply(self, scans: Mapping[int, ScanDescription], tick: int) -> None:
        """Replaces scans by those of a capture.

        Args:
            scans: New scans by the id of the laser.
            tick: Number of the capture.
        """
        self._tick = tick
        by_count: dict[int, dict[int, ScanDescription]] = {}
        for laser, scan in scans.items():
            by_count.setdefault(len(scan.ranges), {})[laser] = scan
        self._newest = []
        for same in by_count.values():
            group = _ScanGroup(same)
            self._newest.append(group.encoded())
            for row, laser in enumerate(same):
                self._scans[laser] = (tick, group, row)

    def keep_only(self, lasers: Container[int]) -> None:
        """Removes the scans of lasers that do not exist any more.

        Args:
            lasers: Ids of the lasers that exist.
        """
        self._scans = {number: scan for number, scan in self._scans.items() if number in lasers}

    def clear(self) -> None:
        """Removes all scans."""
        self._scans.clear()
        self._newest = []

    def next_message(self, received: Received, head: Head) -> bytes | None:
        """Returns the scans that a client has not received, None if there are none.

        Args:
            received: What the client has received; updated.
            head: Header of the message.
        """
        if received.scans >= self._tick:
            return None
        since, received.scans = received.scans, self._tick
        groups = self._newest if since == self._tick - 1 else self._groups_since(since)
        return encoding.scans_message(head, groups) if groups else None

    def _groups_since(self, since: int) -> list[bytes]:
        rows: dict[_ScanGroup, list[int]] = {}
        for tick, group, row in self._scans.values():
            if tick > since:
                rows.setdefault(group, []).append(row)
        return [group.encoded(some) for group, some in rows.items()]
