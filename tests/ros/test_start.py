"""The start of the node: parameters, invalid worlds, the ROS master, and the launch files."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import roslaunch.config
import rospy
from free_ports import free_port
from programs import Program
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Empty

from flatland.msg import DebugTopicList
from flatland.ros.parameter_server import ParameterServer

ADDRESS_VARIABLES = ("ROS_IP", "ROS_HOSTNAME")


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    return write_world("[{name: robot, model: robot.model.yaml}]")


def fatal_lines(process: Any) -> list[str]:
    return [line for line in process.lines if "[FATAL]" in line]


def assert_stops(process: Any, number: signal.Signals) -> None:
    process.send(number)
    assert process.wait() == 0
    assert fatal_lines(process) == []
    assert "Traceback" not in process.output


def test_world_with_an_invalid_second_model_leaves_no_topics(
    launcher: Any, ros: Any, write_world: Callable[..., Path]
) -> None:
    world = write_world(
        "[{name: good, model: robot.model.yaml}, {name: bad, model: bad.model.yaml}]",
        bad="bodies: []\n",
    )
    process = launcher.start(world_path=world)
    assert process.wait() == 1
    assert len(fatal_lines(process)) == 1
    assert "Traceback" not in process.output
    assert ros.registered_now() == {"publishers": set(), "subscribers": set(), "services": set()}


def test_node_that_waits_for_an_unresponsive_server_can_be_stopped(
    launcher: Any, world: Path
) -> None:
    """A program on the port of the master accepts connections and never responds."""
    with socket.create_server(("127.0.0.1", 0)) as silent:
        uri = f"http://127.0.0.1:{silent.getsockname()[1]}"
        launcher.environment = {**launcher.environment, "ROS_MASTER_URI": uri}
        process = launcher.start(world_path=world)
        process.wait_for_line(f"waiting for the ROS master at {uri}")
        assert_stops(process, signal.SIGINT)


def test_node_waits_for_its_master(launcher: Any, world: Path) -> None:
    port = free_port()
    uri = f"http://127.0.0.1:{port}"
    launcher.environment = {**launcher.environment, "ROS_MASTER_URI": uri}
    process = launcher.start(world_path=world)
    process.wait_for_line(f"waiting for the ROS master at {uri}")
    core = launcher.program("rosmaster", "--core", "-p", str(port))
    process.wait_for_line("loaded")
    assert_stops(process, signal.SIGTERM)
    core.kill()  # On SIGINT, it waits for its connections for about half a minute.


@pytest.mark.parametrize("uri", ["nonsense", "http://localhost", "https://localhost:11311"])
def test_invalid_master_address_is_reported(launcher: Any, world: Path, uri: str) -> None:
    launcher.environment = {**launcher.environment, "ROS_MASTER_URI": uri}
    process = launcher.start(world_path=world)
    assert process.wait() == 1
    [line] = process.output.splitlines()
    assert line.startswith(f'invalid master URI "{uri}": it ')
    assert line.endswith("such as http://localhost:11311 (from ROS_MASTER_URI)")


def test_a_reason_is_given_why_there_is_no_master(launcher: Any, world: Path) -> None:
    uri = "http://no-such-host.invalid:11311"
    launcher.environment = {**launcher.environment, "ROS_MASTER_URI": uri}
    process = launcher.start(world_path=world)
    process.wait_for_line(rf"waiting for the ROS master at {uri} \(.*[Nn]ame.*\)")
    assert_stops(process, signal.SIGINT)


@pytest.mark.parametrize(
    ("variable", "host", "reason"),
    [
        ("ROS_IP", "192.0.2.1", "(unreachable|timed out|refused|reset)"),
        ("ROS_HOSTNAME", "no-such-host.invalid", "[Nn]ame"),
        ("ROS_HOSTNAME", "http://robot", "[Nn]ame"),
    ],
)
def test_a_node_that_nobody_can_reach_is_reported(
    launcher: Any, world: Path, variable: str, host: str, reason: str
) -> None:
    environment = {k: v for k, v in launcher.environment.items() if k not in ADDRESS_VARIABLES}
    launcher.environment = {**environment, variable: host}
    process = launcher.start(world_path=world)
    process.wait_for_line(
        rf"no other node can connect to this one at its address http://{host}:\d+/, "
        rf"from {variable}: .*{reason}.*; set {variable} "
    )
    assert_stops(process, signal.SIGTERM)


# -- the log -------------------------------------------------------------------------------


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_an_output_that_cannot_encode_a_path_is_no_reason_to_end(
    ros_master: dict[str, str], server_path: str, world: Path, tmp_path: Path, encoding: str
) -> None:
    folder = tmp_path / "世界"
    shutil.copytree(world.parent, folder)
    environment = {**ros_master, "PYTHONIOENCODING": encoding}
    path = f"_world_path:={folder / world.name}"
    process = Program([server_path, path], env=environment)
    process.wait_for_line(r'loaded ".*/\\u4e16\\u754c/world.yaml"')
    assert process.stop() == 0
    assert "Traceback" not in process.output


def make_file(folder: Path) -> None:
    folder.write_text("")


def make_folder_in_the_way(folder: Path) -> None:
    (folder / "flatland_server.log").mkdir(parents=True)


@pytest.mark.parametrize("prevent", [make_file, make_folder_in_the_way])
def test_a_log_that_cannot_be_written_is_only_shown(
    launcher: Any, ros: Any, world: Path, tmp_path: Path, prevent: Callable[[Path], None]
) -> None:
    folder = tmp_path / "log"
    prevent(folder)
    launcher.environment = {**launcher.environment, "ROS_LOG_DIR": str(folder)}
    process = launcher.server(world)
    [warning] = [line for line in process.lines if "the log is not written to a file: " in line]
    assert str(folder) in warning
    assert "set ROS_LOG_DIR" in warning
    assert any("[INFO]" in line and "loaded" in line for line in process.lines)
    assert_stops(process, signal.SIGINT)


def test_a_log_whose_reader_has_ended_is_no_reason_to_end(
    launcher: Any, ros: Any, ros_master: dict[str, str], server_path: str, world: Path
) -> None:
    """As in `rosrun flatland flatland_server | head -1`."""
    read, write = os.pipe()
    os.close(read)
    command = [server_path, f"_world_path:={world}"]
    process = Program(command, env=ros_master, stdout=write, stderr=subprocess.STDOUT)
    os.close(write)
    ros.call("/pause", Empty)
    assert process.running
    assert process.stop() == 0


def test_simulator_publishes_markers_without_a_display(
    launcher: Any, ros: Any, world: Path
) -> None:
    launcher.environment = {k: v for k, v in launcher.environment.items() if k != "DISPLAY"}
    launch = launcher.launch("flatland", "server.launch", f"world_path:={world}")
    launch.wait_for_line(r"the viewer cannot start: there is no display \(DISPLAY is not set\)")
    launch.wait_for_line(r"flatland_viz-\d+. process has died")
    ros.topic("/clock", Clock).take(2)
    ros.topic("/flatland_server/debug/topics", DebugTopicList).next()
    assert launch.stop() == 0


@pytest.mark.parametrize(
    ("private", "global_", "found"), [(None, None, None), (1, None, 1), (None, 1, 1), (0, 1, 0)]
)
def test_simplify_map_is_a_private_or_global_parameter(
    ros: Any, private: int | None, global_: int | None, found: int | None
) -> None:
    """The reader of parameters runs in this process, as a node of another name."""
    names = {f"{rospy.get_name()}/simplify_map": private, "/simplify_map": global_}
    given = {name: value for name, value in names.items() if value is not None}
    for name, value in given.items():
        ros.master.setParam(name, value)
    try:
        assert ParameterServer().get("simplify_map") == found
    finally:
        for name in given:
            ros.master.deleteParam(name)


@pytest.mark.parametrize(
    ("file", "node"),
    [("server.launch", "flatland_server"), ("benchmark.launch", "flatland_benchmark")],
)
def test_launch_files_without_arguments(
    checkout: Path,
    ros_environment: dict[str, str],
    monkeypatch: pytest.MonkeyPatch,
    file: str,
    node: str,
) -> None:
    monkeypatch.setenv("ROS_PACKAGE_PATH", ros_environment["ROS_PACKAGE_PATH"])
    files = [(str(checkout / "launch" / file), [])]
    config = roslaunch.config.load_config_default(files, None, verbose=False)
    nodes = {each.namespace + each.name: each for each in config.nodes}
    assert nodes[f"/{node}"].required  # so that roslaunch ends with a failed start
    given = {name: param.value for name, param in config.params.items()}
    # Set although it is empty, so that it replaces the seed of an earlier launch on the master.
    assert given[f"/{node}/seed"].strip() == ""
    assert (given[f"/{node}/plugin_timeout"], given["/use_sim_time"]) == (60.0, True)
