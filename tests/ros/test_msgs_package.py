"""`~msgs_package`: the type names of topics and services, and clients of either package."""

from __future__ import annotations

import importlib
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import rosservice
from waiting import TIMEOUT

pytest.importorskip("flatland_msgs.msg", reason="the messages are not built")

CLIENT = Path(__file__).with_name("client_of_the_reference.py")
BUMPER = """
bodies: [{name: box, footprints: [{type: circle, radius: 0.5, density: 1}]}]
plugins: [{type: Bumper, name: bumper}]
"""


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    return write_world("[{name: bumper, model: bumper.model.yaml, pose: [5, 3, 0]}]", bumper=BUMPER)


@pytest.fixture(scope="module", params=["flatland", "flatland_msgs"])
def package(request: pytest.FixtureRequest, module_launcher: Any, world: Path) -> Any:
    """The package of the types of a running server."""
    server = module_launcher.server(world, msgs_package=request.param, show_viz=True)
    yield request.param
    assert server.stop() == 0


@pytest.fixture
def run_tool(ros_master: dict[str, str], tmp_path: Path) -> Callable[..., str]:
    """Runs a program of ROS and returns its output."""

    def run(*command: str) -> str:
        done = subprocess.run(
            command,
            env=ros_master,
            cwd=tmp_path,
            timeout=TIMEOUT,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        assert done.returncode == 0, done.stdout
        return done.stdout

    return run


# -- servers of a single test, before that of the fixture: they have the same name -----------


def test_invalid_package_is_reported_in_one_fatal_line(launcher: Any, world: Path) -> None:
    server = launcher.start(world_path=world, msgs_package="std_msgs")
    assert server.wait() == 1
    [line] = [line for line in server.lines if "FATAL" in line]
    assert (
        "Invalid parameter \"~msgs_package\": it must be flatland or flatland_msgs, got 'std_msgs'"
        in line
    )


def test_package_that_is_not_installed_is_reported(
    launcher: Any, world: Path, tmp_path: Path
) -> None:
    (tmp_path / "flatland_msgs.py").write_text("raise ImportError('not built')\n")
    environment = launcher.environment
    path = f"{tmp_path}:{environment.get('PYTHONPATH', '')}"
    launcher.environment = {**environment, "PYTHONPATH": path}
    server = launcher.start(world_path=world, msgs_package="flatland_msgs")
    assert server.wait() == 1
    [line] = [line for line in server.lines if "FATAL" in line]
    assert 'Invalid parameter "~msgs_package": "flatland_msgs" is not installed, not built' in line


def test_default_of_the_program_yields_to_the_parameter(
    launcher: Any, ros: Any, world: Path
) -> None:
    launcher.server(world, "--msgs-package", "flatland_msgs")
    assert ros.types()["/collisions"] == "flatland_msgs/Collisions"
    launcher.stop()
    launcher.server(world, "--msgs-package", "flatland_msgs", msgs_package="flatland")
    assert ros.types()["/collisions"] == "flatland/Collisions"


# -- the server of the fixture ------------------------------------------------------------


def test_all_types_are_of_the_package(package: str, ros: Any) -> None:
    messages = importlib.import_module(f"{package}.msg")
    assert ros.topic("/flatland_server/debug/topics", messages.DebugTopicList).next().topics
    of_master = ros.types()
    types = {topic: of_master[topic] for topic in ros.registered()["publishers"]}
    assert types["/collisions"] == f"{package}/Collisions"
    assert types["/flatland_server/debug/topics"] == f"{package}/DebugTopicList"
    other = "flatland" if package == "flatland_msgs" else "flatland_msgs"
    assert not [topic for topic, name in types.items() if name.startswith(f"{other}/")]
    services = {
        "/spawn_model": "SpawnModel",
        "/move_model": "MoveModel",
        "/delete_model": "DeleteModel",
        "/set_appearance": "SetAppearance",
        "/set_rate": "SetRate",
    }
    for service, name in services.items():
        assert rosservice.get_service_type(service) == f"{package}/{name}"


def test_tools_work_with_the_types(package: str, run_tool: Any) -> None:
    printed = run_tool("rostopic", "echo", "-n", "1", "/collisions")
    assert 'entity_A: "bumper"' in printed
    printed = run_tool("rosservice", "call", "/move_model", "{name: nobody}")
    assert "success: False" in printed
    run_tool("rosbag", "record", "-q", "-l", "2", "-O", "some.bag", "/collisions")
    printed = run_tool("rosbag", "info", "-y", "-k", "topics", "some.bag")
    assert f"type: {package}/Collisions" in printed
    assert "messages: 2" in printed


def test_python_client_of_the_reference(package: str, launcher: Any, world: Path) -> None:
    del package  # With equal MD5 sums, the names of types do not matter to a connection.
    client = launcher.program(
        sys.executable, str(CLIENT), str(world.with_name("bumper.model.yaml"))
    )
    assert client.wait() == 0, client.output
    assert client.lines == [
        *("spawned", "listed", "collides with a wall", "is free", "no longer listed")
    ]
