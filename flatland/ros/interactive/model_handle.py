"""Interactive marker of a model: handles, name and outline."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from geometry_msgs.msg import Point, Quaternion, Vector3
from geometry_msgs.msg import Pose as PoseMessage
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import InteractiveMarker, InteractiveMarkerControl, Marker, MenuEntry

from flatland.entities.model import Model
from flatland.geometry import DoubleArray, Pose, compose, invert
from flatland.node.handles import DELETE_ENTRY
from flatland.node.markers.marker_geometry import flat
from flatland.node.values import WORLD_FRAME
from flatland.ros.adapters import convert
from flatland.scene.description import BodyDescription, describe_model

HANDLE_SIZE: Final = (0.5, 0.5, 0.05)  # m
HANDLE_COLOR: Final = (0.0, 1.0, 0.0, 0.5)
NAME_OFFSET: Final = 0.5  # m
NAME_HEIGHT: Final = 0.4  # m
NAME_COLOR: Final = (1.0, 1.0, 1.0, 1.0)
LINE_WIDTH: Final = 0.03  # m
MIN_SCALE: Final = 1.0  # m; diameter of the ring that rotates the model

# Rotates the x axis, about which a control acts, to the z axis.
_ABOUT_Z: Final = Quaternion(0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5))


def model_handle(model: Model, name: str) -> InteractiveMarker:
    """Creates the interactive marker of a model, with the pose of its first body and a menu.

    Args:
        model: The model.
        name: Name of the marker.
    """
    marker = InteractiveMarker(name=name)
    # For a marker without a stamp, RViz sends poses in this frame instead of its fixed frame.
    marker.header.frame_id = WORLD_FRAME
    marker.pose = pose_message(model.pose)
    model_outline = _ModelOutline(model)
    marker.scale = max(MIN_SCALE, 2.0 * model_outline.radius)
    marker.controls = [
        _control("move_xy", InteractiveMarkerControl.MOVE_PLANE, [_handle()]),
        _control("rotate_z", InteractiveMarkerControl.ROTATE_AXIS, []),
        _control("model", InteractiveMarkerControl.NONE, [_name(name), *model_outline.markers]),
    ]
    marker.menu_entries = [
        MenuEntry(id=DELETE_ENTRY, title="Delete Model", command_type=MenuEntry.FEEDBACK)
    ]
    return marker


def pose_message(pose: Pose) -> PoseMessage:
    """Converts a pose (x, y, theta) to a message."""
    x, y, theta = pose
    return PoseMessage(Point(x, y, 0.0), convert.quaternion(theta))


def _control(name: str, mode: int, markers: list[Marker]) -> InteractiveMarkerControl:
    interactive = mode != InteractiveMarkerControl.NONE
    return InteractiveMarkerControl(
        name=name,
        orientation=_ABOUT_Z if interactive else Quaternion(0.0, 0.0, 0.0, 1.0),
        interaction_mode=mode,
        markers=markers,
        # Handles are visible only with the tool "Interact", other markers with every tool.
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


class _ModelOutline:
    """Outline of a model in the frame of its first body.

    Attributes:
        markers: One marker for each visible body with footprints.
        radius: Upper bound of the distance of points from the origin [m].
    """

    def __init__(self, model: Model) -> None:
        self.markers: list[Marker] = []
        self.radius = 0.0
        to_first = invert(model.pose)
        for body in describe_model(model).bodies:
            if body.shapes:
                points = flat(np.concatenate([shape.segments() for shape in body.shapes]))
                self._add(body, compose(to_first, body.pose), points)

    def _add(self, body: BodyDescription, pose: Pose, points: DoubleArray) -> None:
        if body.visible:
            marker = _marker(Marker.LINE_LIST, (LINE_WIDTH, 0.0, 0.0), body.color)
            marker.pose = pose_message(pose)
            marker.points = [Point(*point) for point in points.tolist()]
            self.markers.append(marker)
        max_distance = np.hypot(points[:, 0], points[:, 1]).max()
        self.radius = max(self.radius, float(max_distance) + math.hypot(pose[0], pose[1]))
