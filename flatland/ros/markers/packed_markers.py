"""Serialized MarkerArray messages.

The points of an ordinary marker are Python objects, and a map has hundreds of thousands of them.
Here, points are copied from an array to the serialized message. Stamps and poses, which change from
one message to the next, are overwritten in place.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from io import BytesIO
from typing import Final

import numpy as np
import numpy.typing as npt
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from flatland.geometry import quaternion_from_yaw
from flatland.node.names import sendable_text
from flatland.ros.adapters import convert
from flatland.timekeeper import NANOSECONDS

FRAME: Final = "map"

_COUNT: Final = struct.Struct("<I")
_STAMP: Final = struct.Struct("<II")
_POSE: Final = struct.Struct("<7d")
_POINT_SIZE: Final = 3 * 8  # bytes
_SEQUENCE_SIZE: Final = 4  # bytes of a header before the stamp
_BEFORE_POSE: Final = 3 * 4  # bytes of id, type, action
# Bytes from the pose to the points: pose, scale, color, lifetime, frame_locked.
_POSE_TO_POINTS: Final = 7 * 8 + 3 * 8 + 4 * 4 + 2 * 4 + 1


class PackedMarkers:
    """A serialized array of numbered markers in the frame `map`, with a common namespace."""

    def __init__(self, namespace: str = "") -> None:
        """Creates an array without markers.

        Args:
            namespace: Namespace of all markers.
        """
        self._namespace = sendable_text(namespace)
        self._data = bytearray(_COUNT.size)
        self._stamp: tuple[int, int] | None = None  # of all markers, None if one was added since
        self._stamps: list[int] = []
        self._poses: list[int] = []
        self._points: list[tuple[int, int]] = []

    @classmethod
    def deletion_of_all(cls, time_ns: int = 0) -> PackedMarkers:
        """Returns a message that deletes all markers of a topic.

        Args:
            time_ns: Stamp of the message, simulated time [ns].
        """
        markers = cls()
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
        marker = self._new(Marker.ADD, kind)
        marker.scale.x, marker.scale.y, marker.scale.z = scale
        marker.color = ColorRGBA(*color)
        marker.frame_locked = frame_locked
        return self._append(marker, _packed(points), len(points))

    def add_deletion(self) -> int:
        """Adds an entry that deletes the marker with the same number; returns the number."""
        return self._append(self._new(Marker.DELETE), b"", 0)

    def add_deletion_of_all(self) -> int:
        """Adds an entry that deletes all markers of the topic; returns its number."""
        return self._append(self._new(Marker.DELETEALL), b"", 0)

    def set_stamp(self, time_ns: int) -> None:
        """Sets the stamp of all markers to a simulated time [ns]."""
        stamp = divmod(convert.stamp(time_ns), NANOSECONDS)
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
        return memoryview(self._data)[_COUNT.size :]

    def _new(self, action: int, kind: int = Marker.ARROW) -> Marker:
        marker = Marker(ns=self._namespace, id=len(self), type=kind, action=action)
        marker.header.frame_id = FRAME
        marker.pose.orientation.w = 1.0
        return marker

    def _append(self, marker: Marker, points: bytes, count: int) -> int:
        """Appends a serialized marker and inserts its serialized points; returns its number."""
        buffer = BytesIO()
        marker.serialize(buffer)
        data = buffer.getvalue()
        start = len(self._data)
        number = len(self)
        stamp = _SEQUENCE_SIZE
        texts = (marker.header.frame_id, marker.ns)
        pose = stamp + _STAMP.size + _BEFORE_POSE
        pose += sum(_COUNT.size + len(text.encode()) for text in texts)
        points_count = pose + _POSE_TO_POINTS
        points_start = points_count + _COUNT.size
        self._data += data[:points_count] + _COUNT.pack(count)
        self._data += points
        self._data += data[points_start:]
        self._stamp = None
        self._stamps.append(start + stamp)
        self._poses.append(start + pose)
        self._points.append((start + points_start, count))
        _COUNT.pack_into(self._data, 0, len(self))
        return number


def join(parts: Sequence[PackedMarkers]) -> bytes:
    """Returns a serialized message with the markers of several arrays of different namespaces."""
    count = _COUNT.pack(sum(map(len, parts)))
    return b"".join((count, *(part.packed_markers for part in parts)))


def _packed(points: npt.NDArray[np.float64]) -> bytes:
    """Serializes points, shape (n, 3), without their count."""
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"points must have shape (n, 3), got {points.shape}")
    return points.astype("<f8", copy=False).tobytes()
