"""Which topics exist, according to the ROS master."""

from __future__ import annotations

import time
from typing import Any, Final
from xmlrpc.client import MultiCall, ServerProxy

import genpy.message
import rosgraph
import rospy

from flatland.ros.adapters import message_class
from flatland.ros.transport.master_watch import LimitedTransport
from flatland.web.foreign_topics import PoseKind

PERIOD: Final = 1.0  # s of wall time between two calls to the master
_TIMEOUT: Final = 2.0  # s
_UNKNOWN_TYPE: Final = "*"


class Graph:
    """The topics of the last response of the ROS master.

    Attributes:
        published: Type of each topic that has a publisher.
        subscribed: Type of each topic that has a subscriber, and its subscribers.
        pose_topics: Name of the usual topic of each kind of pose.
    """

    pose_topics: Final[dict[PoseKind, str]] = {
        "goal": "move_base_simple/goal",
        "initial_pose": "initialpose",
    }

    def __init__(self, node_name: str) -> None:
        """Creates a graph without topics.

        Args:
            node_name: Name of this node.
        """
        self.published: dict[str, str] = {}
        self.subscribed: dict[str, tuple[str, frozenset[str]]] = {}
        self._node_name = node_name
        self._uri: str = rosgraph.get_master_uri()
        self._due = 0.0

    def refresh(self) -> None:
        """Calls the master after the period; without a response, the topics stay the same."""
        now = time.monotonic()
        if now < self._due:
            return
        self._due = now + PERIOD
        try:
            publishers, subscribers, types = self._ask()
        except Exception:  # The master does not respond, which the node logs.
            return
        self.published = {
            name: types[name]
            for name, _ in sorted(publishers)
            if types.get(name, _UNKNOWN_TYPE) != _UNKNOWN_TYPE
        }
        self.subscribed = {
            name: (types.get(name, _UNKNOWN_TYPE), frozenset(nodes))
            for name, nodes in sorted(subscribers)
        }

    def _ask(self) -> tuple[Any, Any, dict[str, str]]:
        with ServerProxy(self._uri, transport=LimitedTransport(_TIMEOUT)) as master:
            calls = MultiCall(master)
            calls.getSystemState(self._node_name)
            calls.getTopicTypes(self._node_name)
            responses: Any = calls()
            (_, _, state), (_, _, types) = responses[0], responses[1]
        publishers, subscribers, _services = state
        return publishers, subscribers, dict(types)

    def message_classes(self, kind: str) -> list[type[Any]]:
        """Returns the message classes of a type: that of adapters, and that of other users."""
        try:
            classes: list[type[Any]] = [message_class(kind)]
            plain = genpy.message.get_message_class(kind)
        except (AttributeError, ImportError, ValueError):
            return []
        return classes if plain is None or plain is classes[0] else [*classes, plain]

    def now(self) -> int:
        """Returns the ROS time [ns]."""
        return int(rospy.get_rostime().to_nsec())
