"""The start and the end of the node: parameters, invalid worlds, signals, namespaces."""

from __future__ import annotations

import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters
from rclpy.parameter import Parameter
from rclpy.qos import (
    DurabilityPolicy,
    QoSProfile,
    ReliabilityPolicy,
    qos_profile_sensor_data,
)
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from waiting import wait_until


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    return write_world("[{name: robot, model: robot.model.yaml}]")


def fatal_lines(program: Any) -> list[str]:
    return [line for line in program.lines if "[FATAL]" in line]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_node_with_code_0(
    ros: Any, launcher: Any, world: Path, number: signal.Signals
) -> None:
    program = launcher.server(ros, world)
    program.send(number)
    assert program.wait() == 0
    assert fatal_lines(program) == []
    assert "Traceback" not in program.output


def test_a_subscriber_that_requires_more_is_named(ros: Any, launcher: Any, world: Path) -> None:
    program = launcher.server(ros, world)
    ros.topic("/scan", LaserScan)
    someone = "(/flatland_tests|a subscriber) receives nothing, because it requires"
    program.wait_for_line(
        rf'topic "/scan": {someone} reliable messages: let it subscribe with best effort '
        r".*reliable_sensors:=true"
    )
    stored = QoSProfile(
        depth=1,
        reliability=ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
    )
    ros.topic("/clock", Clock, stored)
    program.wait_for_line(f'topic "/clock": {someone} (stored|reliable) messages: let it')


@pytest.mark.parametrize(
    ("parameters", "texts"),
    [
        ({"world_path": "/no/such/world.yaml"}, ["/no/such/world.yaml"]),
        ({"world_path": "{folder}/bad.model.yaml"}, ["bad.model.yaml"]),
        ({"update_rate": "fast"}, ['Invalid parameter "~update_rate"', "'fast'"]),
        ({"step_size": "-1"}, ['Invalid parameter "~step_size"', "-1"]),
        ({"publish_map": "roof"}, ['Invalid parameter "~publish_map"', "2d"]),
    ],
)
def test_a_failed_start_is_reported_in_one_line(
    launcher: Any, write_world: Callable[..., Path], parameters: dict[str, str], texts: list[str]
) -> None:
    world = write_world("[{name: robot, model: robot.model.yaml}]", bad="bodies: []\n")
    given = {name: value.format(folder=world.parent) for name, value in parameters.items()}
    program = launcher.start(**{"world_path": world, "seed": 1, **given})
    assert program.wait() == 1
    [line] = fatal_lines(program)
    for text in texts:
        assert text in line
    assert "Traceback" not in program.output


def test_parameters_have_descriptions_and_ranges_and_are_read_at_the_start(
    ros: Any, launcher: Any, world: Path
) -> None:
    launcher.server(ros, world, update_rate=100, seed=7)
    names = ["update_rate", "seed", "step_size", "world_path", "use_sim_time"]
    values = ros.call("/flatland_server/get_parameters", GetParameters, names=names).values
    assert values[0].type == ParameterType.PARAMETER_DOUBLE
    assert (values[0].double_value, values[1].integer_value) == (100.0, 7)
    assert values[3].string_value == str(world)
    assert values[4].bool_value
    described = ros.call(
        "/flatland_server/describe_parameters", DescribeParameters, names=names[:4]
    ).descriptors
    assert all(each.description for each in described)
    [step_range] = described[2].floating_point_range
    assert 0 < step_range.from_value < 0.005 < step_range.to_value
    wanted = Parameter("step_size", value=0.01).to_parameter_msg()
    answer = ros.call("/flatland_server/set_parameters", SetParameters, parameters=[wanted])
    [result] = answer.results
    assert not result.successful
    assert result.reason
    values = ros.call("/flatland_server/get_parameters", GetParameters, names=names).values
    assert values[2].double_value == 0.005


def test_two_nodes_in_namespaces_with_remapped_topics(ros: Any, launcher: Any, world: Path) -> None:
    programs = {}
    for namespace in ("/first", "/second"):
        remapping = ("-r", f"__ns:={namespace}", "-r", f"{namespace}/scan:={namespace}/laser")
        programs[namespace] = launcher.server(ros, world, *remapping)
    for namespace in ("/first", "/second"):
        topic = ros.topic(f"{namespace}/laser", LaserScan, qos_profile_sensor_data)
        assert len(topic.next().ranges) == 7

    def is_published_by_both() -> bool:
        publishers = ros.node.get_publishers_info_by_topic("/clock")
        return {each.node_namespace for each in publishers} == {"/first", "/second"}

    # The names of the nodes of publishers are discovered separately.
    wait_until("/clock of both nodes", is_published_by_both)
    for namespace, other in (("/first", "/second"), ("/second", "/first")):
        text = f"/clock is also published by {other}/flatland_server: the time of all nodes"
        programs[namespace].wait_for_line(text)
        assert programs[namespace].output.count("is also published by") == 1
    topics = dict(ros.node.get_topic_names_and_types())
    assert not {"/first/scan", "/second/scan", "/scan", "/first/clock"} & topics.keys()


def test_time_of_a_client_with_use_sim_time(ros: Any, launcher: Any, world: Path) -> None:
    launcher.server(ros, world, lockstep=True)
    clock = ros.topic("/clock", Clock, qos_profile_sensor_data)
    ros.wait_until_ready("/clock")
    first = clock.next().clock
    assert (first.sec, first.nanosec) == (0, 1)  # 0 is no time
    now = ros.step(1.0)
    clock.until(lambda message: message.clock.sec * 10**9 + message.clock.nanosec == now)
    assert now == 10**9
