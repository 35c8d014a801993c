"""The quality of service of topics.

| topics of the node | reliability | durability |
|---|---|---|
| `/clock` | best effort | volatile |
| measurements of sensors | best effort, unless `reliable_sensors` is set | volatile |
| `map`, states and other latched topics | reliable | transient local |
| all others | reliable | volatile |

A subscription is reliable, and transient local for maps and static transforms. That of the viewer
in the browser is what all publishers offer.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo

from flatland.ros2.message_types import type_name

CLOCK: Final = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
STATE: Final = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_MIN_DEPTH: Final = 10  # messages, as usual in ROS 2; a burst of steps creates several
_SENSORS: Final = frozenset(
    (
        "sensor_msgs/msg/Imu",
        "sensor_msgs/msg/LaserScan",
        "sensor_msgs/msg/NavSatFix",
        "sensor_msgs/msg/Range",
        "flatland_msgs/msg/SemanticScan",
    )
)
STATIC_TRANSFORMS: Final = "/tf_static"
_TRANSFORMS: Final = "/tf"
_TRANSFORM_DEPTH: Final = 100  # messages; several nodes send some in each step
_MAP: Final = "nav_msgs/msg/OccupancyGrid"
UNKNOWN_NODE: Final = "_NODE_NAME_UNKNOWN_"
"""Name of a node that has not been discovered completely."""
_SOME: Final = "a subscriber"
_RECEIVES_NOTHING: Final = "receives nothing, because it requires"


def of_publisher(
    message_type: type[Any], queue_size: int, *, latch: bool, reliable_sensors: bool
) -> QoSProfile:
    """Returns the quality of service of a publisher.

    Args:
        message_type: The message class.
        queue_size: Number of messages kept for a slow subscriber, at least.
        latch: Whether new subscribers receive the last messages.
        reliable_sensors: Whether measurements of sensors are reliable.
    """
    if latch:
        return QoSProfile(depth=queue_size, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    depth = max(queue_size, _MIN_DEPTH)
    if type_name(message_type) in _SENSORS and not reliable_sensors:
        return QoSProfile(depth=depth, reliability=ReliabilityPolicy.BEST_EFFORT)
    return QoSProfile(depth=depth)


def refused(subscribers: Sequence[TopicEndpointInfo], offered: QoSProfile) -> list[str]:
    """Returns a text for each subscriber that requires more than a publisher offers.

    If none of those that are known does, there is one text for a subscriber that is not known yet.

    Args:
        subscribers: The subscribers of the topic that have been discovered.
        offered: Quality of service of the publisher.
    """
    texts = []
    is_best_effort = offered.reliability == ReliabilityPolicy.BEST_EFFORT
    reliable = "reliable messages: let it subscribe with best effort (the profile of sensor data)"
    if offered is not CLOCK:
        reliable += ", or start the simulator with reliable_sensors:=true"
    stored = "stored messages: let it subscribe as volatile"
    for each in subscribers:
        name = f"{each.node_namespace.rstrip('/')}/{each.node_name}"
        if each.node_name == UNKNOWN_NODE:
            name = _SOME
        wanted = each.qos_profile
        if wanted.reliability == ReliabilityPolicy.RELIABLE and is_best_effort:
            texts.append(f"{name} {_RECEIVES_NOTHING} {reliable}")
        is_stored = wanted.durability == DurabilityPolicy.TRANSIENT_LOCAL
        if is_stored and offered.durability == DurabilityPolicy.VOLATILE:
            texts.append(f"{name} {_RECEIVES_NOTHING} {stored}")
    return texts or [f"{_SOME} {_RECEIVES_NOTHING} {reliable if is_best_effort else stored}"]


def of_viewer(publishers: Sequence[TopicEndpointInfo]) -> QoSProfile:
    """Returns the quality of service of a subscription that all present publishers satisfy.

    Args:
        publishers: The publishers of the topic.
    """
    offered = [each.qos_profile for each in publishers]
    reliability, durability = ReliabilityPolicy.BEST_EFFORT, DurabilityPolicy.VOLATILE
    if offered and all(each.reliability == ReliabilityPolicy.RELIABLE for each in offered):
        reliability = ReliabilityPolicy.RELIABLE
    if offered and all(each.durability == DurabilityPolicy.TRANSIENT_LOCAL for each in offered):
        durability = DurabilityPolicy.TRANSIENT_LOCAL
    return QoSProfile(depth=_MIN_DEPTH, reliability=reliability, durability=durability)


def of_subscription(topic: str, message_type: type[Any]) -> QoSProfile:
    """Returns the quality of service of a subscription of the node or of a plugin.

    Args:
        topic: Resolved name of the topic.
        message_type: The message class.
    """
    if topic == STATIC_TRANSFORMS:
        return QoSProfile(depth=_TRANSFORM_DEPTH, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    if topic == _TRANSFORMS:
        return QoSProfile(depth=_TRANSFORM_DEPTH)
    if type_name(message_type) == _MAP:
        return STATE
    return QoSProfile(depth=_MIN_DEPTH)
