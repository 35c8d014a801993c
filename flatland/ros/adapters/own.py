"""Values as messages of flatland, in the selected package."""

import struct
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from flatland.geometry import DoubleArray
from flatland.node.names import sendable_text
from flatland.node.values import StampedModelStates
from flatland.ros.adapters import packing, register_built_in
from flatland.ros.message_types import message_class
from flatland.values import Collision, Collisions, PeopleStates, SemanticLabel, SemanticScan

_SCAN_GEOMETRY: Final = struct.Struct("<5f")


def collisions(value: Collisions) -> bytes:
    """Serializes a `Collisions`."""
    return b"".join(
        (
            packing.header(value.stamp, value.frame_id),
            packing.COUNT.pack(len(value.collisions)),
            *map(_collision, value.collisions),
        )
    )


def _collision(value: Collision) -> bytes:
    forces = value.magnitude_forces
    return b"".join(
        (
            packing.text(value.entity_a),
            packing.text(value.body_a),
            packing.text(value.entity_b),
            packing.text(value.body_b),
            packing.COUNT.pack(len(forces)),
            packing.doubles(forces),
            _points(value.contact_positions),
            _points(value.contact_normals),
        )
    )


def _points(points: DoubleArray) -> bytes:
    """Serializes an array of points (x, y), shape (k, 2)."""
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"points must have shape (k, 2), got {points.shape}")
    return packing.COUNT.pack(len(points)) + packing.doubles(points)


def semantic_scan(value: SemanticScan) -> bytes:
    """Serializes a `SemanticScan`."""
    labels = np.asarray(value.labels, dtype="<u4")
    return b"".join(
        (
            packing.header(value.stamp, value.frame_id),
            _SCAN_GEOMETRY.pack(
                value.angle_min,
                value.angle_max,
                value.angle_increment,
                value.range_min,
                value.range_max,
            ),
            packing.float_array(value.ranges),
            packing.COUNT.pack(labels.size),
            labels.tobytes(),
            packing.COUNT.pack(len(value.table)),
            *map(_label, value.table),
        )
    )


def _label(label: SemanticLabel) -> bytes:
    return b"".join(
        (
            packing.text(label.name),
            packing.text(label.body),
            packing.texts(label.layers),
            packing.text(label.class_name),
        )
    )


def people_states(value: PeopleStates) -> bytes:
    """Serializes a `PeopleStates`."""
    standing = np.asarray(value.standing, bool)
    return b"".join(
        (
            packing.header(value.stamp, value.frame_id),
            packing.texts(value.names),
            packing.texts(value.groups),
            _poses_and_twists(value.poses, value.velocities),
            packing.COUNT.pack(standing.size),
            standing.tobytes(),
        )
    )


def model_states(value: StampedModelStates) -> bytes:
    """Serializes a `ModelStates`."""
    return b"".join(
        (
            packing.header(value.stamp, value.frame_id),
            packing.texts(_sendable(value.names)),
            packing.texts(_sendable(value.namespaces)),
            _poses_and_twists(value.poses, value.velocities),
        )
    )


def _poses_and_twists(poses: npt.NDArray[Any], velocities: npt.NDArray[Any]) -> bytes:
    """Serializes lists of `Pose2D` and `Twist`, both of shape (n, 3)."""
    count = packing.COUNT.pack(len(poses))
    twists = np.zeros((len(velocities), 6))
    twists[:, [0, 1, 5]] = velocities
    return b"".join((count, packing.doubles(poses), count, packing.doubles(twists)))


def _sendable(names: Sequence[str]) -> list[str]:
    """Replaces surrogates, of undecodable bytes in a file name, which cannot be sent."""
    return [sendable_text(name) for name in names]


register_built_in(Collisions, message_class("Collisions"), serialize=collisions)
register_built_in(SemanticScan, message_class("SemanticScan"), serialize=semantic_scan)
register_built_in(PeopleStates, message_class("PeopleStates"), serialize=people_states)
register_built_in(StampedModelStates, message_class("ModelStates"), serialize=model_states)
