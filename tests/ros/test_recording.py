"""Recordings of the node: the run for `flatland replay`, and the messages as MCAP."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan
from visualization_msgs.msg import MarkerArray
from waiting import wait_until

from flatland.recording import Replay
from flatland.recording.log_file import read_recording


def replayed_steps(recording: Path) -> int:
    """Replays a recording without a difference, and returns the number of its last step."""
    replay = Replay(recording)
    difference = replay.run()
    replay.close()
    assert difference is None
    return replay.last_step


def test_a_run_of_the_node_is_repeated_without_ros(
    ros: Any, launcher: Any, write_world: Callable[..., Path], tmp_path: Path
) -> None:
    world = write_world("[{name: robot, model: robot.model.yaml}]")
    recording, messages = tmp_path / "run.flog", tmp_path / "run.mcap"
    server = launcher.server(
        world, record=recording, record_mcap=messages, seed=1, show_viz=True, lockstep=True
    )
    # The recording must be the same with debug markers and subscribers, which a replay has not.
    ros.topic("/flatland_server/debug/model/robot", MarkerArray)
    ros.topic("/scan", LaserScan)
    odometry = ros.topic("/odometry/ground_truth", Odometry)

    def drive_until(accept: Callable[[Odometry], bool]) -> None:
        def accepted() -> bool:
            ros.step(0.1)
            return any(map(accept, odometry.rest(0)))

        wait_until("a drive", accepted)

    publisher = ros.publisher("/cmd_vel", Twist)
    command = Twist()
    command.linear.x = 0.3
    publisher.publish(command)
    drive_until(lambda odometry: odometry.pose.pose.position.x > 0.1)
    assert ros.spawn("ball.model.yaml", "ball", pose=(2.0, 2.0, 0.0)).success
    assert not ros.spawn("ball.model.yaml", "ball").success
    assert ros.move("ball", (2.0, -2.0, 1.0)).success
    command.angular.z = 0.5
    publisher.publish(command)
    drive_until(lambda odometry: odometry.twist.twist.angular.z > 0.4)
    assert ros.delete("ball").success
    while ros.step(0.5) < 2_000_000_000:
        pass
    # What is left if the node is killed.
    unfinished = shutil.copy(recording, tmp_path / "unfinished.flog")
    assert server.stop() == 0
    assert replayed_steps(unfinished) >= 200
    assert replayed_steps(recording) > 300
    kinds = [record.get("kind") for record in read_recording(recording).records]
    assert kinds.count("command") == 2
    assert kinds[-1] == "end"

    read_messages = pytest.importorskip("mcap_ros1.reader").read_ros1_messages
    poses = [
        (message.log_time_ns, message.ros_msg.pose.pose.position.x)
        for message in read_messages(str(messages), topics=["/odometry/ground_truth"])
    ]
    assert poses[0] == (1, 0.0)  # ns; 0 is no time
    assert len(poses) == poses[-1][0] * 50 // 10**9 + 1  # 50 Hz, with and without subscribers
    assert poses[-1][1] > 0.1


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
def test_a_full_disk_ends_the_recordings_only(
    ros: Any, launcher: Any, write_world: Callable[..., Path], tmp_path: Path
) -> None:
    full = tmp_path / "full.mcap"
    full.symlink_to("/dev/full")
    world = write_world("[{name: robot, model: robot.model.yaml}]")
    server = launcher.server(world, record_mcap=full, update_rate=0)
    server.wait_for_line("the recording of messages ends: .*No space left on device")
    odometry = ros.topic("/odometry/ground_truth", Odometry)
    first = odometry.next().header.stamp
    assert odometry.until(lambda message: message.header.stamp > first)
    # The recording is incomplete.
    assert server.stop() == 1
    assert server.output.count("No space left on device") == 2
    assert f'"{full}" is incomplete: No space left on device' in server.output
