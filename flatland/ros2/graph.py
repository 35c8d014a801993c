"""Which topics exist, as rclpy has discovered them."""

from __future__ import annotations

import time
from typing import Any, Final

from rclpy.node import Node
from rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden

from flatland.ros2 import ros_time
from flatland.ros2.message_types import message_class
from flatland.web.foreign_topics import PoseKind

PERIOD: Final = 1.0  # s of wall time between two refreshes


class Graph:
    """The topics of all nodes.

    Attributes:
        published: Type of each topic that has a publisher, `PACKAGE/NAME`.
        subscribed: Type of each topic that has a subscriber, and its subscribers.
        pose_topics: Name of the usual topic of each kind of pose.
    """

    pose_topics: Final[dict[PoseKind, str]] = {"goal": "goal_pose", "initial_pose": "initialpose"}

    def __init__(self, node: Node) -> None:
        """Creates a graph without topics.

        Args:
            node: The node.
        """
        self.published: dict[str, str] = {}
        self.subscribed: dict[str, tuple[str, frozenset[str]]] = {}
        self._node = node
        self._due = 0.0

    def refresh(self) -> None:
        """Reads the topics after the period."""
        now = time.monotonic()
        if now < self._due:
            return
        self._due = now + PERIOD
        published: dict[str, str] = {}
        subscribed: dict[str, tuple[str, frozenset[str]]] = {}
        for topic, types in sorted(self._node.get_topic_names_and_types()):
            if topic_or_service_is_hidden(topic):  # of an action
                continue
            kind = types[0].replace("/msg/", "/")
            if self._node.get_publishers_info_by_topic(topic):
                published[topic] = kind
            nodes = self._node.get_subscriptions_info_by_topic(topic)
            names = (f"{each.node_namespace.rstrip('/')}/{each.node_name}" for each in nodes)
            if nodes:
                subscribed[topic] = (kind, frozenset(names))
        self.published, self.subscribed = published, subscribed

    def message_classes(self, kind: str) -> list[type[Any]]:
        """Returns the message class of a type."""
        try:
            return [message_class(kind)]
        except ImportError:
            return []

    def now(self) -> int:
        """Returns the ROS time [ns]."""
        return ros_time.now()
