"""Immutable values that plugins publish and receive, independent of ROS.

Stamps are simulated times [ns], angles are in [rad], lengths in [m], and frames are ROS frame ids.
The ROS layer converts each type to a message with an adapter.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from flatland.geometry import BoolArray, DoubleArray, FloatArray, Pose, Vector2
from flatland.timekeeper import NANOSECONDS


def _zeros(*shape: int) -> DoubleArray:
    zeros = np.zeros(shape)
    zeros.flags.writeable = False
    return zeros


ZERO_COVARIANCE = _zeros(6, 6)
ZERO_COVARIANCE_3 = _zeros(3, 3)


@dataclass(frozen=True, slots=True)
class Twist:
    """A planar velocity command [m/s, m/s, rad/s], interpreted by the drive plugin."""

    linear_x: float = 0.0
    linear_y: float = 0.0
    angular_z: float = 0.0


@dataclass(frozen=True, slots=True)
class AckermannCommand:
    """A command to a car, as in `ackermann_msgs/AckermannDriveStamped`.

    Attributes:
        steering_angle: Angle of a wheel in the middle of the front axle, to the left [rad].
        steering_angle_velocity: Limit of the rate of change of the angle [rad/s], 0 for none.
        speed: Speed of the centre of the rear axle [m/s].
        acceleration: Limit of the rate of change of the speed [m/s²], 0 for none.
    """

    steering_angle: float = 0.0
    steering_angle_velocity: float = 0.0
    speed: float = 0.0
    acceleration: float = 0.0


@dataclass(frozen=True, slots=True)
class JointState:
    """Angles and speeds of wheels, as in `sensor_msgs/JointState`.

    Attributes:
        stamp: Simulated time [ns].
        names: Names of the wheels.
        positions: Angles [rad].
        velocities: Speeds [rad/s].
    """

    stamp: int
    names: tuple[str, ...]
    positions: tuple[float, ...]
    velocities: tuple[float, ...]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
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
        range_min: Minimum range [m].
        range_max: Maximum range [m].
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

    def __repr__(self) -> str:
        """Returns the number of beams, the shortest range, the stamp and the frame."""
        hits = self.ranges[np.isfinite(self.ranges)]
        shortest = f"min {hits.min():.3f} m" if len(hits) else "no hits"
        return (
            f"LaserScan({len(self.ranges)} beams, {shortest}, "
            f"stamp {self.stamp / NANOSECONDS:.3f} s, frame {self.frame_id!r})"
        )


GridCells = npt.NDArray[np.int8]


@dataclass(frozen=True, eq=False)
class OccupancyGrid:
    """A grid of occupancy values, as in `nav_msgs/OccupancyGrid`.

    Attributes:
        origin: Pose of the lower left corner of the grid in the world frame [m, m, rad].
        resolution: Size of a cell [m].
        cells: Occupancy from 0 (free) to 100 (occupied), -1 if unknown; shape (rows, columns),
            the row at the bottom of the map first.
    """

    origin: Pose
    resolution: float
    cells: GridCells


@dataclass(frozen=True, slots=True)
class Range:
    """A reading of a range sensor with a cone, as in `sensor_msgs/Range`.

    Attributes:
        stamp: Simulated time [ns].
        frame_id: Frame of the sensor; the cone is symmetric about its x axis.
        radiation_type: `ultrasound` or `infrared`.
        field_of_view: Angle of the cone [rad].
        min_range: Minimum range [m].
        max_range: Maximum range [m].
        range: Distance of the nearest object [m]; by default, -inf below the minimum range and inf
            without an object (REP 117).
    """

    stamp: int
    frame_id: str
    radiation_type: str
    field_of_view: float
    min_range: float
    max_range: float
    range: float


@dataclass(frozen=True, slots=True)
class SemanticLabel:
    """What beams of a `SemanticScan` hit.

    Attributes:
        name: Name of the model, or first name of the layer.
        body: Name of the body.
        layers: Names of the layers of the footprint, or of the layer; `all` for all layers.
        class_name: Class of objects.
    """

    name: str
    body: str
    layers: tuple[str, ...]
    class_name: str


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SemanticScan:
    """One scan of a planar laser with what each beam hit.

    Attributes:
        stamp: Simulated time of all beams [ns].
        frame_id: Frame of the sensor.
        angle_min: Angle of the first beam [rad].
        angle_max: Angle of the last beam as configured [rad].
        angle_increment: Angle between beams [rad], negative for a clockwise scan.
        range_min: Minimum range [m].
        range_max: Maximum range [m].
        ranges: Range of each beam [m], shape (n,), float32.
        labels: For each beam, the index of its label in the table, shape (n,), uint32; 0 if the
            reading is not that of a hit.
        table: The labels of this scan. The first one is that of no hit, with empty names.
    """

    stamp: int
    frame_id: str
    angle_min: float
    angle_max: float
    angle_increment: float
    range_min: float
    range_max: float
    ranges: FloatArray
    labels: npt.NDArray[np.uint32]
    table: tuple[SemanticLabel, ...]

    def __repr__(self) -> str:
        """Returns the number of beams, the classes, the stamp and the frame."""
        classes = sorted({label.class_name for label in self.table[1:]})
        return (
            f"SemanticScan({len(self.ranges)} beams, classes: {', '.join(classes) or 'none'}, "
            f"stamp {self.stamp / NANOSECONDS:.3f} s, frame {self.frame_id!r})"
        )


@dataclass(frozen=True, slots=True, eq=False)
class Odometry:
    """Pose and velocity of a body, as in `nav_msgs/Odometry`.

    Attributes:
        stamp: Simulated time [ns].
        frame_id: Frame of the pose.
        child_frame_id: Frame of the body.
        pose: Pose (x, y, yaw) of the origin of the body [m, m, rad].
        twist: Velocity (vx, vy, omega) of the origin of the body [m/s, m/s, rad/s].
        pose_covariance: Covariance of x, y, z, roll, pitch, yaw; shape (6, 6).
        twist_covariance: Covariance of the velocities in the same order; shape (6, 6).
    """

    stamp: int
    frame_id: str
    child_frame_id: str
    pose: Pose
    twist: Pose
    pose_covariance: DoubleArray = field(default_factory=lambda: ZERO_COVARIANCE)
    twist_covariance: DoubleArray = field(default_factory=lambda: ZERO_COVARIANCE)


@dataclass(frozen=True, slots=True)
class PoseStamped:
    """Pose of a frame at one time, as in `geometry_msgs/PoseStamped`.

    Attributes:
        stamp: Simulated time [ns].
        frame_id: Frame of the pose.
        pose: Pose (x, y, yaw) [m, m, rad].
    """

    stamp: int
    frame_id: str
    pose: Pose


@dataclass(frozen=True, slots=True, eq=False)
class TwistWithCovariance:
    """A measured velocity, as in `geometry_msgs/TwistWithCovarianceStamped`.

    Attributes:
        stamp: Simulated time [ns].
        frame_id: Frame of the velocity.
        twist: Velocity (vx, vy, omega) [m/s, m/s, rad/s].
        covariance: Covariance of the velocities along and about x, y, z; shape (6, 6).
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
        linear_acceleration: Acceleration (x, y) in the body frame [m/s²].
        orientation_covariance: Covariance of roll, pitch, yaw; shape (3, 3).
        angular_velocity_covariance: Covariance of the angular velocities; shape (3, 3).
        linear_acceleration_covariance: Covariance of the accelerations; shape (3, 3).
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
    """A satellite position on WGS84 [deg, deg, m], as in `sensor_msgs/NavSatFix`."""

    stamp: int
    frame_id: str
    latitude: float
    longitude: float
    altitude: float


