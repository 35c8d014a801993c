"""Messages as values: one function for each type of values.

The functions read fields that ROS 1 and ROS 2 have in common.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from flatland import geometry, values
from flatland.errors import MapFileError
from flatland.geometry import yaw_from_quaternion
from flatland.node import values as node_values

Receive = Callable[[Any], Any]


def boolean(message: Any) -> bool:
    """Converts a `std_msgs/Bool`."""
    return bool(message.data)


def twist(message: Any) -> values.Twist:
    """Converts a `geometry_msgs/Twist`, discarding the components outside the plane."""
    return values.Twist(message.linear.x, message.linear.y, message.angular.z)


def pose(message: Any) -> node_values.ReceivedPose:
    """Converts a `geometry_msgs/PoseWithCovarianceStamped`, discarding the covariance."""
    frame_id = message.header.frame_id.lstrip("/")
    return node_values.ReceivedPose(frame_id, planar_pose(message.pose.pose))


def planar_pose(message: Any) -> geometry.Pose | None:
    """Converts a `geometry_msgs/Pose` to (x, y, theta).

    Returns:
        The pose, None for non-finite numbers or a zero quaternion.
    """
    position, q = message.position, message.orientation
    numbers = (position.x, position.y, position.z, q.x, q.y, q.z, q.w)
    if not all(map(math.isfinite, numbers)) or not any((q.x, q.y, q.z, q.w)):
        return None
    return (position.x, position.y, yaw_from_quaternion(q.x, q.y, q.z, q.w))


def frame_parents(message: Any) -> node_values.FrameParents:
    """Returns the parent of each frame of a `tf2_msgs/TFMessage`."""
    # TF of other versions of ROS accepts frames with a leading slash.
    return node_values.FrameParents(
        (each.child_frame_id.lstrip("/"), each.header.frame_id.lstrip("/"))
        for each in message.transforms
    )


def grid(message: Any) -> values.OccupancyGrid:
    """Converts a `nav_msgs/OccupancyGrid`, whose frame is taken as the world frame.

    Raises:
        MapFileError: The number of cells differs from the metadata.
    """
    info = message.info
    cells = np.asarray(message.data, np.int8)
    if len(cells) != info.width * info.height:
        raise MapFileError(
            f"a grid of {info.width} x {info.height} cells must have that number of values, "
            f"got {len(cells)}"
        )
    position, rotation = info.origin.position, info.origin.orientation
    quaternion = (rotation.x, rotation.y, rotation.z, rotation.w)
    # Many publishers do not set the rotation at all.
    yaw = yaw_from_quaternion(*quaternion) if any(quaternion) else 0.0
    return values.OccupancyGrid(
        (position.x, position.y, yaw),
        # The message has single precision: 0.05 would be 0.05000000074505806 otherwise.
        _shortest(info.resolution),
        cells.reshape(info.height, info.width),
    )


def _shortest(resolution: float) -> float:
    """Returns the shortest decimal number that is equal in single precision."""
    return float(str(np.float32(resolution))) if math.isfinite(resolution) else resolution


def ackermann(message: Any) -> values.AckermannCommand:
    """Converts an `ackermann_msgs/AckermannDriveStamped`, without stamp and limit of the jerk."""
    drive = message.drive
    return values.AckermannCommand(
        drive.steering_angle, drive.steering_angle_velocity, drive.speed, drive.acceleration
    )


RECEIVERS: Final[dict[type[Any], Receive]] = {
    bool: boolean,
    values.Twist: twist,
    values.AckermannCommand: ackermann,
    values.OccupancyGrid: grid,
    node_values.ReceivedPose: pose,
    node_values.FrameParents: frame_parents,
}
