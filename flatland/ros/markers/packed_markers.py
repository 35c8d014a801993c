"""A MarkerArray that is kept as the bytes that go over the wire.

A point of a ROS message is a Python object, and a map has hundreds of thousands of them: here
points come as an array and are never anything else. What changes from one message to the next,
time and poses, is written over in place.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from io import BytesIO
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from flatland.ros.names import sendable_text
from flatland.timekeeper import NANOSECONDS

FRAME: Final = "map"

_COUNT: Final = struct.Struct("<I")
_STAMP: Final = struct.Struct("<II")
_POSE: Final = struct.Struct("<7d")
_SEQUENCE_SIZE: Final = 4  # bytes of a header before its stamp
_BEFORE_POSE: Final = 3 * 4  # bytes of id, type and action
# Bytes of pose, scale, colour, lifetime and frame_locked, which come before the points.
_POSE_TO_POINTS: Final = 7 * 8 + 3 * 8 + 4 * 4 + 2 * 4 + 1


class PackedMarkers(MarkerArray):  # type: ignore[misc]
    """Markers in the frame `map`, numbered from 0, in one namespace."""

    def __init__(self, namespace: str = "") -> None:
        """Holds no marker yet.

        Args:
            namespace: Of all markers.
        """
        # Not super().__init__: it would make the list that the bytes stand for.
        self._namespace = sendable_text(namespace)
        self._data = bytearray(_COUNT.size)
        self._stamps: list[int] = []
        self._poses: list[int] = []
        self._points: list[tuple[int, int]] = []

    def __len__(self) -> int:
        """Returns how many markers there are."""
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
        """Adds a marker at the origin.

        Args:
            kind: One of the types of `Marker`.
            points: (x, y, z) in the marker's frame [m], shape (n, 3).
            scale: As the kind of marker wants it [m].
            color: (r, g, b, a), each 0 to 1.
            frame_locked: Whether the marker goes with its frame when that moves.

        Returns:
            The marker's number.
        """
        marker = self._new(Marker.ADD, kind)
        marker.scale.x, marker.scale.y, marker.scale.z = scale
        marker.color = ColorRGBA(*color)
        marker.frame_locked = frame_locked
        return self._append(marker, _packed(points), len(points))

    def add_deletion(self) -> int:
        """Adds an entry that removes the marker of its number; returns the number."""
        return self._append(self._new(Marker.DELETE), b"", 0)

    def add_deletion_of_all(self) -> int:
        """Adds an entry that removes all markers of the topic."""
        return self._append(self._new(Marker.DELETEALL), b"", 0)

    def set_stamp(self, time_ns: int) -> None:
        """Sets the time of all markers [ns]."""
        stamp = divmod(time_ns, NANOSECONDS)
        for offset in self._stamps:
            _STAMP.pack_into(self._data, offset, *stamp)

    def set_pose(self, number: int, pose: tuple[float, float, float]) -> None:
        """Puts a marker at a pose (x, y, theta)."""
        x, y, theta = pose
        quaternion = (0.0, 0.0, math.sin(theta / 2.0), math.cos(theta / 2.0))
        _POSE.pack_into(self._data, self._poses[number], x, y, 0.0, *quaternion)

    def set_points(self, number: int, points: npt.NDArray[np.float64]) -> None:
        """Replaces the points of a marker by as many others.

        Raises:
            ValueError: There are more or fewer than before.
        """
        offset, count = self._points[number]
        if len(points) != count:
            raise ValueError(f"marker {number} has {count} points, got {len(points)}")
        data = _packed(points)
        self._data[offset : offset + len(data)] = data

    def serialize(self, buff: Any) -> None:
        """Writes the message to a buffer; rospy calls it."""
        buff.write(self._data)

    def write_markers(self, buff: Any) -> None:
        """Writes the markers to a buffer, without their number."""
        buff.write(memoryview(self._data)[_COUNT.size :])

    @property
    def markers(self) -> list[Marker]:
        """The markers as ROS has them, made anew at each use."""
        return MarkerArray().deserialize(bytes(self._data)).markers  # type: ignore[no-any-return]

    def _new(self, action: int, kind: int = Marker.ARROW) -> Marker:
        marker = Marker(ns=self._namespace, id=len(self), type=kind, action=action)
        marker.header.frame_id = FRAME
        marker.pose.orientation.w = 1.0
        return marker

    def _append(self, marker: Marker, points: bytes, count: int) -> int:
        """Adds a marker that has no points yet, and its points."""
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
        self._stamps.append(start + stamp)
        self._poses.append(start + pose)
        self._points.append((start + points_start, count))
        _COUNT.pack_into(self._data, 0, len(self))
        return number


class JoinedMarkers(MarkerArray):  # type: ignore[misc]
    """The markers of several PackedMarkers in one message; their namespaces must differ."""

    def __init__(self, parts: Sequence[PackedMarkers]) -> None:
        """Copies nothing yet: the parts must not change before the message is sent."""
        self._parts = parts

    def serialize(self, buff: Any) -> None:
        """Writes the message to a buffer; rospy calls it."""
        buff.write(_COUNT.pack(sum(map(len, self._parts))))
        for part in self._parts:
            part.write_markers(buff)

    @property
    def markers(self) -> list[Marker]:
        """The markers as ROS has them, made anew at each use."""
        return [marker for part in self._parts for marker in part.markers]


def _packed(points: npt.NDArray[np.float64]) -> bytes:
    """Writes points, shape (n, 3), as a ROS message has them, without their number."""
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"points must have shape (n, 3), got {points.shape}")
    return points.astype("<f8", copy=False).tobytes()
