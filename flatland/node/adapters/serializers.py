"""Values as serialized messages: one function for each type of values."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from flatland import values
from flatland.geometry import DoubleArray
from flatland.node import values as node_values
from flatland.node.adapters.people_markers import people_markers
from flatland.node.adapters.writer import BOOL, FLOAT32, INT8, UINT32, Writer
from flatland.node.names import sendable_text
from flatland.timekeeper import NANOSECONDS

HARDWARE_ID: Final = "flatland"
_RADIATION: Final = {"ultrasound": 0, "infrared": 1}  # constants of sensor_msgs/Range
_STATUS_FIX, _SERVICE_GPS = 0, 1  # constants of sensor_msgs/NavSatStatus
_COVARIANCE_UNKNOWN: Final = 0  # constant of sensor_msgs/NavSatFix

Serialize = Callable[[Any, Writer], None]


# -- std_msgs, geometry_msgs, tf2_msgs ---------------------------------------------------------


def boolean(value: bool, to: Writer) -> None:
    """Writes a `std_msgs/Bool`."""
    to.pack("B", bool(value))


def twist(value: values.Twist, to: Writer) -> None:
    """Writes a `geometry_msgs/Twist`."""
    to.twist((value.linear_x, value.linear_y, value.angular_z))


def twist_with_covariance(value: values.TwistWithCovariance, to: Writer) -> None:
    """Writes a `geometry_msgs/TwistWithCovarianceStamped`."""
    to.header(value.stamp, value.frame_id)
    to.twist(value.twist)
    to.covariance(value.covariance, 6)


def pose_stamped(value: values.PoseStamped, to: Writer) -> None:
    """Writes a `geometry_msgs/PoseStamped`."""
    to.header(value.stamp, value.frame_id)
    to.pose(*value.pose)


def transform(value: values.Transform, to: Writer) -> None:
    """Writes a `geometry_msgs/TransformStamped`."""
    to.stamped_pose(value.stamp, value.parent, value.child, value.x, value.y, value.yaw, value.roll)


def transforms(value: node_values.Transforms, to: Writer) -> None:
    """Writes a `tf2_msgs/TFMessage` with the transforms of a step."""
    to.count(len(value))
    write = to.stamped_pose
    for each in value:  # without a call of `transform`, for /tf
        write(each.stamp, each.parent, each.child, each.x, each.y, each.yaw, each.roll)


def people(value: values.People, to: Writer) -> None:
    """Writes a `geometry_msgs/PoseArray`."""
    poses = value.poses.tolist()
    to.header(value.stamp, value.frame_id)
    to.count(len(poses))
    for x, y, yaw in poses:
        to.pose(x, y, yaw)


# -- sensor_msgs -------------------------------------------------------------------------------


def laser_scan(value: values.LaserScan, to: Writer) -> None:
    """Writes a `sensor_msgs/LaserScan`."""
    to.header(value.stamp, value.frame_id)
    to.pack(
        "f",
        value.angle_min,
        value.angle_max,
        value.angle_increment,
        value.time_increment,
        value.scan_time,
        value.range_min,
        value.range_max,
    )
    to.array(value.ranges, FLOAT32)
    to.array(value.intensities, FLOAT32)


def imu(value: values.Imu, to: Writer) -> None:
    """Writes a `sensor_msgs/Imu`."""
    to.header(value.stamp, value.frame_id)
    to.orientation(value.yaw)
    to.covariance(value.orientation_covariance, 3)
    to.pack("d", 0.0, 0.0, value.yaw_rate)
    to.covariance(value.angular_velocity_covariance, 3)
    to.pack("d", *value.linear_acceleration, 0.0)
    to.covariance(value.linear_acceleration_covariance, 3)


def range_reading(value: values.Range, to: Writer) -> None:
    """Writes a `sensor_msgs/Range`."""
    to.header(value.stamp, value.frame_id)
    to.pack("B", _RADIATION[value.radiation_type])
    to.pack("f", value.field_of_view, value.min_range, value.max_range, value.range)
    to.range_end()


def nav_sat_fix(value: values.NavSatFix, to: Writer) -> None:
    """Writes a `sensor_msgs/NavSatFix` with unknown covariance."""
    to.header(value.stamp, value.frame_id)
    to.pack("b", _STATUS_FIX)
    to.pack("H", _SERVICE_GPS)
    to.pack("d", value.latitude, value.longitude, value.altitude, *[0.0] * 9)
    to.pack("B", _COVARIANCE_UNKNOWN)


def joint_state(value: values.JointState, to: Writer) -> None:
    """Writes a `sensor_msgs/JointState` without efforts."""
    to.header(value.stamp, "")
    to.texts(value.names)
    to.array(np.array(value.positions))
    to.array(np.array(value.velocities))
    to.count(0)


# -- nav_msgs ----------------------------------------------------------------------------------


def odometry(value: values.Odometry, to: Writer) -> None:
    """Writes a `nav_msgs/Odometry`."""
    to.stamped_pose(value.stamp, value.frame_id, value.child_frame_id, *value.pose)
    to.covariance(value.pose_covariance, 6)
    to.twist(value.twist)
    to.covariance(value.twist_covariance, 6)


def map_metadata(value: node_values.MapMetadata, to: Writer) -> None:
    """Writes a `nav_msgs/MapMetaData`."""
    grid = value.grid
    height, width = grid.cells.shape
    to.time(value.stamp)
    to.pack("f", grid.resolution)
    to.pack("I", width, height)
    to.pose(*grid.origin)


def published_map(value: node_values.PublishedMap, to: Writer) -> None:
    """Writes a `nav_msgs/OccupancyGrid`."""
    to.header(value.stamp, value.frame_id)
    map_metadata(value, to)
    to.array(value.grid.cells, INT8)


# -- diagnostic_msgs ---------------------------------------------------------------------------


def diagnostics(value: node_values.Diagnostics, to: Writer) -> None:
    """Writes a `diagnostic_msgs/DiagnosticArray` with the current ROS time."""
    to.stamp(*divmod(to.now(), NANOSECONDS))
    to.text("")
    to.count(len(value))
    for status in value:
        to.pack("B", status.level)
        to.text(status.name)
        to.text(sendable_text(status.text))
        to.text(HARDWARE_ID)
        to.count(len(status.values))
        for key, text in status.values.items():
            to.text(sendable_text(key))
            to.text(sendable_text(text))


# -- messages of flatland ----------------------------------------------------------------------


def collisions(value: values.Collisions, to: Writer) -> None:
    """Writes a `Collisions`."""
    to.header(value.stamp, value.frame_id)
    to.count(len(value.collisions))
    for each in value.collisions:
        to.text(each.entity_a)
        to.text(each.body_a)
        to.text(each.entity_b)
        to.text(each.body_b)
        to.array(each.magnitude_forces)
        _points(each.contact_positions, to)
        _points(each.contact_normals, to)


def _points(points: DoubleArray, to: Writer) -> None:
    """Writes an array of points (x, y), shape (k, 2)."""
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"points must have shape (k, 2), got {points.shape}")
    to.count(len(points))
    to.numbers(points)


def semantic_scan(value: values.SemanticScan, to: Writer) -> None:
    """Writes a `SemanticScan`."""
    to.header(value.stamp, value.frame_id)
    to.pack(
        "f",
        value.angle_min,
        value.angle_max,
        value.angle_increment,
        value.range_min,
        value.range_max,
    )
    to.array(value.ranges, FLOAT32)
    to.array(np.asarray(value.labels), UINT32)
    to.count(len(value.table))
    for label in value.table:
        to.text(label.name)
        to.text(label.body)
        to.texts(label.layers)
        to.text(label.class_name)


def people_states(value: values.PeopleStates, to: Writer) -> None:
    """Writes a `PeopleStates`."""
    to.header(value.stamp, value.frame_id)
    to.texts(value.names)
    to.texts(value.groups)
    _poses_and_twists(value.poses, value.velocities, to)
    to.array(np.asarray(value.standing, bool), BOOL)


def model_states(value: node_values.StampedModelStates, to: Writer) -> None:
    """Writes a `ModelStates`."""
    to.header(value.stamp, value.frame_id)
    to.texts(_sendable(value.names))
    to.texts(_sendable(value.namespaces))
    _poses_and_twists(value.poses, value.velocities, to)


def _poses_and_twists(poses: npt.NDArray[Any], velocities: npt.NDArray[Any], to: Writer) -> None:
    """Writes lists of `Pose2D` and `Twist`, both of shape (n, 3)."""
    twists = np.zeros((len(velocities), 6))
    twists[:, [0, 1, 5]] = velocities
    for rows in (poses, twists):
        to.count(len(rows))
        to.numbers(rows)


def _sendable(names: Sequence[str]) -> list[str]:
    """Replaces surrogates, of undecodable bytes in a file name, which cannot be sent."""
    return [sendable_text(name) for name in names]


def debug_topic_names(value: node_values.DebugTopicNames, to: Writer) -> None:
    """Writes a `DebugTopicList`."""
    to.texts(value)


# -- people_msgs -------------------------------------------------------------------------------


def tracked_people(value: values.TrackedPeople, to: Writer) -> None:
    """Writes a `people_msgs/People`."""
    to.header(value.stamp, value.frame_id)
    to.count(len(value.names))
    for name, group, (x, y, _), (vx, vy, _) in zip(
        value.names, value.groups, value.poses.tolist(), value.velocities.tolist(), strict=True
    ):
        to.text(name)
        to.pack("d", x, y, 0.0, vx, vy, 0.0)
        to.pack("d", 1.0)  # reliability
        to.texts(["group"])
        to.texts([group])


SERIALIZERS: Final[dict[type[Any], Serialize]] = {
    bool: boolean,
    values.Twist: twist,
    values.TwistWithCovariance: twist_with_covariance,
    values.PoseStamped: pose_stamped,
    values.Transform: transform,
    values.People: people,
    values.LaserScan: laser_scan,
    values.Imu: imu,
    values.Range: range_reading,
    values.NavSatFix: nav_sat_fix,
    values.JointState: joint_state,
    values.Odometry: odometry,
    values.Collisions: collisions,
    values.SemanticScan: semantic_scan,
    values.PeopleStates: people_states,
    values.PeopleMarkers: people_markers,
    values.TrackedPeople: tracked_people,
    node_values.DebugTopicNames: debug_topic_names,
    node_values.Transforms: transforms,
    node_values.MapMetadata: map_metadata,
    node_values.PublishedMap: published_map,
    node_values.StampedModelStates: model_states,
    node_values.Diagnostics: diagnostics,
}
