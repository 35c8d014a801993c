"""The interactive marker of one model: what one grabs, and what one sees of it."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from geometry_msgs.msg import Point, Quaternion, Vector3
from geometry_msgs.msg import Pose as PoseMessage
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import InteractiveMarker, InteractiveMarkerControl, Marker

from flatland.body import Body
from flatland.geometry import Pose, compose, invert
from flatland.model import Model
from flatland.ros.adapters import convert
from flatland.ros.markers.marker_geometry import Points, outline
from flatland.ros.markers.packed_markers import FRAME

HANDLE_SIZE: Final = (0.5, 0.5, 0.05)  # m
HANDLE_COLOR: Final = (0.0, 1.0, 0.0, 0.5)
NAME_OFFSET: Final = 0.5  # m
NAME_HEIGHT: Final = 0.4  # m
NAME_COLOR: Final = (1.0, 1.0, 1.0, 1.0)
LINE_WIDTH: Final = 0.03  # m
SMALLEST_RING: Final = 1.0  # m

# A control acts along its x axis: this turns it to z.
_ABOUT_Z: Final = Quaternion(0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5))


def model_handle(model: Model, name: str) -> InteractiveMarker:
    """Makes the interactive marker of a model, at its first body.

    Args:
        model: Which model.
        name: Of the marker.
    """
    marker = InteractiveMarker(name=name)
    # Without a stamp RViz sends poses back in this frame, whatever its own fixed frame is.
    marker.header.frame_id = FRAME
    marker.pose = pose_message(model.pose)
    drawing = _Drawing(model)
    marker.scale = max(SMALLEST_RING, 2.0 * drawing.radius)
    marker.controls = [
        _control("move_xy", InteractiveMarkerControl.MOVE_PLANE, [_handle()]),
        _control("rotate_z", InteractiveMarkerControl.ROTATE_AXIS, []),
        _control("model", InteractiveMarkerControl.NONE, [_name(name), *drawing.markers]),
    ]
    return marker


def pose_message(pose: Pose) -> PoseMessage:
    """Makes a message from a pose (x, y, theta)."""
    x, y, theta = pose
    return PoseMessage(Point(x, y, 0.0), convert.quaternion(theta))


def planar_pose(message: PoseMessage) -> Pose | None:
    """Reads a pose (x, y, theta); None when a number is not finite or there is no rotation."""
    position, q = message.position, message.orientation
    numbers = (position.x, position.y, position.z, q.x, q.y, q.z, q.w)
    if not all(map(math.isfinite, numbers)) or not any((q.x, q.y, q.z, q.w)):
        return None
    forward = q.w * q.w + q.x * q.x - q.y * q.y - q.z * q.z
    left = 2.0 * (q.w * q.z + q.x * q.y)
    return (position.x, position.y, math.atan2(left, forward))


def _control(name: str, mode: int, markers: list[Marker]) -> InteractiveMarkerControl:
    interactive = mode != InteractiveMarkerControl.NONE
    return InteractiveMarkerControl(
        name=name,
        orientation=_ABOUT_Z if interactive else Quaternion(0.0, 0.0, 0.0, 1.0),
        interaction_mode=mode,
        markers=markers,
        # What one cannot grab is seen with every tool of RViz, the handles only with "Interact".
        always_visible=not interactive,
    )


def _marker(kind: int, scale: tuple[float, float, float], color: Any) -> Marker:
    marker = Marker(type=kind, scale=Vector3(*scale), color=ColorRGBA(*color))
    marker.pose.orientation.w = 1.0
    return marker


def _handle() -> Marker:
    return _marker(Marker.CUBE, HANDLE_SIZE, HANDLE_COLOR)


def _name(text: str) -> Marker:
    marker = _marker(Marker.TEXT_VIEW_FACING, (0.0, 0.0, NAME_HEIGHT), NAME_COLOR)
    marker.pose.position.x = NAME_OFFSET
    marker.text = text
    return marker


class _Drawing:
    """The outline of a model in the frame of its first body.

    Attributes:
        markers: One for each body that has footprints.
        radius: Distance of the farthest point from the origin [m].
    """

    def __init__(self, model: Model) -> None:
        self.markers: list[Marker] = []
        self.radius = 0.0
        to_first = invert(model.pose)
        for body in model.bodies:
            outlines = [outline(fixture) for fixture in body.fixtures]
            if outlines:
                self._add(body, compose(to_first, body.pose), np.concatenate(outlines))

    def _add(self, body: Body, pose: Pose, points: Points) -> None:
        marker = _marker(Marker.LINE_LIST, (LINE_WIDTH, 0.0, 0.0), body.color)
        marker.pose = pose_message(pose)
        marker.points = [Point(*point) for point in points.tolist()]
        self.markers.append(marker)
        reach = np.hypot(points[:, 0], points[:, 1]).max()
        self.radius = max(self.radius, float(reach) + math.hypot(pose[0], pose[1]))
