"""ROS nodes as controllers: real nodes, launch files and worker processes."""

from __future__ import annotations

import math
import os
import re
import shutil
import sys
from pathlib import Path

import pytest
from plugin_manifests import write_plugins

pytest.importorskip("rospy", reason="ROS is not installed")

from flatland.scenarios.controllers import ControllerError, find_controller
from flatland.scenarios.episode import Options
from flatland.scenarios.programs import Program
from flatland.scenarios.stack_options import StackOptions
from flatland.scenarios.suite import runs_of
from flatland.scenarios.workers import WorkerLimits, run_in_processes

pytestmark = pytest.mark.ros

# Drives straight to the goal by the transform map -> base, one command for each scan.
NODE = """
import math, os, signal, subprocess, sys, threading, time

mode = sys.argv[1]
if mode == "absent":
    print("no battery")
    sys.exit(4)

import rospy, tf2_ros
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TransformStamped, Twist
from move_base_msgs.msg import MoveBaseActionGoal, RecoveryStatus
from nav_msgs.msg import OccupancyGrid
from sensor_msgs.msg import LaserScan

rospy.init_node("driver")
transforms = tf2_ros.Buffer()
listener = tf2_ros.TransformListener(transforms)
goal = None
count = 0
commands = rospy.Publisher("cmd_vel", Twist, queue_size=100 if mode == "several" else 1)
if mode == "localizes":
    sender = tf2_ros.StaticTransformBroadcaster()
    found = TransformStamped()
    found.header.frame_id, found.child_frame_id = "map", "odom"
    found.transform.translation.x, found.transform.rotation.w = 0.2, 1.0
    sender.sendTransform(found)
if mode == "leaves":
    subprocess.Popen(["setsid", "sleep", "4321.5"])

def on_action_goal(message):
    status.status_list = [GoalStatus(message.goal_id, GoalStatus.ACTIVE, "")]
    status_publisher.publish(status)
    on_goal(message.goal.target_pose)

def abort():
    recoveries.publish(RecoveryStatus())
    status.status_list[0].status = GoalStatus.ABORTED
    status.status_list[0].text = "no valid plan"
    status_publisher.publish(status)

def on_goal(message):
    global goal
    goal = message.pose.position
    if mode == "ends":
        print("\\033[31mthe battery is empty\\033[0m", flush=True)
        rospy.signal_shutdown("test")
    if mode == "kills":
        os.kill(os.getppid(), signal.SIGKILL)
    if mode == "floods":
        threading.Thread(target=flood, daemon=True).start()

def flood():
    # Without a queue, from which most commands would be dropped.
    several = rospy.Publisher("cmd_vel", Twist)
    while not rospy.is_shutdown():
        several.publish(Twist())

def on_scan(scan):
    global count
    if goal is None or mode in ("silent", "ends") or (mode in ("stops", "aborts") and count > 5):
        return
    count += 1
    if mode == "aborts" and count > 5:
        abort()
        return
    command = Twist()
    # In wall time: the simulated time waits for the command.
    while not transforms.can_transform("map", "base", scan.header.stamp):
        if rospy.is_shutdown():
            return
        time.sleep(0.001)
    pose = transforms.lookup_transform("map", "base", scan.header.stamp).transform
    yaw = 2 * math.atan2(pose.rotation.z, pose.rotation.w)
    bearing = math.atan2(goal.y - pose.translation.y, goal.x - pose.translation.x) - yaw
    bearing = math.remainder(bearing, math.tau)
    command.angular.z = 2 * bearing
    command.linear.x = 0.5 if abs(bearing) < 0.3 else 0.0
    if mode == "nan":
        command.linear.x = math.nan
    for _ in range(3 if mode == "several" else 1):
        commands.publish(command)

# The map and the pose of the start arrive before the goal is accepted.
rospy.wait_for_message("map", OccupancyGrid)
rospy.wait_for_message("initialpose", PoseWithCovarianceStamped)
if mode == "aborts":
    status = GoalStatusArray()
    recoveries = rospy.Publisher("move_base/recovery_status", RecoveryStatus, queue_size=1)
    status_publisher = rospy.Publisher(
        "move_base/status", GoalStatusArray, queue_size=5, latch=True
    )
    status_publisher.publish(status)
    rospy.Subscriber("move_base/goal", MoveBaseActionGoal, on_action_goal)
else:
    rospy.Subscriber("move_base_simple/goal", PoseStamped, on_goal)
rospy.Subscriber("scan", LaserScan, on_scan)
rospy.spin()
"""
LAUNCH = """
<launch>
  <arg name="mode"/>
  <node name="driver" pkg="stack" type="node" args="$(arg mode)" required="true"/>
</launch>
"""
PACKAGE = """
<package format="2">
  <name>stack</name><version>0.0.0</version><description>A driver.</description>
  <maintainer email="test@example.com">Test</maintainer><license>BSD</license>
</package>
"""
SLOW_STEPS = """
import time
import flatland

class SlowSteps(flatland.WorldPlugin):
    def before_physics_step(self, timekeeper):
        time.sleep(0.01)
"""
TEXT = "goal: [3.5, 5]\nlimits: {time: 30}\nrequire: [reached, no contact]\n"
TWO_GOALS = TEXT.replace("goal: [3.5, 5]", "goals: [[3, 5], [3, 6]]")


