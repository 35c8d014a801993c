"""Measures how fast a node connects to a simulator: python connector.py model.yaml robot...

For each robot, measures the time in which a publisher of `cmd_vel` and a subscriber to `scan`
connect, and the time from a call of /spawn_model until the topics of the new model are registered.
Prints one line of times [s] for each: `publisher 0.01 0.02`, `subscriber ...`, `spawn ...`.
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
    """Waits until a condition holds and returns the waiting time [s].

    Raises:
        RuntimeError: The condition does not hold within `TIMEOUT`.
    """
    start = time.perf_counter()
    while not condition():
        if time.perf_counter() - start > TIMEOUT:
            raise RuntimeError(f"not connected within {TIMEOUT:g} s")
        time.sleep(0.001)
    return time.perf_counter() - start


def publish(robot: str) -> float:
    """Returns the time in which a publisher connects [s]."""
    start = time.perf_counter()
    publisher = rospy.Publisher(f"/{robot}/cmd_vel", Twist, queue_size=1)
    wait_until(publisher.get_num_connections)
    return time.perf_counter() - start


def subscribe(robot: str) -> float:
    """Returns the time in which a subscriber connects [s]."""
    start = time.perf_counter()
    subscriber = rospy.Subscriber(f"/{robot}/scan", LaserScan)
    wait_until(subscriber.get_num_connections)
    elapsed = time.perf_counter() - start
    subscriber.unregister()
    return elapsed


def spawn(path: str, name: str) -> float:
    """Returns the time from the call to the registration of the topics of the model [s]."""
    master = rosgraph.Master("/bench_connector")
    start = time.perf_counter()
    response = rospy.ServiceProxy("/spawn_model", SpawnModel)(path, name, name, Pose2D())
    if not response.success:
        raise RuntimeError(response.message)
    wait_until(lambda: f"/{name}/scan" in dict(master.getPublishedTopics("")))
    return time.perf_counter() - start


def main() -> None:
    """Measures all times and prints them."""
    path, *robots = sys.argv[1:]
    rospy.init_node("bench_connector", disable_signals=True, disable_rostime=True)
    rospy.wait_for_service("/toggle_pause", TIMEOUT)
    time.sleep(2.0)  # until the start of the simulator is complete
    for name, times in (
        ("publisher", [publish(robot) for robot in robots]),
        ("subscriber", [subscribe(robot) for robot in robots]),
        ("spawn", [spawn(path, f"new_{robot}") for robot in robots]),
    ):
        print(name, *times, flush=True)
    rospy.signal_shutdown("done")


if __name__ == "__main__":
    main()
