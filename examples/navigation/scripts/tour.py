#!/usr/bin/env python3
"""Sends a tour of goals to move_base and reports times and errors.

The true pose of the robot is that of the simulator (topic of the ground truth), in the same frame
as the goals. The localisation is the transform from this frame to the frame of the robot, at the
stamp of the true pose. All times are in simulated time. The exit code is 0 if all goals were
reached.
"""

from __future__ import annotations

import argparse
import math
import sys
import threading
import time
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import actionlib
import rosgraph
import rospy
import tf2_ros
import yaml
from actionlib_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from nav_msgs.msg import Odometry

_RESULTS = {
    GoalStatus.SUCCEEDED: "reached",
    GoalStatus.ABORTED: "aborted",
    GoalStatus.PREEMPTED: "preempted",
    GoalStatus.REJECTED: "rejected",
    GoalStatus.RECALLED: "recalled",
    GoalStatus.LOST: "lost",
}
_SAMPLE_PERIOD = 0.1  # between two comparisons of the localisation with the truth [s]
_TF_DELAY = 0.5  # until the transform of a stamp has been received [s]
_POLL_PERIOD = 0.05  # of wall time [s]

Pose = tuple[float, float, float]  # x, y [m], yaw [rad]


class TourError(Exception):
    """A tour that is invalid or cannot be driven."""


@dataclass
class Errors:
    """Distances and angles between pairs of poses."""

    distances: list[float] = field(default_factory=list)  # [m]
    angles: list[float] = field(default_factory=list)  # [rad], not negative

    def add(self, a: Pose, b: Pose) -> None:
        """Adds the distance between two poses."""
        self.distances.append(math.hypot(a[0] - b[0], a[1] - b[1]))
        self.angles.append(abs(math.remainder(a[2] - b[2], math.tau)))


@dataclass
class Leg:
    """The way to one goal."""

    name: str
    result: str
    duration: float  # [s]
    path: float  # true length of the path [m]
    final: Errors  # true pose against the goal, at the end
    localization: Errors  # localisation against the true pose, on the way

    @property
    def reached(self) -> bool:
        """Whether move_base reported success."""
        return self.result == _RESULTS[GoalStatus.SUCCEEDED]


def yaw_of(rotation: Any) -> float:
    """Returns the rotation about z of a quaternion [rad]."""
    x, y, z, w = rotation.x, rotation.y, rotation.z, rotation.w
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def read_tour(path: Path) -> list[tuple[str, Pose]]:
    """Reads the names and poses of the goals of a tour.

    Raises:
        TourError: The file does not exist or is not a tour.
    """
    expected = f"{path}: expected goals: [{{name: NAME, pose: [x, y, yaw]}}, ...]"
    try:
        goals = yaml.safe_load(path.read_text(encoding="utf-8"))["goals"]
        tour = []
        for number, goal in enumerate(goals, start=1):
            x, y, yaw = (float(value) for value in goal["pose"])
            if not all(map(math.isfinite, (x, y, yaw))):
                raise TourError(f"{path}: goal {number} is not finite: {goal['pose']}")
            tour.append((str(goal.get("name", f"goal {number}")), (x, y, yaw)))
    except OSError as error:
        raise TourError(f"{path}: {error.strerror}") from error
    except (yaml.YAMLError, KeyError, TypeError, ValueError, AttributeError) as error:
        raise TourError(f"{expected}; {type(error).__name__}: {error}") from error
    if not tour:
        raise TourError(expected)
    return tour


