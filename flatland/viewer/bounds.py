"""Bounding boxes of the markers of layers and models, used to fit the view to the world."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np

from flatland.geometry import transform_points, yaw_from_quaternion


@dataclass(frozen=True, slots=True)
class Bounds:
    """An axis-aligned rectangle in the world frame [m]."""

    x_min: float
    y_min: float
    x_max: float
    y_max: float

    @property
    def center(self) -> tuple[float, float]:
        """The center (x, y) [m]."""
        return ((self.x_min + self.x_max) / 2, (self.y_min + self.y_max) / 2)

    @property
    def size(self) -> tuple[float, float]:
        """The extent along x and y [m]."""
        return (self.x_max - self.x_min, self.y_max - self.y_min)

    def expanded(self, margin: float) -> Bounds:
        """Returns the rectangle expanded by a margin [m] on each side."""
        return Bounds(
            self.x_min - margin, self.y_min - margin, self.x_max + margin, self.y_max + margin
        )


def bounds_of(markers: Any) -> Bounds | None:
    """Returns the bounding box of all points of a MarkerArray, None if it has no points."""
    parts = []
    for marker in markers.markers:
        if not marker.points:
            continue
        position, orientation = marker.pose.position, marker.pose.orientation
        yaw = yaw_from_quaternion(orientation.x, orientation.y, orientation.z, orientation.w)
        p_marker = np.array([(point.x, point.y) for point in marker.points])
        p_world = transform_points((position.x, position.y, yaw), p_marker)
        part = Bounds(*p_world.min(axis=0).tolist(), *p_world.max(axis=0).tolist())
        # A circle is published as a sphere: one point at its center, with the diameter as scale.
        radius = marker.scale.x / 2 if marker.type == marker.SPHERE_LIST else 0.0
        parts.append(part.expanded(radius))
    return union(parts) if parts else None


def union(parts: Collection[Bounds]) -> Bounds:
    """Returns the smallest rectangle that contains all given rectangles.

    Raises:
        ValueError: There are no rectangles.
    """
    return Bounds(
        min(part.x_min for part in parts),
        min(part.y_min for part in parts),
        max(part.x_max for part in parts),
        max(part.y_max for part in parts),
    )
