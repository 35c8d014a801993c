"""Drives the robot of the office with ROS 2, away from walls: drive.py [SECONDS].

Uses the topics /scan, /odometry/filtered and /cmd_vel of a running simulator.
"""

from __future__ import annotations

import contextlib
import math
import sys

import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import LaserScan

SPEED = 0.5  # m/s
TURN = 0.8  # rad/s
NEAR = 1.0  # m
HALF_WIDTH = 0.6  # rad; of the sector in front of the robot


class Driver(Node):
    """Drives straight on, and turns to the freer side in front of a wall."""

    def __init__(self, duration: float) -> None:
        super().__init__("driver")
        self.done = False
        self._duration = duration
        self._start: float | None = None
        self._commands = self.create_publisher(Twist, "cmd_vel", 10)
        self.create_subscription(LaserScan, "scan", self.drive, qos_profile_sensor_data)
        self.create_subscription(Odometry, "odometry/filtered", self.report, 10)

    def drive(self, scan: LaserScan) -> None:
        """Sends a command for each scan."""
        beams = [
            (scan.angle_min + number * scan.angle_increment, distance)
            for number, distance in enumerate(scan.ranges)
            if math.isfinite(distance)
        ]
        left = min((d for angle, d in beams if 0 <= angle < HALF_WIDTH), default=math.inf)
        right = min((d for angle, d in beams if -HALF_WIDTH < angle < 0), default=math.inf)
        command = Twist()
        if min(left, right) > NEAR:
            command.linear.x = SPEED
        else:
            command.angular.z = TURN if left > right else -TURN
        self._commands.publish(command)

    def report(self, odometry: Odometry) -> None:
        """Prints the position once per second of simulated time."""
        now = odometry.header.stamp.sec + odometry.header.stamp.nanosec * 1e-9
        if self._start is None:
            self._start = now
        if odometry.header.stamp.nanosec == 0:
            position = odometry.pose.pose.position
            print(f"{now:6.0f} s: at ({position.x:.2f}, {position.y:.2f})", flush=True)
        if now - self._start >= self._duration:
            self._commands.publish(Twist())
            self.done = True


def main() -> None:
    """Drives for a simulated time, by default 20 s."""
    rclpy.init()
    driver = Driver(float(sys.argv[1]) if len(sys.argv) > 1 else 20.0)
    # Ctrl-C and SIGTERM end the program.
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        while not driver.done:
            rclpy.spin_once(driver)
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
