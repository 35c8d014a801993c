"""Debug markers of a model: footprints and joints."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from visualization_msgs.msg import Marker

from flatland.entities.body import Body, Color
from flatland.entities.joint import Joint
from flatland.entities.model import Model
from flatland.geometry import Pose, Vector2, compose
from flatland.ros.markers.marker_geometry import (
    CIRCLE_HEIGHT,
    Footprint,
    closed_strip,
    flat,
    joint_lines,
    joint_points,
)
from flatland.ros.markers.packed_markers import PackedMarkers

LINE_WIDTH: Final = (0.03, 0.0, 0.0)
JOINT_LINE_WIDTH: Final = (0.01, 0.0, 0.0)
JOINT_CUBE: Final = (0.03, 0.03, 0.03)

_LINE_POINTS: Final = struct.Struct("<18d")
_CUBE_POINTS: Final = struct.Struct("<12d")

Shapes = list[tuple[Color, bool, list[int]]]
"""Colour and visibility of each body, and the ids of its fixtures.

A change means that markers are outdated.
"""


@dataclass(frozen=True, slots=True)
class _JointMarkers:
    """The two markers of a joint.

    Attributes:
        number: Number of the first marker, the lines; the second one is the cubes.
        bodies: Indices of body A and body B in the model.
        anchors: Anchor of each body in the body frame [m].
    """

    number: int
    bodies: tuple[int, int]
    anchors: tuple[Vector2, Vector2]


class ModelMarkers:
    """Caches the serialized markers of a model, so that only poses are replaced in each message."""

    def __init__(self, model: Model) -> None:
        """Creates an empty cache; the first message fills it.

        Args:
            model: The model.
        """
        self._model = model
        self._shapes: Shapes | None = None
        self._markers = PackedMarkers()
        self._footprints: list[list[int]] = []  # numbers of the markers of each body
        self._joints: list[_JointMarkers] = []
        self._poses: list[Pose] = []  # of all bodies, as in the markers

    def message(self, time_ns: int) -> PackedMarkers:
        """Returns the markers of the current state; the next call modifies the result.

        Args:
            time_ns: Stamp of the markers, simulated time [ns].
        """
        bodies = self._model.bodies
        # Plugins and requests can change footprints, colours and visibility.
        shapes = [(body.color, body.visible, body.fixture_ids) for body in bodies]
        if shapes != self._shapes:
            self._build()
            self._shapes = shapes
        markers = self._markers
        markers.set_stamp(time_ns)
        poses = [body.pose for body in bodies]
        if poses != self._poses:
            self._poses = poses
            for numbers, pose in zip(self._footprints, poses, strict=True):
                markers.set_poses(numbers, pose)
            for joint in self._joints:
                self._move_joint(joint)
        return markers

    def _move_joint(self, joint: _JointMarkers) -> None:
        (pose_a, pose_b), (anchor_a, anchor_b) = (
            [self._poses[index] for index in joint.bodies],
            joint.anchors,
        )
        a, b = (pose_a[0], pose_a[1], 0.0), (pose_b[0], pose_b[1], 0.0)
        end_a = (*compose(pose_a, (*anchor_a, 0.0))[:2], 0.0)
        end_b = (*compose(pose_b, (*anchor_b, 0.0))[:2], 0.0)
        # The points of `joint_lines` and `joint_points`, without arrays.
        lines = _LINE_POINTS.pack(*a, *end_a, *b, *end_b, *end_a, *end_b)
        self._markers.set_points(joint.number, lines)
        cubes = _CUBE_POINTS.pack(*a, *end_a, *b, *end_b)
        self._markers.set_points(joint.number + 1, cubes)

    def _build(self) -> None:
        previous_count = len(self._markers)
        model, markers = self._model, PackedMarkers(self._model.name)
        self._footprints = [
            [add_footprint(markers, fixture, body.color) for fixture in body.fixtures]
            if body.visible
            else []
            for body in model.bodies
        ]
        self._joints = [
            _add_joint(markers, joint, model.bodies)
            for joint in model.joints
            if all(body.visible for body in joint.bodies)
        ]
        self._poses = []
        while len(markers) < previous_count:
            markers.add_deletion()
        self._markers = markers


def add_footprint(markers: PackedMarkers, footprint: Footprint, color: Color) -> int:
    """Adds the marker of a footprint in the frame of its body; returns its number."""
    if footprint.shape == "circle":
        diameter = 2.0 * footprint.radius
        center = flat(footprint.center, CIRCLE_HEIGHT)
        return markers.add(Marker.SPHERE_LIST, center, scale=(diameter,) * 3, color=color)
    if footprint.shape == "polygon":
        strip = closed_strip(footprint.vertices)
        return markers.add(Marker.LINE_STRIP, strip, scale=LINE_WIDTH, color=color)
    ends = flat(footprint.vertices)
    return markers.add(Marker.LINE_LIST, ends, scale=LINE_WIDTH, color=color)


def _add_joint(markers: PackedMarkers, joint: Joint, bodies: Sequence[Body]) -> _JointMarkers:
    """Adds the two markers of a joint in the world frame."""
    body_a, body_b = joint.bodies
    anchors = joint.anchors
    points = joint_points(body_a.pose, body_b.pose, anchors)
    number = markers.add(
        Marker.LINE_LIST, joint_lines(points), scale=JOINT_LINE_WIDTH, color=joint.color
    )
    markers.add(Marker.CUBE_LIST, points, scale=JOINT_CUBE, color=joint.color)
    (ax, ay), (bx, by) = anchors.tolist()
    return _JointMarkers(number, (bodies.index(body_a), bodies.index(body_b)), ((ax, ay), (bx, by)))
