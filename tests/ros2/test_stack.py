"""ROS 2 nodes as controllers of `flatland test`: real nodes and worker processes."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from flatland.ros2.domain import MAX_DOMAIN, reserved_domain
from flatland.scenarios.columns import Row
from flatland.scenarios.controllers import ControllerError, find_controller
from flatland.scenarios.episode import Options
from flatland.scenarios.reader import read_scenarios
from flatland.scenarios.stack_options import StackCommand, StackOptions
from flatland.scenarios.suite import runs_of
from flatland.scenarios.workers import WorkerLimits, run_in_processes

# Drives straight to the goal by the odometry, one command for each scan.
NODE = """
import math, os, signal, subprocess, sys
import rclpy
from geometry_msgs.msg import PoseStamped, TransformStamped, Twist, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage

mode = sys.argv[1]
if mode == "absent":
    print("no battery")
    sys.exit(4)
# Modes in which the node serves an action.
WITH_ACTION = ("navigates", "aborts", "rejects")
if mode in WITH_ACTION:
    from nav2_msgs.action import NavigateToPose
    from rclpy.action import ActionServer, GoalResponse
    from rclpy.task import Future


def stamp_of(message):
    return message.header.stamp.sec, message.header.stamp.nanosec


class Driver(Node):
    def __init__(self):
        super().__init__("driver")
        self.goal = self.scan = None
        self.poses = {}  # by the time of the odometry
        self.command_type = TwistStamped if mode == "stamped" else Twist
        self.commands = self.create_publisher(self.command_type, "cmd_vel", 10)
        self.count = 0  # of the commands
        if mode in WITH_ACTION:
            self.end = Future()  # of the goal
            self.server = ActionServer(
                self, NavigateToPose, "navigate_to_pose", self.execute, goal_callback=self.respond
            )
        else:
            self.create_subscription(PoseStamped, "goal_pose", self.on_goal, 10)
        # The messages of several steps come at once.
        self.create_subscription(Odometry, "odometry/filtered", self.on_odometry, 100)
        self.create_subscription(LaserScan, "scan", self.on_scan, qos_profile_sensor_data)
        if mode == "leaves":
            subprocess.Popen(["setsid", "sleep", "4321.5"])
        if mode == "localizes":
            profile = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
            self.sender = self.create_publisher(TFMessage, "/tf_static", profile)
            found = TransformStamped()
            found.header.frame_id, found.child_frame_id = "map", "odom"
            found.transform.translation.x = 0.2
            self.sender.publish(TFMessage(transforms=[found]))

    def respond(self, goal):
        return GoalResponse.REJECT if mode == "rejects" else GoalResponse.ACCEPT

    async def execute(self, handle):
        # As in Nav2, a new goal aborts the last one.
        self.end.set_result("replaced")
        self.end = Future()
        self.on_goal(handle.request.pose)
        handle.publish_feedback(NavigateToPose.Feedback(number_of_recoveries=2))
        text = await self.end
        handle.abort()
        return NavigateToPose.Result(error_msg=text)

    def on_goal(self, message):
        self.goal = message.pose.position
        if mode == "ends":
            print("\\033[31mthe battery is empty\\033[0m", flush=True)
            sys.exit(0)
        if mode == "kills":
            os.kill(os.getppid(), signal.SIGKILL)

    def on_odometry(self, message):
        self.poses[stamp_of(message)] = message.pose.pose
        self.drive()

    def on_scan(self, message):
        self.scan = message
        self.drive()

    def drive(self):
        if self.scan is None or stamp_of(self.scan) not in self.poses:
            return
        pose, nearest = self.poses[stamp_of(self.scan)], min(self.scan.ranges)
        self.poses.clear()
        self.scan = None
        if self.goal is None or mode == "silent" or (mode == "aborts" and self.count == 5):
            return
        self.count += 1
        yaw = 2 * math.atan2(pose.orientation.z, pose.orientation.w)
        bearing = math.atan2(self.goal.y - pose.position.y, self.goal.x - pose.position.x) - yaw
        bearing = math.remainder(bearing, math.tau)
        message = self.command_type()
        command = message.twist if mode == "stamped" else message
        command.angular.z = 2 * bearing
        command.linear.x = 0.5 if abs(bearing) < 0.3 and nearest > 0.3 else 0.0
        if mode == "nan":
            command.linear.x = math.nan
        self.commands.publish(message)
        if mode == "aborts" and self.count == 5:
            self.end.set_result("no valid plan")


rclpy.init()
rclpy.spin(Driver())
"""
LAUNCH = """
<launch>
  <arg name="mode"/>
  <executable cmd="{program} $(var mode)" output="screen"/>