@dataclass(frozen=True, slots=True, eq=False)
class Collision:
    """A current contact between two entities.

    Attributes:
        entity_a: Name of the model that reports the contact.
        body_a: Name of the body of entity A.
        entity_b: Name of the other model or layer.
        body_b: Name of the body of entity B.
        magnitude_forces: Magnitude of the force at each contact point [N], shape (k,).
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
    """All current contacts of a model."""

    stamp: int
    frame_id: str
    collisions: tuple[Collision, ...] = ()


@dataclass(frozen=True, slots=True)
class Transform:
    """Pose of the frame `child` in the frame `parent`: a roll, then a yaw, then a translation.

    Attributes:
        stamp: Simulated time [ns].
        parent: Frame id of the parent.
        child: Frame id of the child.
        x: Position of the child along x of the parent [m].
        y: Position of the child along y of the parent [m].
        yaw: Angle about z of the parent [rad].
        roll: Angle about x of the child [rad], pi for a sensor mounted upside down.
    """

    stamp: int
    parent: str
    child: str
    x: float
    y: float
    yaw: float
    roll: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class People:
    """Positions of people, as in `geometry_msgs/PoseArray`.

    Attributes:
        stamp: Simulated time [ns].
        frame_id: Frame of the world.
        names: Names of the models, which are not part of the message.
        poses: Poses (x, y, yaw) [m, rad], shape (n, 3).
    """

    stamp: int
    frame_id: str
    names: tuple[str, ...]
    poses: DoubleArray


@dataclass(frozen=True, slots=True, eq=False)
class PeopleStates:
    """The states of people, as in the message `PeopleStates`.

    Attributes:
        stamp: Simulated time [ns].
        frame_id: Frame of the world.
        names: Names of the models.
        poses: Poses (x, y, yaw) [m, rad], shape (n, 3).
        groups: Names of the groups.
        velocities: Velocities (vx, vy, omega) in the world frame [m/s, rad/s], shape (n, 3).
        standing: Whether each person stands on purpose, shape (n,).
    """

    stamp: int
    frame_id: str
    names: tuple[str, ...]
    poses: DoubleArray
    groups: tuple[str, ...]
    velocities: DoubleArray
    standing: BoolArray


@dataclass(frozen=True, slots=True, eq=False)
class TrackedPeople(PeopleStates):
    """The states of people, as in `people_msgs/People`."""


@dataclass(frozen=True, slots=True, eq=False)
class PeopleMarkers(PeopleStates):
    """The states of people with what RViz needs to display them.

    Attributes:
        ids: Number of each person below 2^31, which a later person may get after a removal.
        group_names: Names of all groups, also of those without people.
        colors: (r, g, b, a) of each group, each in [0, 1].
        radii: Radius of the people of each group [m].
        removed: Numbers of the last value that are not used any more; None if that value is not
            known.
    """

    ids: tuple[int, ...]
    group_names: tuple[str, ...]
    colors: tuple[tuple[float, ...], ...]
    radii: tuple[float, ...]
    removed: tuple[int, ...] | None
