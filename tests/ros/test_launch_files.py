"""The arguments of the launch files; roslaunch reads the files in this process and starts nothing.

`test_start.py`, `test_benchmark.py` and others start them.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest
import roslib.packages

from flatland.node.parameters import NodeParameters, read_parameters

# Not the default of any parameter.
VALUES: dict[str, object] = {
    "update_rate": 100.0,
    "max_lag": 0.5,
    "step_size": 0.01,
    "lockstep": True,
    "viz_pub_rate": 7.0,
    "web": True,
    "web_host": "0.0.0.0",
    "web_port": 0,
    "web_token": "secret",
    "web_view_token": "other secret",
    "web_read_only": True,
    "simplify_map": 1,
    "seed": 7,
    "plugin_timeout": 5.0,
    "shutdown_timeout": 6.0,
    "if_blocked": "refuse",
    "move_keeps_odometry": True,
    "initialpose_model": "007",
    "publish_map": "2d",
    "model_path": "/usr",
    "record": "/tmp/a.flog",
    "record_mcap": "/tmp/a.mcap",
    "use_sim_time": False,
    "clock_rate": 20,
    "model_states_rate": 10,
}
# Set by the package, in which no map can be published, or by the benchmark.
NOT_ARGUMENTS = {"benchmark_duration", "map_frame", "map_resolution"}


def parameters(package: str, *arguments: str) -> dict[str, Any]:
    """Returns the parameters of the node that `server.launch` of a package sets."""
    # It imports setuptools, and each process of the tests imports this module.
    import roslaunch

    (file,) = roslib.packages.find_resource(package, "server.launch")
    given = [(file, ["world_path:=/a/world.yaml", "show_viz:=false", *arguments])]
    config = roslaunch.config.load_config_default(given, None, assign_machines=False)
    assert config.config_errors == []
    return {
        name.removeprefix("/flatland_server/"): parameter.value
        for name, parameter in config.params.items()
        if name.startswith("/flatland_server/")
    }


@pytest.mark.parametrize("package", ["flatland", "flatland_server"])
def test_arguments_are_parameters_of_the_node(ros: Any, package: str) -> None:
    del ros
    found = parameters(package, *(f"{name}:={value}" for name, value in VALUES.items()))
    expected = {"world_path": "/a/world.yaml", "show_viz": False, **VALUES}
    expected["msgs_package"] = "flatland" if package == "flatland" else "flatland_msgs"
    assert found == expected


def test_defaults_are_those_of_the_node(ros: Any) -> None:
    del ros
    found = read_parameters(parameters("flatland").get)
    expected = {"world_path": "/a/world.yaml", "show_viz": False}
    assert found == read_parameters(expected.get)


def test_every_parameter_has_an_argument() -> None:
    names = {field.name for field in dataclasses.fields(NodeParameters)}
    assert names == VALUES.keys() | {"world_path", "show_viz", "msgs_package"} | NOT_ARGUMENTS
