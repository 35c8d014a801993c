"""The topics of the node with their types, frames and rates: one table for ROS 1 and ROS 2.

`WORLD` is the entry of the models of a world whose robot has a plugin for each of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

ROBOT = """
class: robot
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: DiffDrive, name: drive, body: base, pub_rate: 50, twist_pub: twist}
  - {type: Laser, name: laser, body: base, range: 20, update_rate: 10,
     angle: {min: -1.5, max: 1.5, increment: 0.5}}
  - {type: SemanticScan, name: labels, body: base, range: 20, update_rate: 5, frame: laser,
     broadcast_tf: false, angle: {min: -1.5, max: 1.5, increment: 0.5}}
  - {type: Sonar, name: sonar, body: base, range: 4, field_of_view: 0.5, update_rate: 20}
  - {type: Imu, name: imu, body: base, update_rate: 100}
  - {type: Gps, name: gps, body: base, ref_lat: 50.0, ref_lon: 8.0, update_rate: 10}
  - {type: Bumper, name: bumper, update_rate: 20, publish_all_collisions: true}
  - {type: BoolSensor, name: touch, body: base, update_rate: 20}
  - {type: PosePublisher, name: pose, body: base, topic: pose, update_rate: 20}
"""
WORLD = "[{name: robot, model: sensors.model.yaml, pose: [1, 2, 0]}]"
PROPERTIES = "{publish_map: 2d}"

Delivery = Literal["sensor", "state", "clock", "reliable"]


@dataclass(frozen=True)
class Row:
    """A topic.

    Attributes:
        name: Name of the topic.
        type: Message, `PACKAGE/NAME`; of the package flatland for own messages.
        frame: Frame of the header, None for a message without header.
        rate: Messages per second of simulated time [Hz]; None if it is not constant.
        delivery: `sensor` (best effort in ROS 2), `state` (late subscribers receive the last
            message), `clock` (best effort) or `reliable`.
    """

    name: str
    type: str
    frame: str | None
    rate: float | None
    delivery: Delivery


TABLE = (
    Row("/clock", "rosgraph_msgs/Clock", None, 200, "clock"),
    Row("/tf", "tf2_msgs/TFMessage", None, None, "reliable"),  # a message with what is due
    Row("/map", "nav_msgs/OccupancyGrid", "map", None, "state"),
    Row("/map_metadata", "nav_msgs/MapMetaData", None, None, "state"),
    Row("/model_states", "flatland/ModelStates", "map", 50, "state"),
    Row("/flatland_server/paused", "std_msgs/Bool", None, None, "state"),
    Row("/odometry/filtered", "nav_msgs/Odometry", "odom", 50, "reliable"),
    Row("/odometry/ground_truth", "nav_msgs/Odometry", "map", 50, "reliable"),
    Row("/twist", "geometry_msgs/TwistWithCovarianceStamped", "base", 50, "reliable"),
    Row("/scan", "sensor_msgs/LaserScan", "laser", 10, "sensor"),
    Row("/semantic_scan", "flatland/SemanticScan", "laser", 5, "sensor"),
    Row("/range", "sensor_msgs/Range", "sonar", 20, "sensor"),
    Row("/imu/filtered", "sensor_msgs/Imu", "imu", 100, "sensor"),
    Row("/imu/ground_truth", "sensor_msgs/Imu", "imu", 100, "sensor"),
    Row("/gps/fix", "sensor_msgs/NavSatFix", "gps", 10, "sensor"),
    Row("/collisions", "flatland/Collisions", "map", 20, "reliable"),
    Row("/bool_sensor", "std_msgs/Bool", None, 20, "reliable"),
    Row("/pose", "geometry_msgs/PoseStamped", "map", 20, "reliable"),
)
