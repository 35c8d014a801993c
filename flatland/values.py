"""What plugins emit and take: plain, frozen values that know no ROS.

Stamps are simulated nanoseconds, angles [rad], lengths [m], frames ROS frame ids. The ROS layer
turns each type into a message by an adapter.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from flatland.geometry import DoubleArray, FloatArray, Pose, Vector2


def _zeros(*shape: int) -> DoubleArray:
    zeros = np.zeros(shape)
    zeros.flags.writeable = False
    return zeros


ZERO_COVARIANCE = _zeros(6, 6)
ZERO_COVARIANCE_3 = _zeros(3, 3)


@dataclass(frozen=True, slots=True)
class Twist:
    """A planar velocity command [m/s], [rad/s]; what it means is the drive's affair."""

    linear_x: float = 0.0
    linear_y: float = 0.0
    angular_z: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class LaserScan:
    """One scan of a planar laser; angles and ranges as in `sensor_msgs/LaserScan`.

    Attributes:
        stamp: Simulated time of all beams [ns].
        frame_id: Frame of the sensor.
        angle_min: Angle of the first beam [rad].
        angle_max: Angle of the last beam as configured [rad].
        angle_increment: Angle between beams [rad], negative for a clockwise scan.
        time_increment: Time between beams [s].
        scan_time: Time between scans [s].
        range_min: Least range [m].
        range_max: Greatest range [m].
        ranges: Range of each beam [m], shape (n,), float32.
        intensities: Intensity of each beam, shape (n,) or (0,), float32.
    """

    stamp: int
    frame_id: str
    angle_min: float
    angle_max: float
    angle_increment: float
    time_increment: float
    scan_time: float
    range_min: float
    range_max: float
    ranges: FloatArray
    intensities: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Odometry:
    """Where a body is and how it moves, as in `nav_msgs/Odometry`.

    Attributes:
        stamp: Simulated time [ns].
        frame_id: Frame of the pose.
        child_frame_id: Frame of the body.
        pose: (x, y, yaw) of the body's origin.
        twist: (vx, vy, omega) of the body's origin.
        pose_covariance: Shape (6, 6), order x, y, z, roll, pitch, yaw.
        twist_covariance: Shape (6, 6), the same order.
    """

    stamp: int
    frame_id: str
    child_frame_id: str
    pose: Pose
    twist: Pose
    pose_covariance: DoubleArray = field(default_factory=lambda: ZERO_COVARIANCE)
    twist_covariance: DoubleArray = field(default_factory=lambda: ZERO_COVARIANCE)


@dataclass(frozen=True, slots=True, eq=False)
class TwistWithCovariance:
    """A measured velocity, as in `geometry_msgs/TwistWithCovarianceStamped`.

    Attributes:
        stamp: Simulated time [ns].
        frame_id: Frame of the velocity.
        twist: (vx, vy, omega).
        covariance: Shape (6, 6), order x, y, z, roll, pitch, yaw.
    """

    stamp: int
    frame_id: str
    twist: Pose
    covariance: DoubleArray = field(default_factory=lambda: ZERO_COVARIANCE)


@dataclass(frozen=True, slots=True, eq=False)
class Imu:
    """An inertial measurement, as in `sensor_msgs/Imu`.

    Attributes:
        stamp: Simulated time [ns].
        frame_id: Frame of the sensor.
        yaw: Orientation about z [rad].
        yaw_rate: Angular velocity about z [rad/s].
        linear_acceleration: (x, y) in the body frame [m/s²].
        orientation_covariance: Shape (3, 3).
        angular_velocity_covariance: Shape (3, 3).
        linear_acceleration_covariance: Shape (3, 3).
    """

    stamp: int
    frame_id: str
    yaw: float
    yaw_rate: float
    linear_acceleration: Vector2
    orientation_covariance: DoubleArray = field(default_factory=lambda: ZERO_COVARIANCE_3)
    angular_velocity_covariance: DoubleArray = field(default_factory=lambda: ZERO_COVARIANCE_3)
    linear_acceleration_covariance: DoubleArray = field(default_factory=lambda: ZERO_COVARIANCE_3)


@dataclass(frozen=True, slots=True)
class NavSatFix:
    """A satellite position on WGS84, as in `sensor_msgs/NavSatFix`; [deg], [deg], [m]."""

    stamp: int
    frame_id: str
    latitude: float
    longitude: float
    altitude: float


@dataclass(frozen=True, slots=True, eq=False)
class Collision:
    """One live contact between two entities, seen from entity A.

    Attributes:
        entity_a: Name of the model that reports.
        body_a: Its body.
        entity_b: Name of the other model or layer.
        body_b: Its body.
        magnitude_forces: Force at each contact point [N], shape (k,).
        contact_positions: Contact points in the world frame [m], shape (k, 2).
        contact_normals: Unit normals from body A to body B, shape (k, 2).
    """

    entity_a: str
    body_a: str
    entity_b: str
    body_b: str
    magnitude_forces: DoubleArray
    contact_positions: DoubleArray
    contact_normals: DoubleArray


@dataclass(frozen=True, slots=True)
class Collisions:
    """All live contacts of a model at one time."""

    stamp: int
    frame_id: str
    collisions: tuple[Collision, ...] = ()


@dataclass(frozen=True, slots=True)
class Transform:
    """Pose of the frame `child` in the frame `parent`, rolled about x before it is turned.

    Attributes:
        stamp: Simulated time [ns].
        parent: Frame id of the parent.
        child: Frame id of the child.
        x: [m].
        y: [m].
        yaw: [rad].
        roll: [rad], pi for a sensor mounted upside down.
    """

    stamp: int
    parent: str
    child: str
    x: float
    y: float
    yaw: float
    roll: float = 0.0
