"""What a run needs from ROS, which ROS 1 and ROS 2 offer in different ways."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Protocol

from flatland.node.values import WORLD_FRAME

if TYPE_CHECKING:
    from flatland.geometry import Pose
    from flatland.node.transport import Transport


class StackError(Exception):
    """The nodes do not drive the robot; the text is the reason."""


class Goals(Protocol):
    """Sends goals to nodes."""

    @property
    def given_up(self) -> str:
        """Why the nodes ended the current goal without success; empty if they have not."""

    @property
    def recoveries(self) -> int:
        """Number of recovery behaviours that the nodes have begun."""

    @property
    def missing(self) -> str:
        """What the nodes lack to receive goals, as a text; empty if they are ready."""

    def send(self, goal: Pose) -> None:
        """Sends a goal in the frame `map`."""


class Ros(Protocol):
    """The connection of a process to nodes that no other run is connected to.

    Attributes:
        goal_topic: Usual topic of goals.
        environment: Variables of the environment of the nodes.
        transport: Publishes and subscribes.
    """

    goal_topic: str
    environment: dict[str, str]
    transport: Transport

    def action(self, name: str) -> Goals:
        """Returns what sends goals to an action.

        Raises:
            StackError: Its messages are not installed.
        """

    def publishers(self, topic: str) -> str:
        """Describes publishers of a topic that are not connected, for messages; empty for none."""

    def close(self) -> None:
        """Ends all connections."""


class TopicGoals:
    """Sends goals on a topic, about which nothing is reported."""

    given_up = ""
    recoveries = 0

    def __init__(self, transport: Transport, topic: str) -> None:
        """Advertises the topic.

        Args:
            transport: Publishes.
            topic: Its name.
        """
        self._message_class = transport.message_class("geometry_msgs/PoseStamped")
        self._goals = transport.advertise(topic, self._message_class, queue_size=10)

    @property
    def missing(self) -> str:
        """What the nodes lack to receive goals."""
        return "" if self._goals.connected else f"no node subscribes to {self._goals.topic}"

    def send(self, goal: Pose) -> None:
        """Sends a goal in the frame `map`."""
        message = self._message_class()
        set_goal(message, goal)
        self._goals.publish(message)


def set_goal(target: Any, goal: Pose) -> None:
    """Sets a `geometry_msgs/PoseStamped` to a pose in the frame `map`."""
    target.header.frame_id = WORLD_FRAME
    set_pose(target.pose, goal)


def set_pose(target: Any, pose: Pose) -> None:
    """Sets a `geometry_msgs/Pose`."""
    target.position.x, target.position.y = pose[:2]
    target.orientation.z, target.orientation.w = math.sin(pose[2] / 2), math.cos(pose[2] / 2)
