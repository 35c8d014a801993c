"""The start of the node: parameters, invalid worlds, the ROS master, and the launch files."""

from __future__ import annotations

import signal
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import roslaunch.config
import rospy
from free_ports import free_port
from rosgraph_msgs.msg import Clock

from flatland.msg import DebugTopicList
from flatland.ros.parameter_server import ParameterServer


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


def test_invalid_master_address_is_reported(launcher: Any, world: Path) -> None:
    launcher.environment = {**launcher.environment, "ROS_MASTER_URI": "nonsense"}
    process = launcher.start(world_path=world)
    assert process.wait() == 1
    assert process.output.strip() == "invalid master URI: nonsense (from ROS_MASTER_URI)"


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