@pytest.fixture
def drive(scenario, room, forked, monkeypatch):
    """Runs a scenario with the node in several modes in worker processes; returns the rows."""
    package = room / "stack"
    package.mkdir()
    (package / "package.xml").write_text(PACKAGE)
    (package / "node").write_text(f"#!{sys.executable}\n{NODE}")
    (package / "node").chmod(0o755)
    (room / "stack.launch").write_text(LAUNCH)
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{package}:{os.environ['ROS_PACKAGE_PATH']}")

    def drive(*controllers, text=TEXT, **options):
        names = [
            name if "." in name else f"command: {package / 'node'} {name}" for name in controllers
        ]
        runs = runs_of([scenario(text)], names, [1])
        stack = StackOptions(**options)
        found = run_in_processes(
            runs, Options(str(room), str(room / "out"), "none", stack), WorkerLimits(), 2
        )
        rows = {result.row["controller"]: result.row for result in found}
        assert not processes_of(package)
        return [rows[name] for name in names]

    return drive


def processes_of(folder: Path) -> list[str]:
    """Returns the commands of all processes that run a program in a folder, or the sleeper."""
    commands = []
    for file in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            command = file.read_bytes().replace(b"\0", b" ").decode()
        except OSError:
            continue
        if f"{folder}/" in command or "4321.5" in command:
            commands.append(command)
    return commands


def test_a_launch_file_and_a_program_drive_to_all_goals(drive):
    for row in drive("stack.launch mode:=drive", "leaves", text=TWO_GOALS):
        assert (row["outcome"], row["passed"], row["goals"]) == ("reached", True, 2), row["error"]
        assert row["path_length"] == pytest.approx(1.6, abs=0.3)
        # 1.6 m at 0.5 m/s, and the turn by 90 degrees.
        assert 3 < row["time"] < 10
        # The simulator sends the localisation.
        assert row["localization_error"] < 0.01
        assert row["command_time"] > 0


def test_the_error_of_the_localization_is_measured(drive):
    (row,) = drive("localizes", localization="stack")
    assert row["localization_error"] == pytest.approx(0.2, abs=0.01)
    assert row["max_localization_error"] == pytest.approx(0.2, abs=0.02)
    # The robot stops short of the goal by that distance, within the tolerance.
    assert row["outcome"] == "reached"


def test_a_stack_that_fails_is_a_failed_run(drive, monkeypatch):
    monkeypatch.setattr("flatland.scenarios.workers.MAX_ATTEMPTS", 1)  # of the mode `kills`
    # The first two take the longest time, and run at the same time.
    modes = ["silent", "stops", "ends", "absent", "nan", "kills"]
    text = TEXT.replace("[reached, no contact]", "[no contact]")
    rows = dict(zip(modes, drive(*modes, text=text), strict=True))
    stops = rows.pop("stops")
    assert (stops["outcome"], stops["success"]) == ("gave_up", False), stops["error"]
    assert stops["error"] == "the stack sent no command for 10 s"
    # It has driven: as for a time limit, only the conditions decide.
    assert (stops["passed"], stops["failures"]) == (True, None)
    assert {(row["outcome"], row["passed"]) for row in rows.values()} == {("error", False)}
    errors = {mode: row["error"] for mode, row in rows.items()}
    assert "the program has ended with exit code 0; its last output: " in errors["ends"]
    assert "the battery is empty" in errors["ends"]
    assert "\033" not in errors["ends"]
    assert "the program has ended with exit code 4; its last output: no battery" in errors["absent"]
    assert "a command that is not finite" in errors["nan"]
    assert "sent no command for 10 s" in errors["silent"]
    # The node ends the worker process, and is ended with it.
    assert "ended in each of 1 attempts (signal 9)" in errors["kills"]