class Truth:
    """The true pose, and the error of the localisation since `start`."""

    def __init__(self, topic: str, frame: str, base_frame: str) -> None:
        self._frame = frame
        self._base_frame = base_frame
        self._buffer = tf2_ros.Buffer(rospy.Duration(30))
        self._listener = tf2_ros.TransformListener(self._buffer)
        self._lock = threading.Lock()
        self._waiting: deque[tuple[rospy.Time, Pose]] = deque()
        self._next_sample = rospy.Time()
        self._last: Pose | None = None
        self._stamp = rospy.Time()
        self._path = 0.0
        self._errors = Errors()
        self._subscriber = rospy.Subscriber(topic, Odometry, self._receive, queue_size=100)

    @property
    def received(self) -> bool:
        """Whether there is a true pose."""
        return self._last is not None

    def start(self) -> None:
        """Discards the path and the errors so far."""
        with self._lock:
            self._path = 0.0
            self._errors = Errors()
            self._waiting.clear()

    def stop(self) -> tuple[Pose, float, Errors]:
        """Waits for a true pose that is not older than now.

        Returns:
            The pose, and the length of the path and the errors since `start`.
        """
        now = rospy.Time.now()
        wait("true pose", lambda: self._stamp >= now, math.inf)
        with self._lock:
            if self._last is None:
                raise TourError("no true pose")
            return self._last, self._path, self._errors

    def localized(self) -> bool:
        """Returns whether there is a path of transforms to the frame of the robot."""
        return bool(self._buffer.can_transform(self._frame, self._base_frame, rospy.Time()))

    def _receive(self, message: Odometry) -> None:
        position = message.pose.pose.position
        pose = (position.x, position.y, yaw_of(message.pose.pose.orientation))
        stamp = message.header.stamp
        with self._lock:
            if self._last is not None:
                self._path += math.hypot(pose[0] - self._last[0], pose[1] - self._last[1])
            self._last = pose
            self._stamp = stamp
            if stamp >= self._next_sample:
                self._next_sample = stamp + rospy.Duration(_SAMPLE_PERIOD)
                self._waiting.append((stamp, pose))
            while self._waiting and stamp - self._waiting[0][0] > rospy.Duration(_TF_DELAY):
                self._compare(*self._waiting.popleft())

    def _compare(self, stamp: rospy.Time, pose: Pose) -> None:
        try:
            found = self._buffer.lookup_transform(self._frame, self._base_frame, stamp).transform
        except tf2_ros.TransformException:
            return  # not localised at this time
        self._errors.add((found.translation.x, found.translation.y, yaw_of(found.rotation)), pose)


def wait(what: str, condition: Any, timeout: float) -> None:
    """Waits in wall time, because simulated time may not have started.

    Raises:
        TourError: The condition does not hold within the time limit.
    """
    end = time.monotonic() + timeout
    while not condition():
        if rospy.core.is_shutdown_requested():
            raise TourError("interrupted")
        if time.monotonic() > end:
            raise TourError(f"{what}: not within {timeout:g} s")
        time.sleep(_POLL_PERIOD)


def is_published(topic: str) -> bool:
    """Returns whether a node publishes a topic."""
    try:
        published, _, _ = rosgraph.Master("/tour").getSystemState()
    except (OSError, rosgraph.MasterException):
        return False
    return any(name == topic for name, _ in published)


def drive_to(
    client: actionlib.SimpleActionClient, frame: str, goal: Pose, timeout: float
) -> tuple[str, float]:
    """Drives to a goal and returns the result and the duration [s]."""
    pose = PoseStamped()
    pose.header.frame_id = frame
    pose.header.stamp = start = rospy.Time.now()
    pose.pose.position.x, pose.pose.position.y = goal[:2]
    pose.pose.orientation.z = math.sin(goal[2] / 2)
    pose.pose.orientation.w = math.cos(goal[2] / 2)
    done = threading.Event()
    client.send_goal(MoveBaseGoal(pose), done_cb=lambda *_: done.set())
    result = ""
    while not done.wait(_POLL_PERIOD):
        if rospy.is_shutdown():
            raise TourError("interrupted")
        if rospy.Time.now() - start > rospy.Duration(timeout):
            client.cancel_goal()
            result = "timeout"
            break
    duration = (rospy.Time.now() - start).to_sec()
    return result or _RESULTS.get(client.get_state(), "failed"), duration


