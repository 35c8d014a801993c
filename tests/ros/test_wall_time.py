"""The node with `use_sim_time:=false`."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage

MAX_DELAY = 20.0  # s; of a message on a busy machine, far less than the age of a simulated time


@pytest.fixture(scope="module")
def server(
    module_launcher: Any, module_ros: Any, write_world: Callable[..., Path]
) -> Iterator[Any]:
    world = write_world("[{name: robot, model: robot.model.yaml}]")
    arguments = (f"world_path:={world}", "use_sim_time:=false", "show_viz:=false")
    yield module_launcher.launch("flatland", "server.launch", *arguments)
    module_ros.master.setParam("/use_sim_time", True)


def assert_current(stamp: rospy.Time) -> None:
    assert -MAX_DELAY < stamp.to_sec() - time.time() <= 0


def test_stamps_are_wall_times(server: Any, ros: Any) -> None:
    tf = ros.topic("/tf", TFMessage)
    odometry = ros.topic("/odometry/filtered", Odometry)
    tf.next()
    odometry.next()
    scan = ros.topic("/scan", LaserScan)
    stamps = []
    for _ in range(5):
        stamp = scan.next().header.stamp
        assert_current(stamp)
        stamps.append(stamp)
        # The stamps of a step are equal, so that tf2 finds the transforms of a scan.
        message = tf.until(lambda m: m.transforms[0].header.stamp >= stamp)  # noqa: B023
        assert {each.header.stamp for each in message.transforms} == {stamp}
        assert odometry.until(lambda m: m.header.stamp >= stamp).header.stamp == stamp  # noqa: B023
    # The lasers work at 10 Hz, in real time.
    periods = [(b - a).to_sec() for a, b in itertools.pairwise(stamps)]
    assert min(periods) > 0


def test_there_is_no_clock(server: Any, ros: Any) -> None:
    ros.topic("/scan", LaserScan).next()
    assert "/clock" not in ros.registered()["publishers"]
    assert ros.master.getParam("/use_sim_time") is False
    assert "use_sim_time is" not in server.output


def test_stamps_are_current_after_a_pause(server: Any, ros: Any) -> None:
    scan = ros.topic("/scan", LaserScan)
    scan.next()
    ros.call("/pause", Empty)
    paused = time.time()
    ros.wait_until_ready()
    resumed = time.time()
    ros.call("/resume", Empty)
    # Scans of the time before the pause may be received after it.
    message = scan.until(lambda message: message.header.stamp.to_sec() > paused)
    assert message.header.stamp.to_sec() >= resumed


@pytest.mark.parametrize(
    ("own", "others", "text"),
    [
        (True, False, r"\[WARN\].*/use_sim_time is not true: other nodes do not follow"),
        (False, True, r"\[WARN\].*/use_sim_time is true.*publishes no /clock"),
    ],
)
def test_a_contradiction_to_other_nodes_is_reported(
    launcher: Any, ros: Any, write_world: Callable[..., Path], own: bool, others: bool, text: str
) -> None:
    ros.master.setParam("/use_sim_time", others)
    try:
        process = launcher.start("__name:=other", world_path=write_world(), use_sim_time=own)
        process.wait_for_line(text)
    finally:
        ros.master.setParam("/use_sim_time", True)
