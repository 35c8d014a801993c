"""`~msgs_package`: the type names of topics and services, and clients of either package."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import rospy
import rosservice
import rostopic
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
    """The package of the types of a running server, whose parameter overrides the option."""
    given = {"msgs_package": request.param} if request.param == "flatland" else {}
    option = ("--msgs-package", "flatland_msgs")
    server = module_launcher.server(
        world, *option, show_viz=True, shutdown_timeout=TIMEOUT, **given
    )
    yield request.param
    assert server.stop() == 0


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


def test_all_types_are_of_the_package(package: str, ros: Any) -> None:
    messages = importlib.import_module(f"{package}.msg")
    assert ros.topic("/flatland_server/debug/topics", messages.DebugTopicList).next().topics
    registered = ros.registered()["publishers"]
    of_master = ros.types()
    types = {topic: of_master[topic] for topic in registered}
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


def test_tools_work_with_the_types(package: str, ros: Any) -> None:
    """rostopic, rqt and others look the class up by the name that the master knows."""
    messages = ros.topic("/collisions", rospy.AnyMsg)
    found, _, _ = rostopic.get_topic_class("/collisions")
    assert found is importlib.import_module(f"{package}.msg").Collisions
    message = messages.next()
    assert found().deserialize(message._buff).collisions[0].entity_A == "bumper"
    # rosbag records the type of the connection.
    assert message._connection_header["type"] == f"{package}/Collisions"


def test_clients_of_the_other_package(package: str, launcher: Any, world: Path) -> None:
    """With equal MD5 sums, the names of types do not matter to a connection."""
    if package == "flatland":
        client = launcher.program(
            sys.executable, str(CLIENT), str(world.with_name("bumper.model.yaml"))
        )
        assert client.wait() == 0, client.output
        assert client.lines == [
            *("spawned", "listed", "publishes"),
            *("collides with the wall", "is free", "no longer listed"),
        ]
    else:
        client = launcher.program("rosservice", "call", "/move_model", "{name: nobody}")
        assert client.wait() == 0, client.output
        assert "success: False" in client.output
