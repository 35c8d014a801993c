"""The services of the node: answers as on ROS 1, and clients of ports of the reference."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from flatland_msgs.msg import Collisions
from flatland_msgs.srv import (
    ChangeRate,
    DeleteModel,
    GetModelStates,
    MoveModel,
    SetRate,
    SpawnModel,
    SpawnModels,
    StepWorld,
    WaitUntilReady,
)
from geometry_msgs.msg import Pose2D, Twist
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty
from waiting import wait_until

from flatland.node.services import SERVICES

MODELS = "[{name: robot, model: robot.model.yaml, pose: [1, 2, 0]}]"
BUMPING_ROBOT = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: DiffDrive, name: drive, body: base, twist_sub: cmd_vel, pub_rate: 10}
  - {type: Laser, name: static_laser, topic: static_laser, body: base, range: 10, update_rate: 10,
     angle: {min: -3.14159265359, max: 3.14159265359, increment: 0.06981317007}}
  - {type: Bumper, name: bumper, topic: collisions, update_rate: 10}
"""


@pytest.fixture(scope="module", autouse=True)
def server(module_ros: Any, module_launcher: Any, write_world: Callable[..., Path]) -> Any:
    world = write_world(MODELS, serp=BUMPING_ROBOT)
    return module_launcher.server(module_ros, world, lockstep=True, reliable_sensors=True)


def test_all_services_of_ros_1_are_offered(ros: Any) -> None:
    expected = {}
    for service in SERVICES:
        package, name = service.type.replace("flatland/", "flatland_msgs/").split("/")
        expected[f"/{service.name}"] = [f"{package}/srv/{name}"]

    def are_offered() -> bool:
        offered = dict(ros.node.get_service_names_and_types())
        return {name: offered.get(name) for name in expected} == expected

    wait_until("all services", are_offered)


# test_equal_results.py compares all texts with those of ROS 1.
@pytest.mark.parametrize(
    ("service", "service_type", "fields", "text"),
    [
        ("spawn_model", SpawnModel, {"yaml_path": "no.yaml", "name": "n"}, "no.yaml"),
        (
            "spawn_model",
            SpawnModel,
            {"yaml_path": "ball.model.yaml", "name": "robot"},
            'Model with name "robot" already exists',
        ),
        ("move_model", MoveModel, {"name": "nobody"}, 'model with name "nobody" does not exist'),
        (
            "delete_model",
            DeleteModel,
            {"name": "nobody"},
            'model with name "nobody" does not exist',
        ),
        ("set_rate", SetRate, {"update_rate": -1.0}, "update_rate must not be negative, got -1.0"),
        ("change_rate", ChangeRate, {"rate": -1.0}, "update_rate must not be negative, got -1.0"),
        ("step_world", StepWorld, {"duration": 0.003}, "must be a multiple of the step size"),
        ("get_model_states", GetModelStates, {"names": ["nobody"]}, '"nobody" does not exist'),
        ("wait_until_ready", WaitUntilReady, {"topics": ["/x"]}, "no connection to /x"),
    ],
)
def test_failures(
    ros: Any, service: str, service_type: type[Any], fields: dict[str, Any], text: str
) -> None:
    answer = ros.call(f"/{service}", service_type, **fields)
    assert not answer.success
    assert text.lower() in answer.message.lower()


def test_batches_report_the_index_of_a_failure(ros: Any) -> None:
    answer = ros.call("/spawn_models", SpawnModels, models=[])
    assert (answer.success, answer.index) == (True, -1)


def test_pause_has_no_effect_on_requested_steps(ros: Any) -> None:
    ros.call("/pause", Empty)
    before = ros.step()
    assert ros.step(0.1) == before + 100_000_000
    ros.call("/resume", Empty)


def test_client_of_a_port_of_the_reference(ros: Any) -> None:
    """What the tutorials of these ports do, with names and qualities of service as there."""
    spawned = ros.call(
        "/spawn_model", SpawnModel, yaml_path="serp.model.yaml", name="serp", ns="", pose=Pose2D()
    )
    assert spawned.success, spawned.message
    scans = ros.topic("/static_laser", LaserScan, 1)
    collisions = ros.topic("/collisions", Collisions, 1)
    commands = ros.publisher("/cmd_vel", Twist, 1)
    ros.wait_until_ready("/static_laser", "/collisions")
    ros.step(0.1)
    assert len(scans.next().ranges) == 91
    moved = ros.call("/move_model", MoveModel, name="serp", pose=Pose2D(x=4.0, theta=0.0))
    assert moved.success
    for _ in range(100):
        commands.publish(Twist(linear=Twist().linear.__class__(x=1.0)))
        ros.step(0.1)
        found = [contact for message in collisions.drop() for contact in message.collisions]
        if found:
            break
    assert found[0].entity_a == "serp"
    assert found[0].entity_b == "2d"
    assert ros.call("/delete_model", DeleteModel, name="serp").success
