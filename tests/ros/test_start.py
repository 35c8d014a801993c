"""The start of the node: parameters, invalid worlds, the ROS master, and the launch files."""

from __future__ import annotations

import signal
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from rosgraph_msgs.msg import Clock

from flatland.msg import DebugTopicList


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


@pytest.mark.parametrize(
    ("parameter", "value"),
    [
        ("update_rate", "fast"),
        ("update_rate", "-1"),
        ("update_rate", ".nan"),
        ("step_size", "0"),
        ("step_size", ".inf"),
        ("step_size", "5000"),  # above the limit of the physics
        ("show_viz", "maybe"),
        ("viz_pub_rate", "0"),
        ("viz_pub_rate", "[1, 2]"),
        ("simplify_map", "3"),
        ("simplify_map", "0.5"),
        ("seed", "-1"),
        ("seed", "lucky"),
        ("benchmark_duration", "0"),
        ("plugin_timeout", "0"),
        ("shutdown_timeout", "-1"),
    ],
)
def test_invalid_parameter_is_reported_in_one_fatal_line(
    launcher: Any, world: Path, parameter: str, value: str
) -> None:
    process = launcher.start(world_path=world, **{parameter: value})
    assert process.wait() == 1
    (line,) = fatal_lines(process)
    assert f'Invalid parameter "~{parameter}"' in line
    # YAML converts some of the texts to floats.
    assert value.lstrip(".") in line or str(float(value)) in line
    assert "Traceback" not in process.output


@pytest.mark.parametrize("given", [{}, {"world_path": "''"}])
def test_missing_world_path(launcher: Any, given: dict[str, str]) -> None:
    process = launcher.start(**given)
    assert process.wait() == 1
    (line,) = fatal_lines(process)
    assert line.endswith("No world_path parameter given!")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (None, "Flatland YAML: File does not exist, path="),
        ("properties: {}\nlayers: [\n", "Flatland YAML: Malformatted file"),
        ("properties: {}\nlayers: []\nmodles: []\n", 'unrecognized entry(s) {"modles"}'),
        (
            "properties: {}\nlayers: []\nplugins: [{name: p, type: Nope}]\n",
            "Flatland plugin: ",
        ),
    ],
)
def test_invalid_world_is_reported_in_one_fatal_line(
    launcher: Any, ros: Any, tmp_path: Path, text: str | None, reason: str
) -> None:
    path = tmp_path / "world.yaml"
    if text is not None:
        path.write_text(text)
    process = launcher.start(world_path=path)
    assert process.wait() == 1
    (line,) = fatal_lines(process)
    assert reason in line
    assert "Traceback" not in process.output
    assert ros.registered() == {"publishers": set(), "subscribers": set(), "services": set()}


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
    assert ros.registered() == {"publishers": set(), "subscribers": set(), "services": set()}


def test_roslaunch_ends_with_a_failed_start(launcher: Any) -> None:
    process = launcher.launch(
        "flatland", "server.launch", "world_path:=/no/such/world.yaml", "show_viz:=false"
    )
    process.wait_for_line(r'\[FATAL\].*Flatland YAML: File does not exist, path="/no/such')
    process.wait_for_line("process has died .*exit code 1")
    process.wait()


def test_node_that_waits_for_a_master_can_be_stopped(launcher: Any, world: Path) -> None:
    uri = f"http://127.0.0.1:{free_port()}"
    launcher.environment = {**launcher.environment, "ROS_MASTER_URI": uri}
    process = launcher.start(world_path=world)
    process.wait_for_line(f"waiting for the ROS master at {uri}")
    process.send(signal.SIGINT)
    assert process.wait() == 0


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


@pytest.mark.parametrize("uri", ["nonsense", "http://", ""])
def test_invalid_master_address_is_reported(launcher: Any, world: Path, uri: str) -> None:
    launcher.environment = {**launcher.environment, "ROS_MASTER_URI": uri}
    process = launcher.start(world_path=world)
    assert process.wait() == 1
    assert process.output.strip() == f"invalid master URI: {uri} (from ROS_MASTER_URI)"


def test_node_continues_without_its_master(launcher: Any, world: Path, eventually: Any) -> None:
    port = free_port()
    uri = f"http://127.0.0.1:{port}"
    launcher.environment = {**launcher.environment, "ROS_MASTER_URI": uri}
    process = launcher.start(world_path=world)
    process.wait_for_line("waiting for the ROS master")
    core = launcher.program("rosmaster", "--core", "-p", str(port))
    process.wait_for_line("loaded")
    level = launcher.program(
        "rosservice", "call", "/flatland_server/set_logger_level", "rosout", "debug"
    )
    assert level.wait() == 0, level.output
    core.kill()
    reports = process.output.count("cycle use")
    eventually("two more reports", lambda: process.output.count("cycle use") >= reports + 2)
    assert_stops(process, signal.SIGTERM)


