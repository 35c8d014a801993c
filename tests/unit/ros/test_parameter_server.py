"""The parameters of the node, in its own namespace and in outer ones."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("rospy", reason="ROS is not installed")

import rospy

from flatland.ros.parameter_server import ParameterServer

OUTER = {"/simplify_map": 2, "/world_path": "outer.yaml", "/step_size": 0.1, "/seed": 3}


def read(private: object, outer: dict[str, object]) -> ParameterServer:
    for name, value in {rospy.get_name(): private, **outer}.items():
        rospy.set_param(name, value)
    return ParameterServer()


def test_private_parameters_come_first_and_few_are_searched_for(master: Any) -> None:
    server = read({"world_path": "w.yaml", "lockstep": False}, {**OUTER, "/use_sim_time": True})
    assert server.use_sim_time is True
    assert server.get("world_path") == "w.yaml"
    assert server.get("lockstep") is False
    assert server.get("simplify_map") == 2
    # With a private path, the parameters of forks are not searched for.
    assert server.get("step_size") is None
    assert server.get("seed") is None
    assert server.found() == {
        rospy.resolve_name("~world_path"): "w.yaml",
        rospy.resolve_name("~lockstep"): False,
        "/use_sim_time": True,
    }


def test_parameters_of_launch_files_of_forks_are_searched_for(master: Any) -> None:
    server = read({"simplify_map": 1}, OUTER)
    assert server.get("world_path") == "outer.yaml"
    assert server.get("step_size") == 0.1
    assert server.get("simplify_map") == 1
    assert server.get("update_rate") is None
    assert server.get("seed") is None
    assert server.use_sim_time is None
    assert server.found() == {rospy.resolve_name("~simplify_map"): 1}


def test_a_value_with_the_name_of_the_node_is_no_namespace(master: Any) -> None:
    server = read(5, {"/use_sim_time": False})
    assert server.get("seed") is None
    assert server.found() == {"/use_sim_time": False}
