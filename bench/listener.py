"""A node that subscribes to topics: python listener.py [--drive TOPIC] topic:package/Type...

With --drive, it publishes a velocity command, so that a robot drives in a circle, and prints
`driving` as soon as the robot is connected.

Prints `ready` after all subscriptions, then the arrival time of the first message of each topic on
the monotonic clock [s], `running` with that of the first /clock after 0, and at exit the number of
messages of each topic.
"""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections import Counter
from typing import Any

import roslib.message
import rospy
from geometry_msgs.msg import Twist, Vector3

CIRCLE = Twist(Vector3(0.5, 0.0, 0.0), Vector3(0.0, 0.0, 1.0))  # m/s and rad/s

counts: Counter[str] = Counter()


def count_message(message: Any, topic: str) -> None:
    """Counts a message of a topic, and prints the arrival time of the first one."""
    if not counts[topic]:
        print(f"first {topic} {time.monotonic()}", flush=True)
    counts[topic] += 1
    if topic == "/clock" and message.clock.to_nsec() > 0 and not counts["running"]:
        counts["running"] = 1
        print(f"running {time.monotonic()}", flush=True)


def report_connection(publisher: rospy.Publisher) -> None:
    """Prints a line when a publisher has a subscriber."""
    while not publisher.get_num_connections():
        time.sleep(0.05)
    print("driving", flush=True)


def main() -> None:
    """Counts messages until SIGINT."""
    stopped = threading.Event()
    rospy.init_node("bench_listener", anonymous=True, disable_signals=True, disable_rostime=True)
    signal.signal(signal.SIGINT, lambda *_: stopped.set())
    arguments = sys.argv[1:]
    if arguments[0] == "--drive":
        driver = rospy.Publisher(arguments[1], Twist, queue_size=1, latch=True)
        driver.publish(CIRCLE)
        threading.Thread(target=report_connection, args=(driver,), daemon=True).start()
        arguments = arguments[2:]
    for argument in arguments:
        topic, message_type = argument.split(":")
        rospy.Subscriber(
            topic, roslib.message.get_message_class(message_type), count_message, topic
        )
    print("ready", flush=True)
    stopped.wait()
    print(f"counts {dict(counts)}", flush=True)
    rospy.signal_shutdown("done")


if __name__ == "__main__":
    main()
