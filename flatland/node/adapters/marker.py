"""Markers as serialized `visualization_msgs/Marker`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from flatland.geometry import DoubleArray
from flatland.node.adapters.writer import Writer
from flatland.node.stamps import stamp as message_stamp
from flatland.timekeeper import NANOSECONDS

Triple = tuple[float, float, float]


@dataclass(slots=True, eq=False)
class Marker:
    """The fields of a marker that are used.

    Attributes:
        namespace: Namespace of the marker.
        number: Its id.
        kind: Its type.
        stamp: Simulated time [ns]; None for the stamp 0.
        frame_id: Its frame.
        action: What clients do with it.
        position: Its position in its frame [m].
        rotation: Its rotation, a quaternion (x, y, z, w).
        scale: Its scale, depending on its type [m].
        color: (r, g, b, a), each 0 to 1.
        frame_locked: Whether clients transform it again when its frame moves.
        points: Its points (x, y, z) [m], shape (n, 3).
        text: Its text.
    """

    ADD: ClassVar[int] = 0
    DELETE: ClassVar[int] = 2
    DELETEALL: ClassVar[int] = 3

    ARROW: ClassVar[int] = 0
    CUBE: ClassVar[int] = 1
    SPHERE: ClassVar[int] = 2
    CYLINDER: ClassVar[int] = 3
    LINE_STRIP: ClassVar[int] = 4
    LINE_LIST: ClassVar[int] = 5
    CUBE_LIST: ClassVar[int] = 6
    SPHERE_LIST: ClassVar[int] = 7
    POINTS: ClassVar[int] = 8
    TEXT_VIEW_FACING: ClassVar[int] = 9
    MESH_RESOURCE: ClassVar[int] = 10
    TRIANGLE_LIST: ClassVar[int] = 11

    namespace: str = ""
    number: int = 0
    kind: int = 0
    stamp: int | None = None
    frame_id: str = ""
    action: int = 0
    position: Triple = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    scale: Triple = (0.0, 0.0, 0.0)
    color: Sequence[float] = (0.0, 0.0, 0.0, 0.0)
    frame_locked: bool = False
    points: DoubleArray = field(default_factory=lambda: np.empty((0, 3)))
    text: str = ""


@dataclass(frozen=True, slots=True)
class MarkerPlaces:
    """Where the parts of a serialized marker begin that change from message to message [bytes]."""

    stamp: int
    pose: int
    points: int


def write_marker(marker: Marker, to: Writer) -> MarkerPlaces:
    """Writes a marker.

    Returns:
        Where its stamp, its pose and its points begin in `Writer.data`.

    Raises:
        ValueError: The points have another shape.
    """
    points = marker.points
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"points must have shape (n, 3), got {points.shape}")
    stamp = to.stamp(
        *divmod(0 if marker.stamp is None else message_stamp(marker.stamp), NANOSECONDS)
    )
    to.text(marker.frame_id)
    to.text(marker.namespace)
    to.pack("i", marker.number, marker.kind, marker.action)
    to.align(8)
    pose = len(to.data)
    to.pack("d", *marker.position, *marker.rotation, *marker.scale)
    to.pack("f", *marker.color)
    to.pack("i", 0, 0)  # lifetime
    to.pack("B", marker.frame_locked)
    to.count(len(points))
    if len(points):
        to.align(8)
    start = len(to.data)
    to.numbers(points)
    to.count(0)  # colours of points
    to.marker_end(marker.text)
    return MarkerPlaces(stamp, pose, start)


def write_markers(markers: Sequence[Marker], to: Writer) -> None:
    """Writes a `visualization_msgs/MarkerArray`."""
    to.count(len(markers))
    for marker in markers:
        write_marker(marker, to)
