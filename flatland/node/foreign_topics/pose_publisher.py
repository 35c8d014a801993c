"""Publishes goals and initial poses, as the tools of RViz do."""

from __future__ import annotations

import math
import time
from typing import Final

import numpy as np

from flatland.geometry import Pose
from flatland.node.foreign_topics.graph import Graph
from flatland.node.transport import Publisher, Transport
from flatland.node.values import WORLD_FRAME
from flatland.timekeeper import NANOSECONDS
from flatland.web.foreign_topics import PoseKind

_TYPES: Final[dict[PoseKind, str]] = {
    "goal": "geometry_msgs/PoseStamped",
    "initial_pose": "geometry_msgs/PoseWithCovarianceStamped",
}
_POSITION_VARIANCE: Final = 0.5**2  # m², as RViz
_YAW_VARIANCE: Final = (math.pi / 12) ** 2  # rad²
_CONNECTION_TIMEOUT: Final = 2.0  # s for the subscribers of a topic that was just advertised
_POLL_PERIOD: Final = 0.01  # s


class PosePublisher:
    """Publishes poses on topics, each of which is advertised when it is first used."""

    def __init__(self, transport: Transport, graph: Graph) -> None:
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
        default = self._transport.resolve(self._graph.pose_topics[kind])
        others = [
            name
            for name, (message_type, nodes) in self._graph.subscribed.items()
            if message_type == _TYPES[kind]
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
            publisher = self._transport.advertise(
                topic, self._transport.message_class(_TYPES[kind]), gives_way=True
            )
            self._publishers[topic] = publisher
            self._wait_for_connections(publisher)
        publisher.publish(self._message(kind, pose))
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

    def _message(self, kind: PoseKind, pose: Pose) -> bytes:
        to = self._transport.writer()
        to.stamp(*divmod(self._graph.now(), NANOSECONDS))
        to.text(WORLD_FRAME)
        to.pose(*pose)
        if kind == "initial_pose":
            variances = np.zeros(6)
            variances[[0, 1, 5]] = _POSITION_VARIANCE, _POSITION_VARIANCE, _YAW_VARIANCE
            to.covariance(np.diag(variances), 6)
        return bytes(to.data)
