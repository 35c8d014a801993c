"""The connection of a run to ROS 1, with a master of its own; requires rospy."""

from __future__ import annotations

import os
import threading
from typing import TYPE_CHECKING, Any, Final

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

        self._master = Master(0)
        self._master.start()
        self.environment["ROS_MASTER_URI"] = os.environ["ROS_MASTER_URI"] = self._master.uri
        inbound.install()
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
        """Ends the node and the master."""
        import rospy

        self._registrar.close(_CLOSE_TIMEOUT)
        ending = threading.Thread(target=rospy.signal_shutdown, args=("end of run",), daemon=True)
        ending.start()
        ending.join(_CLOSE_TIMEOUT)
        self._master.stop()


class _ActionGoals:
    """Sends goals to an action, which consists of topics."""

    def __init__(self, transport: Transport, name: str) -> None:
        self._name = name
        self._message_class = transport.message_class("move_base_msgs/MoveBaseActionGoal")
        self._goals = transport.advertise(f"{name}/goal", self._message_class, queue_size=10)
        self._has_status = threading.Event()
        self._number = 0
        transport.subscribe(
            f"{name}/status",
            transport.message_class("actionlib_msgs/GoalStatusArray"),
            lambda _message: self._has_status.set(),
        )

    @property
    def missing(self) -> str:
        if not self._goals.connected:
            return f"no node subscribes to {self._goals.topic}"
        return "" if self._has_status.is_set() else f"the action {self._name} is not available"

    def send(self, goal: Pose) -> None:
        self._number += 1
        message: Any = self._message_class()
        message.goal_id.id = f"flatland-{self._number}"
        set_goal(message.goal.target_pose, goal)
        self._goals.publish(message)
