"""Markers that show a model while it is being placed: its outline and an arrow for its heading."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from geometry_msgs.msg import Point, Pose, Quaternion
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from flatland import geometry
from flatland.viewer.outline import Outline, max_radius

_LINE_WIDTH: Final = 0.04  # m
_OUTLINE_HEIGHT: Final = 0.1  # m
_ARROW_HEIGHT: Final = 0.3  # m, above all other markers of the view from above
_ARROW_COLOR: Final = (1.0, 0.85, 0.1, 1.0)


def preview_markers(outlines: Sequence[Outline], frame: str) -> list[Any]:
    """Returns the markers of a model at the origin; `at_pose` moves them.

    Args:
        outlines: Outlines of the bodies of the model.
        frame: Name of the world frame.
    """
    markers = []
    for number, outline in enumerate(outlines):
        marker = _marker(number, Marker.LINE_LIST, (*outline.color[:3], 1.0), frame)
        marker.scale.x = _LINE_WIDTH
        marker.points = [Point(x, y, _OUTLINE_HEIGHT) for x, y in outline.segments.tolist()]
        markers.append(marker)
    length = max(1.0, 1.5 * max_radius(outlines))
    arrow = _marker(len(markers), Marker.ARROW, _ARROW_COLOR, frame)
    arrow.points = [Point(0, 0, _ARROW_HEIGHT), Point(length, 0, _ARROW_HEIGHT)]
    arrow.scale.x, arrow.scale.y, arrow.scale.z = 0.05 * length, 0.15 * length, 0.2 * length
    return [*markers, arrow]


def at_pose(markers: Sequence[Any], pose: geometry.Pose) -> Any:
    """Sets the pose of the markers in the world frame and returns them as a MarkerArray."""
    x, y, theta = pose
    for marker in markers:
        marker.pose = Pose(Point(x, y, 0.0), Quaternion(*geometry.quaternion_from_yaw(theta)))
    return MarkerArray(list(markers))


def delete_all_markers() -> Any:
    """Returns a MarkerArray that deletes all markers of the topic."""
    return MarkerArray([Marker(action=Marker.DELETEALL)])


def _marker(number: int, kind: int, color: tuple[float, ...], frame: str) -> Any:
    # The stamp 0 selects the latest transform, which also works while the simulation is paused.
    marker = Marker(ns="preview", id=number, type=kind, action=Marker.ADD)
    marker.header.frame_id = frame
    marker.color = ColorRGBA(*color)
    marker.pose.orientation.w = 1.0
    return marker
