"""The latest scan of each laser of one world, encoded once for all clients."""

from __future__ import annotations

from collections.abc import Container, Mapping

import numpy as np

from flatland.geometry import FloatArray
from flatland.scene.scans import ScanDescription
from flatland.web import encoding
from flatland.web.encoding import Head
from flatland.web.scan_codes import has_codes
from flatland.web.views import Received


class _ScanGroup:
    """New scans of one capture with the same number of beams, which all have codes, or none."""

    def __init__(self, scans: Mapping[int, ScanDescription]) -> None:
        self._ids = np.array(list(scans), np.uint32)
        self._poses = np.array([scan.pose for scan in scans.values()], np.float32)
        ranges = [scan.ranges for scan in scans.values()]
        self._ranges: FloatArray = np.concatenate(ranges).reshape(len(scans), -1)
        self._range_max = np.array([scan.range_max for scan in scans.values()])

    def encoded(self, compact: bool, rows: list[int] | None = None) -> bytes:
        """Returns the part of a message with all scans, or with those of some rows."""
        some = slice(None) if rows is None else rows
        ids, poses, ranges = self._ids[some], self._poses[some], self._ranges[some]
        if compact:
            return encoding.compact_scan_group(ids, poses, ranges, self._range_max[some])
        return encoding.scan_group(ids, poses, ranges)


class LatestScans:
    """The latest scan of each laser of one world."""

    def __init__(self) -> None:
        """Creates an object without scans."""
        self._tick = 0
        # By laser: number of the capture, group of the scan, and row of the scan in the group.
        self._scans: dict[int, tuple[int, _ScanGroup, int]] = {}
        self._newest: list[_ScanGroup] = []  # of the last capture
        # The encoded groups of the last capture, compact and not; shared by most clients.
        self._shared: dict[bool, list[bytes]] = {}

    def apply(self, scans: Mapping[int, ScanDescription], tick: int) -> None:
        """Replaces scans by those of a capture.

        Args:
            scans: New scans by the id of the laser.
            tick: Number of the capture.
        """
        self._tick = tick
        alike: dict[tuple[int, bool], dict[int, ScanDescription]] = {}
        for laser, scan in scans.items():
            kind = (len(scan.ranges), has_codes(scan.range_max))
            alike.setdefault(kind, {})[laser] = scan
        self._newest = []
        self._shared.clear()
        for same in alike.values():
            group = _ScanGroup(same)
            self._newest.append(group)
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
        self._shared.clear()

    def next_message(
        self, received: Received, head: Head, *, compact: bool = False
    ) -> bytes | None:
        """Returns the scans that a client has not received, None if there are none.

        Args:
            received: What the client has received; updated.
            head: Header of the message.
            compact: Whether the client accepts codes instead of ranges, see `scan_codes`.
        """
        if received.scans >= self._tick:
            return None
        since, received.scans = received.scans, self._tick
        if since < self._tick - 1:
            groups = self._groups_since(since, compact)
        else:
            if compact not in self._shared:
                self._shared[compact] = [group.encoded(compact) for group in self._newest]
            groups = self._shared[compact]
        return encoding.scans_message(head, groups, compact=compact) if groups else None

    def _groups_since(self, since: int, compact: bool) -> list[bytes]:
        rows: dict[_ScanGroup, list[int]] = {}
        for tick, group, row in self._scans.values():
            if tick > since:
                rows.setdefault(group, []).append(row)
        return [group.encoded(compact, some) for group, some in rows.items()]
