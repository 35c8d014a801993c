"""The connection of a run to ROS 1, with a master of its own; requires rospy."""

from __future__ import annotations

import os
import threading
from typing import TYPE_CHECKING, Any, Final

from flatland.ros.logs import log_without_file
from flatland.ros.transport import inbound
from flatland.ros.transport.registrar import Registrar
from flatland.ros.transport.ros_transport import RosTransport
from flatland.scenarios.connection import StackError, set_goal

if TYPE_CHECKING:
    from flatland.geometry import Pose
    from flatland.node.transport import Transport
    from flatland.scenarios.stack_options import StackOptions

_NODE: Final = "flatland_server"
_CLOSE_TIMEOUT: Final = 2.0  # s
_UNSUCCESSFUL: Final = {2: "preempted", 4: "aborted", 5: "rejected", 8: "recalled"}
"""Final states of actionlib_msgs/GoalStatus without success."""


class Ros1:
    """A ROS master in a thread, and the node of this process."""

    goal_topic = "move_base_simple/goal"

    def __init__(self, options: StackOptions) -> None:
        """Starts the master on a free port; rospy can be initialized once per process.

        Args:
            options: Types of messages.

        Raises:
            StackError: The options require ROS 2.
        """
        if options.stamped_commands:
            raise StackError("--stamped-commands requires nodes of ROS 2")
        self.environment = {"ROS_HOSTNAME": "localhost"}
        os.environ.update(self.environment)
        os.environ.pop("ROS_IP", None)
        os.environ.pop("ROS_NAMESPACE", None)
        import rospy
        from rosmaster.master import Master

        master = Master(0)
        master.start()
        self.environment["ROS_MASTER_URI"] = os.environ["ROS_MASTER_URI"] = master.uri
        inbound.install()
        log_without_file()
        rospy.init_node(_NODE, argv=[], disable_signals=True, disable_rostime=True)
        rospy.set_param("/use_sim_time", True)
        self._registrar = Registrar()
        self.transport: Transport = RosTransport(self._registrar)

    def action(self, name: str) -> _ActionGoals:
        """Returns what sends goals to an action of the type `move_base_msgs/MoveBaseAction`."""
        return _ActionGoals(self.transport, name)

    def publishers(self, topic: str) -> str:  # noqa: ARG002
        """Returns an empty text: publishers of another type are errors of ROS."""
        return ""

    def close(self) -> None:
        """Ends the topics. The master and rospy end with the process."""
        self._registrar.close(_CLOSE_TIMEOUT)


class _ActionGoals:
    """Sends goals to an action, which consists of topics."""

    def __init__(self, transport: Transport, name: str) -> None:
        self._name = name
        self._message_class = transport.message_class("move_base_msgs/MoveBaseActionGoal")
        self._goals = transport.advertise(f"{name}/goal", self._message_class, queue_size=10)
        self._has_status = threading.Event()
        self._number = self.recoveries = 0
        self.given_up = ""
        for topic, kind, receive in (
            ("status", "actionlib_msgs/GoalStatusArray", self._receive_status),
            ("recovery_status", "move_base_msgs/RecoveryStatus", self._receive_recovery),
        ):
            transport.subscribe(f"{name}/{topic}", transport.message_class(kind), receive)

    @property
    def missing(self) -> str:
        if not self._goals.connected:
            return f"no node subscribes to {self._goals.topic}"
        return "" if self._has_status.is_set() else f"the action {self._name} is not available"

    @property
    def _goal_id(self) -> str:
        return f"flatland-{self._number}"

    def send(self, goal: Pose) -> None:
        self._number += 1
        self.given_up = ""
        message: Any = self._message_class()
        message.goal_id.id = self._goal_id
        set_goal(message.goal.target_pose, goal)
        self._goals.publish(message)

    def _receive_status(self, message: Any) -> None:
        """Receives the states of all goals of the action; called in any thread."""
        self._has_status.set()
        for one in message.status_list:
            if one.goal_id.id == self._goal_id and one.status in _UNSUCCESSFUL:
                reason = f"{self._name} {_UNSUCCESSFUL[one.status]} the goal"
                self.given_up = f"{reason}: {one.text}" if one.text else reason

    def _receive_recovery(self, _message: Any) -> None:
        """Counts a recovery behaviour; called in the thread of the connection."""
        self.recoveries += 1
