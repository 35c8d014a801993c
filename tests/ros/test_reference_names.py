"""The names of the reference: launch files, node types, message types, clients.

The launch files of the table are of the forms that are found in public repositories.
"""

from __future__ import annotations

import textwrap
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
import roslaunch.config
import roslib.packages
import rospkg
import rosservice
from geometry_msgs.msg import Pose2D
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan

services = pytest.importorskip("flatland_msgs.srv", reason="the messages are not built")

PARAMETERS = """
<param name="world_path" value="$(arg world)"/>
<param name="update_rate" value="20"/>
<param name="step_size" value="0.05"/>
<param name="show_viz" value="false"/>
<param name="viz_pub_rate" value="5"/>
"""
INCLUDE = '<include file="$(find flatland_server)/launch/server.launch">'
SPAWN = """
<node name="spawn" pkg="rosservice" type="rosservice"
      args="call --wait spawn_model &quot;{yaml_path: 'ball.model.yaml', name: 'ball0', ns: '',
            pose: {x: $(arg x), y: 1.0, theta: 0.0}}&quot;"/>
"""


@dataclass(frozen=True)
class Form:
    """A launch file, which is loaded into a namespace of its own.

    Attributes:
        name: Namespace.
        text: Content of `<launch>`, without the namespace.
        parameters: Some of the expected parameters of the server.
        others: Names of the other nodes of the launch file.
    """

    name: str
    text: str
    parameters: dict[str, object] = field(default_factory=dict)
    others: tuple[str, ...] = ()


FORMS = (
    Form(
        "node_with_remaps_and_parameters_of_a_fork",
        f"""
        <arg name="tf_prefix" default="burger"/>
        <arg name="train_mode" default="false"/>
        <node name="flatland_server" pkg="flatland_server" type="flatland_server" output="screen">
          {PARAMETERS}
          <param name="map_file" value="/maps/map.yaml"/>
          <param name="train_mode" value="$(arg train_mode)"/>
          <remap from="scan" to="/$(arg tf_prefix)/scan"/>
          <remap from="/clock" to="/$(arg tf_prefix)/clock"/>
          <remap from="/step_world" to="/$(arg tf_prefix)/step_world"/>
        </node>
        """,
        {
            "train_mode": False,
            "update_rate": 20,
            "step_size": 0.05,
            "show_viz": False,
            "viz_pub_rate": 5,
        },
    ),
    Form(
        "include_with_a_world",
        f"""
        {INCLUDE}
          <arg name="world_path" value="$(arg world)"/>
        </include>
        """,
        {
            "update_rate": 200.0,
            "step_size": 0.005,
            "show_viz": True,
            "viz_pub_rate": 30.0,
            "msgs_package": "flatland_msgs",
        },
        others=("flatland_viz",),
    ),
    Form(
        "include_with_all_arguments_and_spawn",
        f"""
        <arg name="x" default="2.0"/>
        {INCLUDE}
          <arg name="world_path" value="$(arg world)"/>
          <arg name="update_rate" value="20.0"/>
          <arg name="step_size" value="0.05"/>
          <arg name="show_viz" value="true"/>
          <arg name="viz_pub_rate" value="10.0"/>
          <arg name="use_rviz" value="true"/>
        </include>
        <!-- Its own RViz. -->
        <node name="rviz" pkg="rostopic" type="rostopic" args="list"/>
        {SPAWN}
        """,
        {"update_rate": 20.0, "step_size": 0.05, "show_viz": True, "viz_pub_rate": 10.0},
        others=("rviz", "spawn"),
    ),
    Form(
        "include_with_expressions",
        f"""
        <arg name="use_flatland_viz" default="false"/>
        <arg name="use_rviz" default="$(eval not arg('use_flatland_viz'))"/>
        {INCLUDE}
          <arg name="world_path" value="$(arg world)"/>
          <arg name="show_viz" value="$(eval arg('use_flatland_viz') or arg('use_rviz'))"/>
          <arg name="use_rviz" value="$(arg use_rviz)"/>
          <arg name="viz_pub_rate" value="30.0"/>
          <arg name="update_rate" value="20.0"/>
        </include>
        """,
        {"show_viz": True},
    ),
    Form(
        "viewers",
        f"""
        <arg name="use_rviz" default="false"/>
        <node name="flatland_server" pkg="flatland_server" type="flatland_server">
        {PARAMETERS}
        </node>
        <node pkg="flatland_viz" name="flatland_viz" type="flatland_viz" output="screen"
              unless="$(arg use_rviz)"/>
        <group ns="second">
          <node name="flatland_viz" pkg="flatland_viz" type="flatland_viz" required="false"/>
        </group>
        """,
        others=("flatland_viz", "second/flatland_viz"),
    ),
)


# Forms whose nodes are started: with remapped topics, and with an include that has all arguments.
# The others differ in what roslaunch reads.
STARTED = FORMS[0], FORMS[2]


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    return write_world("[{name: robot, model: robot.model.yaml}]")


