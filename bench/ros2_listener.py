"""A node of ROS 2 that subscribes: python ros2_listener.py [--drive TOPIC] topic:package/Type...

With --drive, it publishes a velocity command 20 times a second, so that a robot drives in a circle.

Prints `ready` after all subscriptions, then the arrival time of the first message of each topic on
the monotonic clock [s], `running` with that of the first /clock after 0. At SIGINT, it prints the
number of messages of each topic, and for scans

- `latency`: the median and the 95th percentile of the time from their stamps, if these are wall
  times, to their arrival [s], and their number,
- `speed`: the time between the first and the last stamp, relative to that of their arrivals.
"""

from __future__ import annotations

import importlib
import signal
import sys
import threading
import time
from collections import Counter
from typing import Any

import numpy as np
import rclpy
from geometry_msgs.msg import Twist
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

QUALITY = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
DRIVE_PERIOD = 0.05  # s
NANOSECONDS = 1_000_000_000

counts: Counter[str] = Counter()
scans: list[tuple[int, int]] = []  # stamp and arrival in wall time [ns]


def receive(message: Any, topic: str) -> None:
    """Counts a message of a topic, and prints the arrival time of the first one."""
    now = time.time_ns()
    if not counts[topic]:
        print(f"first {topic} {time.monotonic()}", flush=True)
    counts[topic] += 1
    if topic == "/clock":
        if not counts["running"] and (message.clock.sec or message.clock.nanosec):
            counts["running"] = 1
            print(f"running {time.monotonic()}", flush=True)
    elif hasattr(message, "ranges"):
        stamp = message.header.stamp
        scans.append((stamp.sec * NANOSECONDS + stamp.nanosec, now))


def subscribe(node: Any, topic: str, name: str) -> None:
    """Subscribes to a topic with a type `package/Name`."""
    package, _, kind = name.partition("/")
    message_type = getattr(importlib.import_module(f"{package}.msg"), kind)
    node.create_subscription(message_type, topic, lambda message: receive(message, topic), QUALITY)


def main() -> None:
    """Counts messages until SIGINT."""
    stopped = threading.Event()
    signal.signal(signal.SIGINT, lambda *_: stopped.set())
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("bench_listener")
    arguments = sys.argv[1:]
    period = None
    if arguments[0] == "--drive":
        driver = node.create_publisher(Twist, arguments[1], 1)
        command = Twist()
        command.linear.x, command.angular.z = 0.5, 1.0
        period, arguments = DRIVE_PERIOD, arguments[2:]
    for argument in arguments:
        subscribe(node, *argument.split(":"))
    executor = EventsExecutor()
    executor.add_node(node)
    end = Future(executor=executor)

    def spin() -> None:
        executor.spin_until_future_complete(end, 3600.0)

    thread = threading.Thread(target=spin)
    thread.start()
    print("ready", flush=True)
    while not stopped.wait(period):
        driver.publish(command)
    end.set_result(None)
    executor.wake()
    thread.join()
    print(f"counts {dict(counts)}", flush=True)
    if len(scans) > 1:
        stamps, arrivals = np.array(scans).T
        p50, p95 = np.percentile(arrivals - stamps, (50, 95)) / NANOSECONDS
        print(f"latency {p50} {p95} {len(scans)}", flush=True)
        speed = (stamps[-1] - stamps[0]) / (arrivals[-1] - arrivals[0])
        print(f"speed {speed}", flush=True)
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
