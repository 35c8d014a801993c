"""Serialized MarkerArray messages.

The points of an ordinary marker are Python objects, and a map has hundreds of thousands of them.
Here, points are copied from an array to the serialized message. Stamps and poses, which change from
one message to the next, are overwritten in place.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from flatland.geometry import quaternion_from_yaw
from flatland.node.adapters.marker import Marker, write_marker
from flatland.node.adapters.writer import Writer
from flatland.node.names import sendable_text
from flatland.node.stamps import stamp as message_stamp
from flatland.node.values import WORLD_FRAME
from flatland.timekeeper import NANOSECONDS

_COUNT: Final = struct.Struct("<I")
_STAMP: Final = struct.Struct("<II")
_POSE: Final = struct.Struct("<7d")
_POINT_SIZE: Final = 3 * 8  # bytes

NewWriter = Callable[[], Writer]


class PackedMarkers:
    """A serialized array of numbered markers in the frame `map`, with a common namespace."""

    def __init__(self, writer: NewWriter, namespace: str = "") -> None:
        """Creates an array without markers.

        Args:
            writer: Creates the writer of a message.
            namespace: Namespace of all markers.
        """
        self._namespace = sendable_text(namespace)
        self._message = writer()
        self._start = len(self._message.data)  # of the number of markers
        self._message.count(0)
        self._data = self._message.data
        self._stamp: tuple[int, int] | None = None  # of all markers, None if one was added since
        self._stamps: list[int] = []
        self._poses: list[int] = []
        self._points: list[tuple[int, int]] = []

    @classmethod
    def deletion_of_all(cls, writer: NewWriter, time_ns: int = 0) -> PackedMarkers:
        """Returns a message that deletes all markers of a topic.

        Args:
            writer: Creates the writer of a message.
            time_ns: Stamp of the message, simulated time [ns].
        """
        markers = cls(writer)
        markers.add_deletion_of_all()
        markers.set_stamp(time_ns)
        return markers

    def __len__(self) -> int:
        """Returns the number of markers."""
        return len(self._stamps)

    def add(
        self,
        kind: int,
        points: npt.NDArray[np.float64],
        *,
        scale: tuple[float, float, float],
        color: tuple[float, float, float, float],
        frame_locked: bool = False,
    ) -> int:
        """Adds a marker with the identity pose.

        Args:
            kind: Type constant of `Marker`.
            points: (x, y, z) in the frame of the marker [m], shape (n, 3).
            scale: Scale of the marker, depending on its type [m].
            color: (r, g, b, a), each 0 to 1.
            frame_locked: Whether clients retransform the marker when its frame moves.

        Returns:
            Number of the marker.
        """
        return self._append(
            Marker(kind=kind, scale=scale, color=color, frame_locked=frame_locked, points=points)
        )

    def add_deletion(self) -> int:
        """Adds an entry that deletes the marker with the same number; returns the number."""
        return self._append(Marker(action=Marker.DELETE))

    def add_deletion_of_all(self) -> int:
        """Adds an entry that deletes all markers of the topic; returns its number."""
        return self._append(Marker(action=Marker.DELETEALL))

    def set_stamp(self, time_ns: int) -> None:
        """Sets the stamp of all markers to a simulated time [ns]."""
        stamp = divmod(message_stamp(time_ns), NANOSECONDS)
        if stamp == self._stamp:
            return
        self._stamp = stamp
        for offset in self._stamps:
            _STAMP.pack_into(self._data, offset, *stamp)

    def set_poses(self, numbers: Iterable[int], pose: tuple[float, float, float]) -> None:
        """Sets the planar pose (x, y, theta) of several markers."""
        x, y, theta = pose
        values = (x, y, 0.0, *quaternion_from_yaw(theta))
        for number in numbers:
            _POSE.pack_into(self._data, self._poses[number], *values)

    def set_points(self, number: int, points: bytes) -> None:
        """Replaces the points of a marker.

        Args:
            number: Number of the marker.
            points: The same number of points (x, y, z) in the frame of the marker [m], as float64.

        Raises:
            ValueError: The number of points differs from the number in the marker.
        """
        offset, count = self._points[number]
        if len(points) != count * _POINT_SIZE:
            raise ValueError(f"marker {number} has {count} points, got {len(points)} bytes")
        self._data[offset : offset + len(points)] = points

    @property
    def packed(self) -> bytes:
        """The serialized message."""
        return bytes(self._data)

    @property
    def packed_markers(self) -> memoryview:
        """The serialized markers without their count; a view of the message."""
        return memoryview(self._data)[self._start + _COUNT.size :]

    def _append(self, marker: Marker) -> int:
        """Appends a marker; returns its number."""
        marker.namespace, marker.number = self._namespace, len(self)
        marker.frame_id = WORLD_FRAME
        places = write_marker(marker, self._message)
        self._stamp = None
        self._stamps.append(places.stamp)
        self._poses.append(places.pose)
        self._points.append((places.points, len(marker.points)))
        _COUNT.pack_into(self._data, self._start, len(self))
        return marker.number


def join(parts: Sequence[PackedMarkers], writer: NewWriter) -> bytes:
    """Returns a serialized message with the markers of several arrays of different namespaces."""
    message = writer()
    message.count(sum(map(len, parts)))
    return b"".join((message.data, *(part.packed_markers for part in parts)))