def test_markers_are_published_without_a_display(launcher: Any, ros: Any, world: Path) -> None:
    environment = {name: v for name, v in launcher.environment.items() if name != "DISPLAY"}
    launcher.environment = environment
    launcher.launch("flatland", "server.launch", f"world_path:={world}")
    ros.topic("/clock", Clock).next()
    ros.topic("/flatland_server/debug/topics", DebugTopicList).next()


def test_server_launch_passes_all_parameters(launcher: Any, ros: Any, world: Path) -> None:
    process = launcher.launch(
        "flatland",
        "server.launch",
        f"world_path:={world}",
        "update_rate:=inf",
        "max_lag:=0.25",
        "step_size:=0.01",
        "show_viz:=false",
        "viz_pub_rate:=15",
        "simplify_map:=1",
        "seed:=7",
        "plugin_timeout:=30",
        "shutdown_timeout:=5",
        "clock_rate:=500",
        "publish_map:=2d",
        f"model_path:={world.parent}:/usr",
    )
    times = [message.clock.to_nsec() for message in ros.topic("/clock", Clock).take(20)]
    assert {time % 10_000_000 for time in times} == {0}
    parameters = ros.master.getParam("/flatland_server")
    assert parameters == {
        "world_path": str(world),
        "update_rate": "inf",
        "max_lag": 0.25,
        "step_size": 0.01,
        "show_viz": False,
        "viz_pub_rate": 15,
        "simplify_map": 1,
        "seed": 7,
        "plugin_timeout": 30,
        "shutdown_timeout": 5,
        "if_blocked": "warn",
        "move_keeps_odometry": False,
        "initialpose_model": "",
        "use_sim_time": True,
        "clock_rate": 500,
        "publish_map": "2d",
        "msgs_package": "flatland",
        "model_path": f"{world.parent}:/usr",
        "record": "",
        "record_mcap": "",
        "lockstep": False,
        "model_states_rate": 50,
        "web": False,
        "web_host": "127.0.0.1",
        "web_port": 8000,
        "web_token": "",
        "web_read_only": False,
    }
    assert ros.master.getParam("/use_sim_time") is True
    ros.log_everything()
    process.wait_for_line("real-time factor: target inf")
    assert "drawn at random" not in process.output
    assert process.stop() == 0


@pytest.mark.parametrize(
    ("private", "global_", "simplified"),
    [(None, None, False), (1, None, True), (None, 1, True), (0, 1, False)],
)
def test_map_is_simplified_by_a_private_or_global_parameter(
    launcher: Any,
    ros: Any,
    tmp_path: Path,
    private: int | None,
    global_: int | None,
    simplified: bool,
) -> None:
    disc = np.full((60, 60), 255, np.uint8)
    cv2.circle(disc, (30, 30), 25, 0, thickness=-1)
    cv2.imwrite(str(tmp_path / "disc.png"), disc)
    (tmp_path / "disc.yaml").write_text(
        "{image: disc.png, resolution: 0.1, origin: [0, 0, 0], occupied_thresh: 0.65}"
    )
    world = tmp_path / "world.yaml"
    world.write_text("{properties: {}, layers: [{name: disc, map: disc.yaml}]}")
    if global_ is not None:
        ros.master.setParam("/simplify_map", global_)
    try:
        given = {} if private is None else {"simplify_map": private}
        process = launcher.start(world_path=world, **given)
        line = process.wait_for_line('Layer "disc": ').string
        process.wait_for_line("loaded")
    finally:
        if global_ is not None:
            ros.master.deleteParam("/simplify_map")
    assert ("simplified (exact: " in line) is simplified


@pytest.mark.parametrize(
    ("file", "node"),
    [("server.launch", "flatland_server"), ("benchmark.launch", "flatland_benchmark")],
)
def test_launch_without_a_seed_replaces_the_seed_of_the_last_launch(
    launcher: Any, ros: Any, world: Path, file: str, node: str
) -> None:
    ros.master.setParam(f"/{node}/seed", 5)  # left on the master by an earlier launch
    arguments = ["show_viz:=false"] if file == "server.launch" else ["benchmark_duration:=1"]
    process = launcher.launch("flatland", file, f"world_path:={world}", *arguments)
    process.wait_for_line(r"seed \d+ drawn at random")


@pytest.mark.parametrize("file", ["server.launch", "benchmark.launch"])
def test_launch_files_require_no_argument(launcher: Any, ros: Any, file: str) -> None:
    del ros
    process = launcher.launch("flatland", file, "--ros-args")
    assert process.wait() == 0
    process.wait_for_line("seed .default")
    assert "Required" not in process.output


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port