</launch>
"""
# The wheels of ROS 2 contain no ros2cli. This is the part of `ros2 launch` that the file needs.
ROS2 = """
import argparse, re, shlex, subprocess, sys
import xml.etree.ElementTree as ElementTree

parser = argparse.ArgumentParser()
parser.add_argument("command", choices=["launch"])
parser.add_argument("--noninteractive", action="store_true")
parser.add_argument("--show-all-subprocesses-output", action="store_true")
parser.add_argument("file")
parser.add_argument("arguments", nargs="*")
options = parser.parse_args()
values = dict(argument.split(":=") for argument in options.arguments)
print("use_sim_time is", values["use_sim_time"], flush=True)


def value_of(match):
    return values[match[1]]


programs = []
for each in ElementTree.parse(options.file).iter("executable"):
    command = re.sub(r"\\$\\(var (\\w+)\\)", value_of, each.get("cmd"))
    programs.append(subprocess.Popen(shlex.split(command)))
sys.exit(max(program.wait() for program in programs))
"""
SCENARIO = """
world: world.yaml
goals: [[0, 0], [0, 2]]
limits: {time: 30}
require: [reached, no contact]
"""
ROBOT = "{name: robot, model: robot.model.yaml, pose: [-2, 0, 0]}"
# Wall times, and what depends on them.
TIMES = {"command_time", "max_command_time", "real_time_factor", "wall_time", "worker"}

Drive = Callable[..., list[Row]]


def write_program(file: Path, text: str) -> None:
    """Writes a program in Python."""
    file.write_text(f"#!{sys.executable}\n{text}")
    file.chmod(0o755)


@pytest.fixture
def folder(write_world: Callable[..., Path], monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a scenario, the node, a launch file, and `ros2` on PATH."""
    folder = write_world(f"[{ROBOT}]").parent
    (folder / "scenario.yaml").write_text(SCENARIO)
    (folder / "stack.launch.xml").write_text(LAUNCH.format(program=folder / "node"))
    write_program(folder / "node", NODE)
    programs = folder / "bin"
    programs.mkdir()
    write_program(programs / "ros2", ROS2)
    monkeypatch.setenv("PATH", f"{programs}:{os.environ['PATH']}")
    monkeypatch.setenv("ROS_LOG_DIR", str(folder / "log"))
    return folder


@pytest.fixture
def drive(folder: Path) -> Iterator[Drive]:
    """Runs the scenario with the node in several modes in worker processes; returns the rows."""

    def drive(*controllers: str, seeds: tuple[int, ...] = (1,), **options: Any) -> list[Row]:
        names = [
            name if "." in name else f"command: {folder / 'node'} {name}" for name in controllers
        ]
        scenarios = read_scenarios(folder / "scenario.yaml", {})
        stack = StackOptions(**options)
        found = run_in_processes(
            runs_of(scenarios, names, seeds),
            Options(str(folder), str(folder / "out"), "none", stack),
            WorkerLimits(),
            4,
        )
        rows = sorted(
            (result.row for result in found), key=lambda row: names.index(row["controller"])
        )
        assert not processes_of(folder)
        return rows

    yield drive
    assert not processes_of(folder)


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


def error_of_a_started_node(drive: Drive, mode: str, text: str, **options: Any) -> tuple[str, int]:
    """Gives a node that is never ready more and more time, until it has started.

    Args:
        drive: The fixture.
        mode: Mode of the node.
        text: What the error contains if the node has started.
        options: Options of the run.

    Returns:
        The error, and the time for the start [s].
    """
    error, start_time = "", 2
    while text not in error and start_time < 60:
        start_time *= 2
        (row,) = drive(mode, start_time=start_time, **options)
        error = row["error"]
    return error, start_time


def test_a_launch_file_and_a_program_drive_to_all_goals(drive: Drive) -> None:
    rows = drive("stack.launch.xml mode:=drive", "leaves")
    for row in rows:
        assert (row["outcome"], row["passed"], row["goals"]) == ("reached", True, 2), row["error"]
        assert row["path_length"] == pytest.approx(3.6, abs=0.3)
        # 3.6 m at 0.5 m/s, and the turn by 90 degrees.
        assert 7 < row["time"] < 15
        # The simulator sends the localisation.
        assert row["localization_error"] < 0.01
    # One command for each scan: nothing depends on wall time, also not on that of the start.
    first, second = ({k: v for k, v in row.items() if k not in TIMES} for row in rows)
    assert first.pop("controller") != second.pop("controller")
    assert first == second
    assert first["late_commands"] == 0


