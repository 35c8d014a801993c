"""Debug markers of a model: footprints and joints."""

from __future__ import annotations

from typing import Final

from visualization_msgs.msg import Marker

from flatland.entities.body import Body, Color
from flatland.entities.joint import Joint
from flatland.entities.model import Model
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

Shapes = list[tuple[Color, tuple[int, ...]]]
"""Colour of each body, and the ids of its fixtures; a change means that markers are outdated."""


class ModelMarkers:
    """Caches the markers of a model, so that only poses are updated for each message."""

    def __init__(self, model: Model) -> None:
        """Creates an empty cache; the first message fills it.

        Args:
            model: The model.
        """
        self._model = model
        self._shapes: Shapes | None = None
        self._markers = PackedMarkers()
        self._bodies: list[tuple[int, Body]] = []
        self._joints: list[tuple[int, Joint]] = []

    def message(self, time_ns: int) -> PackedMarkers:
        """Returns the markers of the current state; the next call modifies the result.

        Args:
            time_ns: Stamp of the markers, simulated time [ns].
        """
        # Plugins can change footprints and colours.
        shapes = self._current_shapes()
        if shapes != self._shapes:
            self._build()
            self._shapes = shapes
        markers = self._markers
        markers.set_stamp(time_ns)
        for number, body in self._bodies:
            markers.set_pose(number, body.pose)
        for number, joint in self._joints:
            body_a, body_b = joint.bodies
            points = joint_points(body_a.pose, body_b.pose, joint.anchors)
            markers.set_points(number, joint_lines(points))
            markers.set_points(number + 1, points)
        return markers

    def _current_shapes(self) -> Shapes:
        return [
            (body.color, tuple(fixture.id for fixture in body.fixtures))
            for body in self._model.bodies
        ]

    def _build(self) -> None:
        previous_count = len(self._markers)
        model, markers = self._model, PackedMarkers(self._model.name)
        self._bodies = [
            (add_footprint(markers, fixture, body.color), body)
            for body in model.bodies
            for fixture in body.fixtures
        ]
        self._joints = [(_add_joint(markers, joint), joint) for joint in model.joints]
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


def _add_joint(markers: PackedMarkers, joint: Joint) -> int:
    """Adds the two markers of a joint in the world frame; returns the number of the first."""
    body_a, body_b = joint.bodies
    points = joint_points(body_a.pose, body_b.pose, joint.anchors)
    number = markers.add(
        Marker.LINE_LIST, joint_lines(points), scale=JOINT_LINE_WIDTH, color=joint.color
    )
    markers.add(Marker.CUBE_LIST, points, scale=JOINT_CUBE, color=joint.color)
    return number
