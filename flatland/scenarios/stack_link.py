"""The topics between the world of a run and the nodes that drive its robot."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Final

from flatland.geometry import compose, invert
from flatland.node.bridge import TF_QUEUE_SIZE, Bridge
from flatland.node.clock import SimulatedClock
from flatland.node.maps import PublishedLayer
from flatland.node.values import WORLD_FRAME, Transforms
from flatland.runtime.observer import WorldObserver
from flatland.values import Transform, Twist

if TYPE_CHECKING:
    from flatland.geometry import Pose, Vector2
    from flatland.node.transport import Publisher, Transport
    from flatland.scenarios.stack_options import StackOptions
    from flatland.scenarios.stage import Stage

_MAP_RESOLUTION: Final = 0.05  # of a layer without an image [m]
_POSITION_VARIANCE: Final = 0.01  # of the initial pose [m^2]
_ANGLE_VARIANCE: Final = 0.01  # [rad^2]
_REGISTRATION_TIMEOUT: Final = 5.0  # s
_UNSUCCESSFUL: Final = {2: "preempted", 4: "aborted", 5: "rejected", 8: "recalled"}
"""Final states of actionlib_msgs/GoalStatus without success."""

Route = Callable[[str, Callable[[Any], object]], Callable[[Any], object]]
"""Returns what receives the messages of a topic, from its name and what would receive them."""


class StackLink(WorldObserver):
    """Connects a world to nodes, except that the commands of the robot are collected.

    Attributes:
        bridge: Publishes the outputs of the world; an observer of the world like the link itself.
        transport: Publishes and subscribes.
    """

    def __init__(self, open_transport: Callable[[Route], Transport], options: StackOptions) -> None:
        """Publishes the clock; the world is loaded with this object and `bridge` as observers.

        Args:
            open_transport: Returns the transport, which asks for the receiver of each topic.
            options: Topics and frames.
        """
        self._options = options
        self._commands = threading.Condition()  # guards the members below
        self._drive_topic = ""
        self._latest: Any = None
        self._count = 0
        self.transport = open_transport(self._route)
        self._clock = SimulatedClock(self.transport)
        self.bridge = Bridge(self.transport, self._clock)
        self._tf, self._convert = self.transport.values("/tf", Transforms, queue_size=TF_QUEUE_SIZE)
        self._stage: Stage | None = None
        self._base_frame = ""
        self._goals: Publisher | None = None
        self._initial_pose: Publisher | None = None
        self._has_action = threading.Event()
        self._goal_number = self._recoveries = 0
        self._given_up = ""

    def close(self) -> None:
        """Ends the clock."""
        self.bridge.close()
        self._clock.close()

    # -- a run -----------------------------------------------------------------------------

    def attach(self, stage: Stage, drive_topic: str) -> None:
        """Collects the commands of a robot, and publishes the map and the topics of its goals.

        Args:
            stage: The prepared run.
            drive_topic: Topic of its command.
        """
        with self._commands:
            self._drive_topic = self.transport.resolve(drive_topic)
        self.use(stage)
        layer = stage.world.map_layer or next(
            (name for each in stage.world.layers for name in each.names), ""
        )
        if layer:
            PublishedLayer(self.transport, stage.world, layer, WORLD_FRAME, _MAP_RESOLUTION)
        action = self._options.goal_action
        topic = f"{action}/goal" if action else self._options.goal_topic
        goal_type = "move_base_msgs/MoveBaseActionGoal" if action else "geometry_msgs/PoseStamped"
        message_class = self.transport.message_class
        self._goals = self.transport.advertise(topic, message_class(goal_type), queue_size=10)
        self._initial_pose = self.transport.advertise(
            "initialpose", message_class("geometry_msgs/PoseWithCovarianceStamped"), latch=True
        )
        if action:
            self.transport.subscribe(
                f"{action}/status",
                message_class("actionlib_msgs/GoalStatusArray"),
                self._receive_status,
            )
            self.transport.subscribe(
                f"{action}/recovery_status",
                message_class("move_base_msgs/RecoveryStatus"),
                self._receive_recovery,
            )
        self.transport.flush(_REGISTRATION_TIMEOUT)

    def use(self, stage: Stage | None) -> None:
        """Takes another stage of the same world, whose robot is another object; None for none."""
        self._stage = stage
        if stage is not None:
            self._base_frame = stage.robot.frame(stage.robot.bodies[0].name)

    @property
    def base_frame(self) -> str:
        """Frame of the robot."""
        return self._base_frame

    @property
    def missing(self) -> str:
        """What the stack lacks to be driven, as a text; empty if it is ready."""
        if not self.transport.is_connected(self._drive_topic):
            return f"no node publishes {self._drive_topic}"
        if self._goals is None or not self._goals.connected:
            return f"no node subscribes to {self._goals.topic if self._goals else 'goals'}"
        if self._options.goal_action and not self._has_action.is_set():
            return f"the action {self._options.goal_action} is not available"
        return ""

    def send_initial_pose(self, pose: Pose) -> None:
        """Sends a pose to the localisation, also to one that subscribes later."""
        if self._initial_pose is None:
            return
        message = self.transport.message_class("geometry_msgs/PoseWithCovarianceStamped")()
        message.header.frame_id = WORLD_FRAME
        _set_pose(message.pose.pose, pose)
        covariance = [0.0] * 36
        covariance[0] = covariance[7] = _POSITION_VARIANCE
        covariance[35] = _ANGLE_VARIANCE
        message.pose.covariance = covariance
        self._initial_pose.publish(message)

    def send_goal(self, goal: Vector2, yaw: float) -> None:
        """Sends a goal in the frame `map`."""
        if self._goals is None:
            return
        action = self._options.goal_action
        kind = "move_base_msgs/MoveBaseActionGoal" if action else "geometry_msgs/PoseStamped"
        message = self.transport.message_class(kind)()
        target = message
        if action:
            self._goal_number += 1
            self._given_up = ""
            message.goal_id.id = self._goal_id
            target = message.goal.target_pose
        target.header.frame_id = WORLD_FRAME
        _set_pose(target.pose, (*goal, yaw))
        self._goals.publish(message)

    @property
    def given_up(self) -> str:
        """Why the action ended the current goal without success; empty if it has not."""
        return self._given_up

    @property
    def recoveries(self) -> int:
        """Number of recovery behaviours that the action has begun."""
        return self._recoveries

    @property
    def _goal_id(self) -> str:
        return f"flatland-{self._goal_number}"

    def _receive_status(self, message: Any) -> None:
        """Receives the states of all goals of the action; called in any thread."""
        self._has_action.set()
        for one in message.status_list:
            if one.goal_id.id == self._goal_id and one.status in _UNSUCCESSFUL:
                verb, text = _UNSUCCESSFUL[one.status], one.text
                reason = f"{self._options.goal_action} {verb} the goal"
                self._given_up = f"{reason}: {text}" if text else reason

    def _receive_recovery(self, _message: Any) -> None:
        """Counts a recovery behaviour; called in the thread of the connection."""
        self._recoveries += 1

    # -- commands --------------------------------------------------------------------------

    def wait(self, timeout: float) -> bool:
        """Waits for a command; returns whether there is one since `take`.

        Args:
            timeout: Limit of wall time [s].
        """
        with self._commands:
            return self._commands.wait_for(lambda: self._count > 0, timeout)

    def take(self) -> tuple[int, Any]:
        """Returns the number of commands since the last call, and the last one, None for none."""
        with self._commands:
            count, latest = self._count, self._latest
            self._count, self._latest = 0, None
        return count, latest

    def _route(self, topic: str, receive: Callable[[Any], object]) -> Callable[[Any], object]:
        """Returns what receives the messages of a topic; called in any thread."""

        def collect(message: Any) -> None:
            if topic != self._drive_topic:
                receive(message)
                return
            command = message
            with self._commands:
                self._count += 1
                self._latest = Twist(command.linear.x, command.linear.y, command.angular.z)
                self._commands.notify()

        return collect

    # -- transforms ------------------------------------------------------------------------

    @property
    def wants_transforms(self) -> bool:
        """Whether the link sends a localisation."""
        return self._options.localization == "true" and self._tf.connected

    def transforms_sent(self, transforms: Sequence[Transform]) -> None:
        """Sends the true transform from the map to the frame of the odometry."""
        if self._stage is None:
            return
        pose = self._stage.robot.pose
        for sent in transforms:
            if sent.child == self._base_frame and sent.parent != WORLD_FRAME:
                origin = compose(pose, invert((sent.x, sent.y, sent.yaw)))
                localized = Transform(sent.stamp, WORLD_FRAME, sent.parent, *origin)
                self._tf.publish(self._convert(Transforms((localized,))))


def _set_pose(target: Any, pose: Pose) -> None:
    target.position.x, target.position.y = pose[:2]
    target.orientation.z, target.orientation.w = math.sin(pose[2] / 2), math.cos(pose[2] / 2)