def test_stamped_commands(drive: Drive, folder: Path, launcher: Any) -> None:
    # With the command of the environment.
    robot = f"command: {folder / 'node'} stamped"
    command = [Path(sys.executable).with_name("flatland"), "test", folder / "scenario.yaml"]
    options = ["--robot", robot, "--out", folder / "out", "--stamped-commands"]
    assert launcher.program(*command, *options).wait() == 0
    error, start_time = error_of_a_started_node(drive, "stamped", "TwistStamped")
    assert f"not ready after {start_time} s: no node publishes /cmd_vel" in error
    assert "geometry_msgs/msg/TwistStamped" in error


def test_the_error_of_the_localization_is_measured(drive: Drive) -> None:
    (row,) = drive("localizes", localization="stack")
    assert row["localization_error"] == pytest.approx(0.2, abs=0.01)
    assert row["max_localization_error"] == pytest.approx(0.2, abs=0.02)


def test_a_stack_that_fails_is_a_failed_run(drive: Drive) -> None:
    modes = ["stack.launch.xml mode:=ends", "ends", "absent", "nan", "silent", "kills"]
    rows = dict(zip(modes, drive(*modes), strict=True))
    assert {row["outcome"] for row in rows.values()} == {"error"}
    errors = {mode: row["error"] for mode, row in rows.items()}
    ended = "the program has ended with exit code 0; its last output: "
    assert errors["stack.launch.xml mode:=ends"].startswith(f"{ended}use_sim_time is true")
    assert errors["ends"] == f"{ended}the battery is empty"
    assert errors["absent"] == "the program has ended with exit code 4; its last output: no battery"
    assert "a command that is not finite" in errors["nan"]
    assert "sent no command for 10 s" in errors["silent"]
    # The node ends the worker process, and is ended with it.
    assert "ended in each of 3 attempts (signal 9)" in errors["kills"]


def test_goals_are_sent_to_an_action(drive: Drive) -> None:
    modes = ["navigates", "aborts", "rejects"]
    reached, aborted, rejected = drive(*modes, goal_action="navigate_to_pose")
    assert (reached["outcome"], reached["goals"]) == ("reached", 2), reached["error"]
    assert reached["recoveries"] == 4
    for row, error in (aborted, "aborted the goal: no valid plan"), (rejected, "rejected the goal"):
        assert (row["outcome"], row["passed"]) == ("gave_up", False), row["error"]
        assert row["error"] == f"navigate_to_pose {error}"
    # The measures are those until then.
    assert aborted["recoveries"] == 2
    assert 0 < aborted["time"] < 5
    error, _ = error_of_a_started_node(drive, "drive", "the action", goal_action="navigate_to_pose")
    assert "the action navigate_to_pose is not available" in error


def test_an_action_without_its_package_is_a_failed_run(
    drive: Drive, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "nav2_msgs.py").touch()
    monkeypatch.syspath_prepend(folder)  # also of worker processes
    (row,) = drive("drive", goal_action="navigate_to_pose")
    assert "--goal-action requires the package nav2_msgs" in row["error"]


def test_a_controller_names_what_is_missing(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def error_of(name: str) -> str:
        with pytest.raises(ControllerError) as caught:
            find_controller(name, str(folder))
        return str(caught.value)

    assert f"file not found: {folder}/missing.launch.py" in error_of("missing.launch.py a:=1")
    (folder / "stack.launch").write_text(LAUNCH)
    assert "rospy is not installed" in error_of("stack.launch")
    for name in ("a.launch.py", "a_launch.py", "a.launch.xml", "a.launch.yaml"):
        (folder / name).touch()
        found = find_controller(f"{name} use_sim_time:=false b:=2", str(folder))
        assert isinstance(found, StackCommand)
        assert found.ros == 2
        # Of equal arguments, the last one is valid.
        assert found.program[-4:] == (
            str(folder / name),
            "use_sim_time:=true",
            "use_sim_time:=false",
            "b:=2",
        )
    monkeypatch.setenv("PATH", "")
    assert "the program ros2, which starts it, is not on PATH" in error_of("a.launch.py")


def test_the_installed_kind_of_ros_is_that_of_programs(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = find_controller("command: node drive", str(folder))
    assert isinstance(found, StackCommand)
    assert found.ros == 2
    (folder / "rospy.py").touch()
    monkeypatch.syspath_prepend(folder)
    for version in ("1", "2"):
        monkeypatch.setenv("ROS_VERSION", version)
        found = find_controller("command: node drive", str(folder))
        assert isinstance(found, StackCommand)
        assert str(found.ros) == version
    monkeypatch.delenv("ROS_VERSION")
    with pytest.raises(ControllerError, match="rospy and rclpy are installed; set ROS_VERSION"):
        find_controller("command: node drive", str(folder))


def test_a_reserved_domain_is_not_given_twice(domain: int) -> None:
    with reserved_domain() as first, reserved_domain() as second:
        assert len({first, second, domain}) == 3
        assert {first, second} < set(range(1, MAX_DOMAIN + 1))
