"""The topics between the world of a run and the nodes that drive its robot."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from flatland.geometry import compose, invert
from flatland.node.bridge import TF_QUEUE_SIZE, Bridge
from flatland.node.clock import SimulatedClock
from flatland.node.maps import PublishedLayer
from flatland.node.stamps import stamp as message_stamp
from flatland.node.values import WORLD_FRAME, FrameParents, Transforms
from flatland.runtime.observer import WorldObserver
from flatland.scenarios.connection import Goals, Ros, TopicGoals, set_pose
from flatland.scenarios.transforms import TransformHistory
from flatland.values import Transform

if TYPE_CHECKING:
    from flatland.geometry import Pose
    from flatland.node.clock import NodeClock
    from flatland.node.transport import Publisher, Transport
    from flatland.plugin_api.ports import Command
    from flatland.scenarios.stack_options import StackOptions
    from flatland.scenarios.stage import Stage

_MAP_RESOLUTION: Final = 0.05  # of a layer without an image [m]
_POSITION_VARIANCE: Final = 0.01  # of the initial pose [m^2]
_ANGLE_VARIANCE: Final = 0.01  # [rad^2]
_REGISTRATION_TIMEOUT: Final = 5.0  # s


class StackLink(WorldObserver):
    """Connects a world to nodes, except that the commands of the robot are collected.

    Attributes:
        bridge: Publishes the outputs of the world; an observer of the world like the link itself.
        transport: Publishes and subscribes.
    """

    def __init__(self, ros: Ros, options: StackOptions) -> None:
        """Publishes the clock; the world is loaded with this object and `bridge` as observers.

        Args:
            ros: The connection to ROS.
            options: Topics and frames.
        """
        self._ros = ros
        self._options = options
        self._commands = threading.Condition()  # guards the members below
        self._drive_topic = ""
        self._latest: Any = None
        self._count = 0
        self.transport = ros.transport
        self._clock = SimulatedClock(self.transport)
        self.bridge: Bridge = _CollectingBridge(self.transport, self._clock, self._collect)
        self._tf, self._convert = self.transport.values("/tf", Transforms, queue_size=TF_QUEUE_SIZE)
        self._transforms = TransformHistory()
        if options.localization == "stack":
            message_class, _ = self.transport.receivable(FrameParents)
            for topic, is_static in (("/tf", False), ("/tf_static", True)):
                receive = partial(self._transforms.add_message, is_static=is_static)
                self.transport.subscribe(topic, message_class, receive)
        self._stage: Stage | None = None
        self._base_frame = ""
        self._goals: Goals | None = None
        self._initial_pose: Publisher | None = None

    def close(self) -> None:
        """Ends the clock."""
        self.bridge.close()
        self._clock.close()

    # -- a run -----------------------------------------------------------------------------

    def attach(self, stage: Stage) -> None:
        """Collects the commands of the robot, and publishes the map and the topics of its goals.

        Args:
            stage: The prepared run.
        """
        with self._commands:
            self._drive_topic = stage.drive.topic
        self._transforms.keep_periods(stage.task.period)
        self.use(stage)
        layer = stage.world.map_layer or next(
            (name for each in stage.world.layers for name in each.names), ""
        )
        if layer:
            PublishedLayer(self.transport, stage.world, layer, WORLD_FRAME, _MAP_RESOLUTION)
        options = self._options
        if options.goal_action:
            self._goals = self._ros.action(options.goal_action)
        else:
            self._goals = TopicGoals(self.transport, options.goal_topic or self._ros.goal_topic)
        self._initial_pose = self.transport.advertise(
            "initialpose",
            self.transport.message_class("geometry_msgs/PoseWithCovarianceStamped"),
            latch=True,
        )
        self.transport.flush(_REGISTRATION_TIMEOUT)

    def use(self, stage: Stage | None) -> None:
        """Takes another stage of the same world, whose robot is another object; None for none."""
        self._stage = stage
        if stage is not None:
            self._base_frame = stage.robot.frame(stage.robot.bodies[0].name)

    def keep_time(self) -> None:
        """Makes the ROS time continue when the world is reset next."""
        self._clock.keep_time()

    @property
    def missing(self) -> str:
        """What the stack lacks to be driven, as a text; empty if it is ready."""
        if not self.transport.is_connected(self._drive_topic):
            return f"no node publishes {self._drive_topic}{self._ros.publishers(self._drive_topic)}"
        return "" if self._goals is None else self._goals.missing

    def send_initial_pose(self, pose: Pose) -> None:
        """Sends a pose to the localisation, also to one that subscribes later."""
        if self._initial_pose is None:
            return
        message = self.transport.message_class("geometry_msgs/PoseWithCovarianceStamped")()
        message.header.frame_id = WORLD_FRAME
        set_pose(message.pose.pose, pose)
        covariance = [0.0] * 36
        covariance[0] = covariance[7] = _POSITION_VARIANCE
        covariance[35] = _ANGLE_VARIANCE
        message.pose.covariance = covariance
        self._initial_pose.publish(message)

    def send_goal(self, goal: Pose) -> None:
        """Sends a goal in the frame `map`."""
        if self._goals is not None:
            self._goals.send(goal)

    @property
    def given_up(self) -> str:
        """Why the action ended the current goal without success; empty if it has not."""
        return "" if self._goals is None else self._goals.given_up

    @property
    def recoveries(self) -> int:
        """Number of recovery behaviours that the action has begun."""
        return 0 if self._goals is None else self._goals.recoveries

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

    def _collect(self, command: Command[Any], value: Any) -> bool:
        """Takes a command of the robot; returns False for others. Called in any thread."""
        if command.topic != self._drive_topic:
            return False
        with self._commands:
            self._count += 1
            self._latest = value
            self._commands.notify()
        return True

    # -- transforms ------------------------------------------------------------------------

    @property
    def wants_transforms(self) -> bool:
        """Returns True: the localisation is measured by them."""
        return True

    def transforms_sent(self, transforms: Sequence[Transform]) -> None:
        """Sends the true transform from the map to the frame of the odometry."""
        self._transforms.add(transforms)
        if self._stage is None or self._options.localization != "true":
            return
        pose = self._stage.robot.pose
        for sent in transforms:
            if sent.child == self._base_frame and sent.parent != WORLD_FRAME:
                origin = compose(pose, invert((sent.x, sent.y, sent.yaw)))
                localized = Transforms((Transform(sent.stamp, WORLD_FRAME, sent.parent, *origin),))
                self._transforms.add(localized)
                self._tf.publish(self._convert(localized))

    @property
    def kept(self) -> float:
        """Simulated time for which positions are known [s]."""
        return self._transforms.kept

    def position(self, stamp: int) -> tuple[float, float] | None:
        """Returns the position of the robot in the map by transforms [m]; None if it is not known.

        Args:
            stamp: Simulated time of the run [ns].
        """
        return self._transforms.position(self._base_frame, message_stamp(stamp))


class _CollectingBridge(Bridge):
    """A bridge whose commands may be taken by a function."""

    def __init__(
        self,
        transport: Transport,
        clock: NodeClock,
        collect: Callable[[Command[Any], Any], bool],
    ) -> None:
        super().__init__(transport, clock)
        self._collect = collect

    def command_received(self, command: Command[Any], value: Any) -> None:
        """Passes a command to the function, or else to the world."""
        if not self._collect(command, value):
            super().command_received(command, value)
