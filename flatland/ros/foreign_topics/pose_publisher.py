"""Publishes goals and initial poses, as the tools of RViz do."""

from __future__ import annotations

import math
import time
from typing import Any, Final

import rospy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from std_msgs.msg import Header

from flatland.geometry import Pose
from flatland.node.values import WORLD_FRAME
from flatland.ros.adapters import convert
from flatland.ros.foreign_topics.graph import Graph
from flatland.ros.transport.publisher import Publisher
from flatland.ros.transport.ros_transport import RosTransport
from flatland.web.foreign_topics import PoseKind

DEFAULT_TOPICS: Final[dict[PoseKind, str]] = {
    "goal": "move_base_simple/goal",
    "initial_pose": "initialpose",
}
_TYPES: Final[dict[PoseKind, Any]] = {
    "goal": PoseStamped,
    "initial_pose": PoseWithCovarianceStamped,
}
_POSITION_VARIANCE: Final = 0.5**2  # m², as RViz
_YAW_VARIANCE: Final = (math.pi / 12) ** 2  # rad²
_CONNECTION_TIMEOUT: Final = 2.0  # s for the subscribers of a topic that was just advertised
_POLL_PERIOD: Final = 0.01  # s


class PosePublisher:
    """Publishes poses on topics, each of which is advertised when it is first used."""

    def __init__(self, transport: RosTransport, graph: Graph) -> None:
        """Creates an object without topics.

        Args:
            transport: Advertises the topics.
            graph: The subscribers.
        """
        self._transport = transport
        self._graph = graph
        self._publishers: dict[str, Publisher] = {}

    def topics(self, kind: PoseKind) -> list[str]:
        """Returns the default topic of a kind of pose, and those to which other nodes subscribe."""
        default = self._transport.resolve(DEFAULT_TOPICS[kind])
        others = [
            name
            for name, (message_type, nodes) in self._graph.subscribed.items()
            if message_type == _TYPES[kind]._type
            and nodes - {self._transport.node_name}
            and name != default
        ]
        return [default, *others]

    def publish(self, kind: PoseKind, topic: str, pose: Pose) -> bool:
        """Publishes a pose in the world frame and returns whether there is a subscriber.

        Raises:
            FlatlandError: The node publishes messages of another type on the topic.
        """
        publisher = self._publishers.get(topic)
        if publisher is None or publisher.closed:
            publisher = self._transport.advertise(topic, _TYPES[kind], gives_way=True)
            self._publishers[topic] = publisher
            self._wait_for_connections(publisher)
        publisher.publish(_message(kind, pose))
        return bool(publisher.connections)

    def _wait_for_connections(self, publisher: Publisher) -> None:
        """Waits for the subscribers of a topic, which connect after its registration."""
        _, subscribers = self._graph.subscribed.get(publisher.topic, ("", frozenset()))
        end = time.monotonic() + _CONNECTION_TIMEOUT
        while publisher.connections < len(subscribers) and time.monotonic() < end:
            time.sleep(_POLL_PERIOD)

    def close(self) -> None:
        """Unregisters the topics."""
        for publisher in self._publishers.values():
            publisher.close()


def _message(kind: PoseKind, pose: Pose) -> Any:
    message = _TYPES[kind](header=Header(0, rospy.get_rostime(), WORLD_FRAME))
    if kind == "goal":
        message.pose = convert.pose(*pose)
        return message
    message.pose.pose = convert.pose(*pose)
    covariance = [0.0] * 36
    covariance[0] = covariance[7] = _POSITION_VARIANCE
    covariance[35] = _YAW_VARIANCE
    message.pose.covariance = covariance
    return message
