"""A node that connects to a simulator: python connector.py model.yaml robot...

Prints the time from the creation of a publisher of `cmd_vel`, of a subscriber to `scan`, to its
connection, for each robot, and the time of as many calls of /spawn_model until the topics of the
new model are registered [s]: `publisher 0.01 0.02`, `subscriber ...`, `spawn ...`.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import rosgraph
import rospy
from geometry_msgs.msg import Pose2D, Twist
from sensor_msgs.msg import LaserScan

from flatland.srv import SpawnModel

TIMEOUT = 30.0  # s


def wait_until(condition: Callable[[], object]) -> float:
    """Returns the time until a condition holds [s]."""
    start = time.perf_counter()
    while not condition():
        if time.perf_counter() - start > TIMEOUT:
            raise RuntimeError(f"not connected within {TIMEOUT:g} s")
        time.sleep(0.001)
    return time.perf_counter() - start


def publish(robot: str) -> float:
    """Returns the time that a publisher takes to connect [s]."""
    start = time.perf_counter()
    publisher = rospy.Publisher(f"/{robot}/cmd_vel", Twist, queue_size=1)
    wait_until(publisher.get_num_connections)
    return time.perf_counter() - start


def subscribe(robot: str) -> float:
    """Returns the time that a subscriber takes to connect [s]."""
    start = time.perf_counter()
    subscriber = rospy.Subscriber(f"/{robot}/scan", LaserScan)
    wait_until(subscriber.get_num_connections)
    elapsed = time.perf_counter() - start
    subscriber.unregister()
    return elapsed


def spawn(path: str, name: str) -> float:
    """Returns the time until a new model and its topics are there [s]."""
    master = rosgraph.Master("/bench_connector")
    start = time.perf_counter()
    answer = rospy.ServiceProxy("/spawn_model", SpawnModel)(path, name, name, Pose2D())
    if not answer.success:
        raise RuntimeError(answer.message)
    wait_until(lambda: f"/{name}/scan" in dict(master.getPublishedTopics("")))
    return time.perf_counter() - start


def main() -> None:
    """Measures and prints."""
    path, *robots = sys.argv[1:]
    rospy.init_node("bench_connector", disable_signals=True, disable_rostime=True)
    rospy.wait_for_service("/toggle_pause", TIMEOUT)
    time.sleep(2.0)  # until the simulator has settled
    for name, times in (
        ("publisher", [publish(robot) for robot in robots]),
        ("subscriber", [subscribe(robot) for robot in robots]),
        ("spawn", [spawn(path, f"new_{robot}") for robot in robots]),
    ):
        print(name, *times, flush=True)
    rospy.signal_shutdown("done")


if __name__ == "__main__":
    main()
