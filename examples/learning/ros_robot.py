"""The robot of the environment, driven over ROS in lockstep."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
import rospy
from geometry_msgs.msg import Pose2D, Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan

from flatland.geometry import wrap_angle
from flatland.gym import Agent, Settings, Situation
from flatland.srv import MoveModel, StepWorld

TIMEOUT = 20.0  # s
SCAN, ODOMETRY = "scan", "odometry/ground_truth"

CONTACT_RANGE = 0.215  # m: the radius of the robot, and what the physics leaves between shapes


class RosRobot:
    """Observes by `/scan` and `/odometry/ground_truth`, acts by `/cmd_vel`.

    The simulator runs in lockstep: time passes only by the service `step_world`. A scan and the
    odometry of each step are therefore those of its end, as in the environment.
    """

    def __init__(self, settings: Settings, agent: Agent) -> None:
        """Connects to the simulator.

        Args:
            settings: The environment in which the policy was trained.
            agent: The robot in that environment, for the constants of its laser and its drive.

        Raises:
            RuntimeError: The simulator does not answer.
        """
        self._settings = settings
        self._name = agent.model.name
        low, high = settings.action.bounds(agent)
        beams = agent.laser.angles.count
        self._situation = Situation(1, beams, agent.laser.range, low, high)
        self._layout = settings.observation.layout(beams)
        self._changed = threading.Condition()
        self._messages: dict[str, Any] = {}
        self._step_world = self._service("step_world", StepWorld)
        self._move_model = self._service("move_model", MoveModel)
        self._command = rospy.Publisher("cmd_vel", Twist, queue_size=1, tcp_nodelay=True)
        subscribers = [
            rospy.Subscriber(topic, kind, self._receive, topic, tcp_nodelay=True)
            for topic, kind in ((SCAN, LaserScan), (ODOMETRY, Odometry))
        ]
        self._wait_for_connections([self._command, *subscribers])

    def reset(self, start: Sequence[float], goal: Sequence[float]) -> Any:
        """Places the robot at rest.

        Args:
            start: Pose in the world frame [m, rad].
            goal: Place in the world frame [m].

        Returns:
            The first observation.

        Raises:
            RuntimeError: The simulator refuses the pose, or does not answer.
        """
        self._send(0.0, 0.0)
        self._advance(4)  # The drive brakes; otherwise it would continue after the move.
        answer = self._move_model(self._name, Pose2D(*start))
        if not answer.success:
            raise RuntimeError(answer.message)
        self._advance(1)
        self._situation.goals[0] = goal
        return self._observe()

    def step(self, action: Sequence[float]) -> tuple[Any, bool, bool]:
        """Carries out an action.

        Args:
            action: Forward speed and yaw rate, each from -1 to 1.

        Returns:
            Observation, whether the goal is reached, whether the robot touched something.

        Raises:
            RuntimeError: The simulator does not answer.
        """
        s = self._situation
        bounded = np.clip(np.asarray(action, np.float64), -1.0, 1.0)
        self._send(*(s.low + (bounded + 1.0) * (0.5 * (s.high - s.low))).tolist())
        self._advance(1)
        observation = self._observe()
        touched = bool(np.nanmin(s.ranges) <= CONTACT_RANGE)
        return observation, bool(s.arrived[0]), touched

    def _send(self, v: float, omega: float) -> None:
        message = Twist()
        message.linear.x, message.angular.z = v, omega
        self._command.publish(message)

    def _advance(self, steps: int) -> None:
        """Steps the world and waits for the scan and the odometry of the end."""
        answer = self._step_world(steps * self._settings.dt)
        if not answer.success:
            raise RuntimeError(answer.message)

        def are_here() -> bool:
            return all(
                topic in self._messages and self._messages[topic].header.stamp >= answer.stamp
                for topic in (SCAN, ODOMETRY)
            )

        with self._changed:
            if not self._changed.wait_for(are_here, TIMEOUT):
                raise RuntimeError(f"no messages of the time {answer.stamp.to_sec():.3f}")

    def _observe(self) -> Any:
        s = self._situation
        scan, odometry = self._messages[SCAN], self._messages[ODOMETRY]
        s.ranges[0] = scan.ranges
        position, orientation = odometry.pose.pose.position, odometry.pose.pose.orientation
        theta = 2.0 * math.atan2(orientation.z, orientation.w)
        s.poses[0] = position.x, position.y, wrap_angle(theta)
        v, omega = odometry.twist.twist.linear.x, odometry.twist.twist.angular.z
        # The odometry has the velocity in the frame of the robot.
        s.velocities[0] = v * math.cos(theta), v * math.sin(theta), omega
        s.locate(self._settings.task.goal_radius)
        numbers = np.zeros((1, self._layout.size), np.float32)
        self._layout.write(s, numbers)
        return self._layout.present(numbers[0])

    def _receive(self, message: Any, topic: str) -> None:
        with self._changed:
            self._messages[topic] = message
            self._changed.notify_all()

    def _service(self, name: str, kind: Any) -> Any:
        try:
            rospy.wait_for_service(name, TIMEOUT)
        except rospy.ROSException as error:
            raise RuntimeError(f"the simulator has no service {name}: {error}") from error
        return rospy.ServiceProxy(name, kind, persistent=True)

    @staticmethod
    def _wait_for_connections(topics: Sequence[Any]) -> None:
        end = time.monotonic() + TIMEOUT
        while not all(topic.get_num_connections() for topic in topics):
            if time.monotonic() > end:
                raise RuntimeError(f"no connection to the simulator within {TIMEOUT:g} s")
            time.sleep(0.01)
