"""The connection of a run to ROS 2, in a domain of its own; requires rclpy."""

from __future__ import annotations

import os
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any, Final

import rclpy
from rclpy.action import ActionClient
from rclpy.signals import SignalHandlerOptions

from flatland.ros2.adapters import use_stamped_twists
from flatland.ros2.domain import reserved_domain
from flatland.ros2.executor import ExecutorThread
from flatland.ros2.node import NODE_NAME
from flatland.ros2.parameters import USE_SIM_TIME, DeclaredParameters
from flatland.ros2.transport import Ros2Transport
from flatland.scenarios.connection import StackError, set_goal

if TYPE_CHECKING:
    from rclpy.node import Node

    from flatland.geometry import Pose
    from flatland.node.transport import Transport
    from flatland.scenarios.stack_options import StackOptions

# Variables that connect nodes in other ways than by their domain on this machine.
_OTHER_CONNECTIONS: Final = ("ROS_LOCALHOST_ONLY", "ROS_STATIC_PEERS", "ROS_DISCOVERY_SERVER")

_UNSUCCESSFUL: Final = {5: "canceled", 6: "aborted"}
"""Final states of action_msgs/GoalStatus without success."""


class Ros2:
    """A domain of ROS 2, and the node of this process."""

    goal_topic = "goal_pose"

    def __init__(self, options: StackOptions) -> None:
        """Starts the node.

        Args:
            options: Types of messages.

        Raises:
            FlatlandError: All domains are in use.
        """
        with ExitStack() as ending:
            self.environment = {
                "ROS_DOMAIN_ID": str(ending.enter_context(reserved_domain())),
                "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            }
            for name in _OTHER_CONNECTIONS:
                os.environ.pop(name, None)
            os.environ.update(self.environment)
            rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
            ending.callback(rclpy.try_shutdown)
            self._node = rclpy.create_node(NODE_NAME)
            ending.callback(self._node.destroy_node)
            # The node sets its time itself, instead of subscribing to its own /clock.
            self._node._time_source.detach_node()
            parameters = DeclaredParameters(self._node)
            parameters.set(USE_SIM_TIME, True)
            if options.stamped_commands:
                use_stamped_twists()
            self.transport: Transport = Ros2Transport(
                self._node, parameters, reliable_sensors=True, is_stopping=lambda: False
            )
            ending.callback(ExecutorThread(self._node).close)
            self._ending = ending.pop_all()

    def action(self, name: str) -> _ActionGoals:
        """Returns what sends goals to an action of the type `nav2_msgs/NavigateToPose`.

        Raises:
            StackError: nav2_msgs is not installed.
        """
        return _ActionGoals(self._node, name)

    def publishers(self, topic: str) -> str:
        """Describes publishers of a topic that do not match the subscription; empty for none."""
        found = self._node.get_publishers_info_by_topic(topic)
        kinds = {f"{each.topic_type}, {each.qos_profile.reliability.name}" for each in found}
        if not kinds:
            return ""
        return f" with matching type and reliability, there is: {'; '.join(sorted(kinds))}"

    def close(self) -> None:
        """Ends the node, and gives the domain back."""
        self._ending.close()


class _ActionGoals:
    """Sends goals to an action."""

    def __init__(self, node: Node, name: str) -> None:
        try:
            from nav2_msgs.action import NavigateToPose
        except ImportError as error:
            raise StackError(f"--goal-action requires the package nav2_msgs: {error}") from error
        self._name = name
        self.given_up = ""
        self._recoveries: dict[int, int] = {}  # by the number of the goal
        self._number = 0
        self._type: Any = NavigateToPose
        self._client: Any = ActionClient(node, NavigateToPose, name)

    @property
    def missing(self) -> str:
        is_ready = self._client.server_is_ready()
        return "" if is_ready else f"the action {self._name} is not available"

    @property
    def recoveries(self) -> int:
        return sum(self._recoveries.values())

    def send(self, goal: Pose) -> None:
        self._number += 1
        number = self._number
        self.given_up = ""
        message = self._type.Goal()
        set_goal(message.pose, goal)

        # The functions are called in the thread of the executor.
        def receive_feedback(message: Any) -> None:
            self._recoveries[number] = message.feedback.number_of_recoveries

        def receive_response(future: Any) -> None:
            handle = future.result()
            if handle.accepted:
                handle.get_result_async().add_done_callback(receive_result)
            else:
                self._give_up(number, "rejected")

        def receive_result(future: Any) -> None:
            found = future.result()
            if found.status in _UNSUCCESSFUL:
                text = getattr(found.result, "error_msg", "")  # not in all distributions
                self._give_up(number, _UNSUCCESSFUL[found.status], text)

        sent = self._client.send_goal_async(message, feedback_callback=receive_feedback)
        sent.add_done_callback(receive_response)

    def _give_up(self, number: int, verb: str, text: str = "") -> None:
        if number == self._number:
            reason = f"{self._name} {verb} the goal"
            self.given_up = f"{reason}: {text}" if text else reason
