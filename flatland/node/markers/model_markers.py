"""Debug markers of a model: footprints and joints."""

from __future__ import annotations

import struct
from typing import Final

import numpy as np

from flatland.entities.body import Color
from flatland.entities.model import Model
from flatland.geometry import Pose
from flatland.node.adapters.marker import Marker
from flatland.node.markers.marker_geometry import CIRCLE_HEIGHT, closed_strip, flat
from flatland.node.markers.packed_markers import NewWriter, PackedMarkers
from flatland.scene.description import (
    JointDescription,
    ShapeDescription,
    appearance_key,
    describe_model,
)

LINE_WIDTH: Final = (0.03, 0.0, 0.0)
JOINT_LINE_WIDTH: Final = (0.01, 0.0, 0.0)
JOINT_CUBE: Final = (0.03, 0.03, 0.03)

_LINE_POINTS: Final = struct.Struct("<18d")
_CUBE_POINTS: Final = struct.Struct("<12d")


class ModelMarkers:
    """Caches the serialized markers of a model, so that only poses are replaced in each message."""

    def __init__(self, model: Model, writer: NewWriter) -> None:
        """Creates an empty cache; the first message fills it.

        Args:
            model: The model.
            writer: Creates the writer of a message.
        """
        self._model = model
        self._writer = writer
        self._key: object = None
        self._markers = PackedMarkers(writer)
        self._footprints: list[list[int]] = []  # numbers of the markers of each body
        # Number of the first of the two markers of each joint: the lines, followed by the cubes.
        self._joints: list[tuple[int, JointDescription]] = []
        self._poses: list[Pose] = []  # of all bodies, as in the markers

    def message(self, time_ns: int) -> PackedMarkers:
        """Returns the markers of the current state; the next call modifies the result.

        Args:
            time_ns: Stamp of the markers, simulated time [ns].
        """
        # Plugins and requests can change footprints, colours and visibility.
        key = appearance_key(self._model)
        if key != self._key:
            self._build()
            self._key = key
        markers = self._markers
        markers.set_stamp(time_ns)
        poses = [body.pose for body in self._model.bodies]
        if poses != self._poses:
            self._poses = poses
            for numbers, pose in zip(self._footprints, poses, strict=True):
                markers.set_poses(numbers, pose)
            for number, joint in self._joints:
                self._move_joint(number, joint)
        return markers

    def _move_joint(self, number: int, joint: JointDescription) -> None:
        index_a, index_b = joint.bodies
        points = joint.points(self._poses[index_a], self._poses[index_b])
        origin_a, anchor_a, origin_b, anchor_b = ((x, y, 0.0) for x, y in points)
        cubes = (*origin_a, *anchor_a, *origin_b, *anchor_b)
        self._markers.set_points(number, _LINE_POINTS.pack(*cubes, *anchor_a, *anchor_b))
        self._markers.set_points(number + 1, _CUBE_POINTS.pack(*cubes))

    def _build(self) -> None:
        previous_count = len(self._markers)
        model = describe_model(self._model)
        markers = PackedMarkers(self._writer, model.name)
        self._footprints = [
            [_add_footprint(markers, shape, body.color) for shape in body.visible_shapes]
            for body in model.bodies
        ]
        self._joints = [(_add_joint(markers, joint), joint) for joint in model.joints]
        self._poses = []
        while len(markers) < previous_count:
            markers.add_deletion()
        self._markers = markers


def _add_footprint(markers: PackedMarkers, shape: ShapeDescription, color: Color) -> int:
    """Adds the marker of a footprint in the frame of its body; returns the marker's number."""
    if shape.kind == "circle":
        diameter = 2.0 * shape.radius
        center = flat(shape.points, CIRCLE_HEIGHT)
        return markers.add(Marker.SPHERE_LIST, center, scale=(diameter,) * 3, color=color)
    if shape.kind == "polygon":
        strip = closed_strip(shape.points)
        return markers.add(Marker.LINE_STRIP, strip, scale=LINE_WIDTH, color=color)
    return markers.add(Marker.LINE_LIST, flat(shape.points), scale=LINE_WIDTH, color=color)


def _add_joint(markers: PackedMarkers, joint: JointDescription) -> int:
    """Adds the lines and the cubes of a joint, without their points; returns the first number."""
    color, lines, cubes = joint.color, np.zeros((6, 3)), np.zeros((4, 3))
    number = markers.add(Marker.LINE_LIST, lines, scale=JOINT_LINE_WIDTH, color=color)
    markers.add(Marker.CUBE_LIST, cubes, scale=JOINT_CUBE, color=color)
    return number