def test_a_command_for_each_scan_in_each_step_is_not_too_many(drive, room):
    model = room / "robot.model.yaml"
    model.write_text(model.read_text().replace("    update_rate: 10\n", ""))
    for row in drive("drive", "several"):
        assert row["outcome"] == "reached", row["error"]
        # No command is awaited in vain.
        assert row["late_commands"] <= 1


def test_a_stack_that_floods_the_simulator_is_a_failed_run(drive):
    # In real time, since a lockstep on a busy machine may be faster than the commands.
    (row,) = drive("floods", pace="real-time")
    assert row["outcome"] == "error"
    # Ten for each step.
    assert "sent more than 2000 commands per second" in row["error"]


def test_a_stack_that_gives_up_has_failed(drive):
    (aborted,) = drive("aborts", goal_action="move_base")
    assert (aborted["outcome"], aborted["passed"]) == ("gave_up", False), aborted["error"]
    assert aborted["error"] == "move_base aborted the goal: no valid plan"
    assert aborted["recoveries"] == 1
    reason = "reached: the outcome is gave_up; move_base aborted the goal: no valid plan"
    assert aborted["failures"] == reason
    # The measures are those until then.
    assert 0 < aborted["time"] < 5
    assert aborted["steps"] > 0


def test_a_stack_that_is_not_ready_in_time_is_a_failed_run(drive):
    error, start_time = "no node publishes /cmd_vel", 1
    while "no node publishes /cmd_vel" in error:  # until there is time for the node to start
        start_time *= 2
        (row,) = drive("drive", goal_topic="elsewhere", start_time=start_time)
        assert row["outcome"] == "error"
        error = row["error"]
    assert f"not ready after {start_time} s: no node subscribes to /elsewhere" in error


def test_real_time_that_is_not_held_makes_a_run_invalid(drive, room, monkeypatch):
    (row,) = drive("drive", pace="real-time")
    if row["outcome"] == "invalid":  # on a machine that is too busy
        # The text is rounded.
        assert float(re.search(r"hold real time: ([\d.]+) s", row["failures"])[1]) <= 0.95
    else:
        assert (row["outcome"], row["passed"]) == ("reached", True), row["error"]
    assert row["real_time_factor"] < 1.1
    # Each step takes twice the time that it simulates.
    monkeypatch.setenv("FLATLAND_PLUGIN_PATH", write_plugins(room, SLOW_STEPS, "slow_steps"))
    world = room / "world.yaml"
    world.write_text(world.read_text() + "plugins: [{type: 'test::SlowSteps', name: slow}]\n")
    (row,) = drive("drive", text=TEXT.replace("time: 30", "time: 1.5"), pace="real-time")
    assert (row["outcome"], row["success"], row["passed"]) == ("invalid", False, False)
    assert "did not hold real time" in row["failures"]


def test_the_name_of_a_stack_is_checked(room):
    for name, message in (
        ("command:", "expected a program"),
        ("command: a 'b", "No closing quotation"),
        ("missing.launch a:=1", "file not found"),
    ):
        with pytest.raises(ControllerError, match=message):
            find_controller(name, str(room))


def test_a_program_ends_with_all_its_processes(tmp_path, monkeypatch):
    monkeypatch.setattr("flatland.scenarios.programs._END_TIMEOUT", 0.1)
    marker = math.pi * 1e6
    script = f"setsid sleep {marker} & trap '' TERM; echo started; sleep {marker}"
    program = Program([shutil.which("bash") or "bash", "-c", script], {}, str(tmp_path))
    while not program.last_lines:
        assert program.exit_code is None
    program.end()
    assert program.last_lines == "started"
    commands = b"".join(file.read_bytes() for file in Path("/proc").glob("[0-9]*/cmdline"))
    assert str(marker).encode() not in commands