@pytest.fixture(scope="module")
def files(world: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A launch file for each form, in a namespace."""
    folder = tmp_path_factory.mktemp("launch")
    paths = {}
    for form in FORMS:
        paths[form.name] = folder / f"{form.name}.launch"
        group = f'<group ns="{form.name}">\n{textwrap.dedent(form.text)}</group>\n'
        text = f'<launch>\n<arg name="world" default="{world}"/>\n{group}</launch>\n'
        paths[form.name].write_text(text)
    return paths


@pytest.fixture(scope="module")
def launched(module_launcher: Any, files: dict[str, Path]) -> Any:
    """One roslaunch of several forms."""
    return module_launcher.launch(*(str(files[form.name]) for form in STARTED))


@pytest.fixture(scope="module")
def config(files: dict[str, Path], ros_environment: dict[str, str]) -> Any:
    """What roslaunch reads from all forms."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_PACKAGE_PATH", ros_environment["ROS_PACKAGE_PATH"])
        given = [(str(path), []) for path in files.values()]
        return roslaunch.config.load_config_default(given, None, verbose=False)


@pytest.mark.parametrize("form", FORMS, ids=[form.name for form in FORMS])
def test_launch_files_of_the_reference_are_read_unedited(
    config: Any, ros_environment: dict[str, str], form: Form
) -> None:
    nodes = {node.namespace + node.name: node for node in config.nodes}
    packages = rospkg.RosPack(ros_environment["ROS_PACKAGE_PATH"].split(":"))
    for name in ("flatland_server", *form.others):
        node = nodes[f"/{form.name}/{name}"]
        assert roslib.packages.find_node(node.package, node.type, packages), node.type
    given = {name: param.value for name, param in config.params.items()}
    found = {name: given[f"/{form.name}/flatland_server/{name}"] for name in form.parameters}
    assert found == form.parameters
    assert not config.config_errors


@pytest.mark.parametrize("form", STARTED, ids=[form.name for form in STARTED])
def test_launch_files_of_the_reference_start(
    launched: Any, module_ros: Any, eventually: Any, form: Form
) -> None:
    master = module_ros.master

    def is_ready() -> bool:
        if not launched.running:
            pytest.fail(launched.output)
        names = {name for name, _nodes in master.getSystemState()[2]}
        return f"/{form.name}/toggle_pause" in names

    eventually(f"services of {form.name}", is_ready)
    assert master.lookupNode(f"/{form.name}/flatland_server")
    for name in form.others:
        launched.wait_for_line(rf"process\[{form.name}/{name}-\d+\]: started")
    types = {
        rosservice.get_service_type(f"/{form.name}/{name}_model")
        for name in ("spawn", "move", "delete")
    }
    assert types == {f"flatland_msgs/{name}Model" for name in ("Spawn", "Move", "Delete")}


def test_spawning_by_a_node_of_the_launch_file(launched: Any, module_ros: Any) -> None:
    launched.wait_for_line(r"include_with_all_arguments_and_spawn/spawn-\d+. process has finished")
    service = "/include_with_all_arguments_and_spawn/move_model"
    assert module_ros.call(service, services.MoveModel, "ball0", Pose2D(0, 0, 0)).success


def test_remapped_clock_of_the_launch_file(launched: Any, module_ros: Any) -> None:
    del launched
    assert module_ros.topic("/burger/clock", Clock).take(2)
    assert module_ros.topic("/burger/scan", LaserScan).next().ranges


@pytest.mark.parametrize(
    ("file", "defaults"),
    [
        (
            "server.launch",
            {
                "update_rate": "200.0",
                "step_size": "0.005",
                "show_viz": "true",
                "viz_pub_rate": "30.0",
                "use_rviz": "false",
            },
        ),
        (
            "benchmark.launch",
            {
                "update_rate": "200.0",
                "step_size": "0.005",
                "benchmark_duration": "60.0",
                "use_perf": "false",
                "show_viz": "true",
                "simplify_map": "2",
            },
        ),
    ],
)
def test_arguments_and_defaults_of_the_reference(
    checkout: Path, file: str, defaults: dict[str, str]
) -> None:
    path = checkout / "compat" / "flatland_server" / "launch" / file
    arguments = {
        element.get("name"): element.get("default")
        for element in ElementTree.parse(path).getroot().findall("arg")
        if element.get("value") is None
    }
    assert arguments.pop("world_path")
    assert arguments == defaults


def test_perf_records_the_benchmark_on_request(
    ros_environment: dict[str, str], checkout: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_PACKAGE_PATH", ros_environment["ROS_PACKAGE_PATH"])
    path = checkout / "compat" / "flatland_server" / "launch" / "benchmark.launch"
    for given, prefix in (("false", None), ("true", "perf record --call-graph dwarf")):
        files = [(str(path), [f"use_perf:={given}", "simplify_map:=1"])]
        config = roslaunch.config.load_config_default(files, None, verbose=False)
        [node] = config.nodes
        assert (node.package, node.type) == ("flatland_server", "flatland_server")
        assert config.params["/flatland_benchmark/simplify_map"].value == 1
        assert (node.launch_prefix or None) == prefix or node.launch_prefix.startswith(prefix)


def test_no_form_causes_an_error(launched: Any) -> None:
    assert [line for line in launched.lines if "FATAL" in line or "ERROR" in line] == []