def report(legs: list[Leg]) -> str:
    """Returns the table of all legs and the summary."""
    width = max(4, *(len(leg.name) for leg in legs))
    lines = [
        f"{'':{width}}  {'':9} {'time':>7} {'path':>7}  {'off the goal':^14}  "
        f"{'localisation error: mean, maximum':^33}",
        f"{'goal':{width}}  {'result':9} {'[s]':>7} {'[m]':>7}  {'[m]':>6} {'[deg]':>7}  "
        f"{'[m]':>8} {'[m]':>7} {'[deg]':>8} {'[deg]':>7}",
    ]
    lines += [
        f"{leg.name:{width}}  {leg.result:9} {leg.duration:7.1f} {leg.path:7.1f}  "
        f"{leg.final.distances[0]:6.3f} {math.degrees(leg.final.angles[0]):7.1f}  "
        f"{_localization(leg.localization)}"
        for leg in legs
    ]
    whole = Errors()
    for leg in legs:
        whole.distances += leg.localization.distances
        whole.angles += leg.localization.angles
    reached = sum(leg.reached for leg in legs)
    lines.append(
        f"{'all':{width}}  {f'{reached} of {len(legs)}':9} {sum(x.duration for x in legs):7.1f} "
        f"{sum(x.path for x in legs):7.1f}  {'':14}  {_localization(whole)}"
    )
    return "\n".join(lines)


def _localization(errors: Errors) -> str:
    if not errors.distances:
        return f"{'no transform':>33}"
    mean, largest = sum(errors.distances) / len(errors.distances), max(errors.distances)
    angle = math.degrees(sum(errors.angles) / len(errors.angles))
    largest_angle = math.degrees(max(errors.angles))
    return f"{mean:8.3f} {largest:7.3f} {angle:8.2f} {largest_angle:7.2f}"


def drive(options: argparse.Namespace) -> list[Leg]:
    """Drives the tour.

    Raises:
        TourError: The tour is invalid, or a node is missing.
    """
    goals = read_tour(options.tour) * options.repeat
    topic = rospy.resolve_name(options.ground_truth)
    # Before the start of the node: without a master, it would wait without a limit, and before the
    # simulator is launched, it would not use its time.
    wait(f"topic {topic}", lambda: is_published(topic), options.wait)
    rospy.init_node("tour", anonymous=True)
    truth = Truth(options.ground_truth, options.frame, options.base_frame)
    client = actionlib.SimpleActionClient(options.action, MoveBaseAction)
    wait(f"true pose on {topic}", lambda: truth.received, options.wait)
    server = rospy.resolve_name(options.action)
    wait(
        f"action server {server}",
        lambda: client.wait_for_server(rospy.Duration(_POLL_PERIOD)),
        options.wait,
    )
    transform = f"transform from {options.frame} to {options.base_frame}"
    wait(transform, truth.localized, options.wait)
    legs = []
    for number, (goal_name, goal) in enumerate(goals, start=1):
        print(f"{number} of {len(goals)}: {goal_name} {list(goal)}", flush=True)
        truth.start()
        result, duration = drive_to(client, options.frame, goal, options.timeout)
        pose, path, errors = truth.stop()
        final = Errors()
        final.add(pose, goal)
        legs.append(Leg(goal_name, result, duration, path, final, errors))
        print(f"  {result} after {duration:.1f} s", flush=True)
    return legs


def parse(arguments: list[str]) -> argparse.Namespace:
    """Reads the command line."""
    parser = argparse.ArgumentParser(
        description="Sends a tour of goals to move_base and reports times and errors.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    office = Path(__file__).resolve().parent.parent / "tours" / "office.yaml"
    parser.add_argument("tour", type=Path, nargs="?", default=office, help="file with the goals")
    parser.add_argument("--repeat", type=int, default=1, metavar="N", help="number of tours")
    parser.add_argument(
        "--timeout", type=float, default=300.0, metavar="S", help="simulated time per goal"
    )
    parser.add_argument(
        "--wait", type=float, default=60.0, metavar="S", help="wall time until all nodes run"
    )
    parser.add_argument("--action", default="move_base", help="action of the goals")
    parser.add_argument(
        "--ground-truth", default="odometry/ground_truth", metavar="TOPIC", help="true pose"
    )
    parser.add_argument("--frame", default="map", help="frame of the goals and the true pose")
    parser.add_argument("--base-frame", default="base_link", help="frame of the robot")
    return parser.parse_args(arguments)


def main() -> int:
    """Drives the tour of the command line; returns the exit code."""
    options = parse(rospy.myargv()[1:])
    try:
        legs = drive(options)
    except (TourError, rospy.ROSException) as error:
        print(f"tour: {error}", file=sys.stderr)
        return 1
    print(report(legs))
    return 0 if all(leg.reached for leg in legs) else 1


if __name__ == "__main__":
    sys.exit(main())
