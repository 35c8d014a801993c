"""The parameters of the node, in its own namespace and in outer ones."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("rospy", reason="ROS is not installed")

import rospy

from flatland.ros.parameter_server import ParameterServer


class Parameters:
    """Parameters by name, and what an outer namespace has."""

    def __init__(self, private: Any, outer: dict[str, Any], use_sim_time: Any = None) -> None:
        self.values = {"~": private, "/use_sim_time": use_sim_time}
        self.outer = outer

    def get(self, name: str, default: Any) -> Any:
        value = self.values.get(name, self.outer.get(name))
        return default if value is None else value

    def search(self, name: str) -> str | None:
        return f"/outer/{name}" if f"/outer/{name}" in self.outer else None


@pytest.fixture
def read(monkeypatch: pytest.MonkeyPatch) -> Any:
    def read(private: Any, outer: dict[str, Any], use_sim_time: Any = None) -> ParameterServer:
        parameters = Parameters(private, outer, use_sim_time)
        monkeypatch.setattr(rospy, "get_param", parameters.get)
        monkeypatch.setattr(rospy, "search_param", parameters.search)
        monkeypatch.setattr(rospy, "resolve_name", lambda name: name.replace("~", "/node/"))
        return ParameterServer()

    return read


OUTER = {"/outer/simplify_map": 2, "/outer/world_path": "outer.yaml", "/outer/step_size": 0.1}


def test_private_parameters_come_first_and_few_are_searched_for(read: Any) -> None:
    server = read({"world_path": "w.yaml", "lockstep": False}, OUTER, True)
    assert server.use_sim_time is True
    assert server.get("world_path") == "w.yaml"
    assert server.get("lockstep") is False
    assert server.get("simplify_map") == 2
    # With a private path, the parameters of forks are not searched for.
    assert server.get("step_size") is None
    assert server.get("seed") is None
    assert server.found() == {
        "/node/world_path": "w.yaml",
        "/node/lockstep": False,
        "/use_sim_time": True,
    }


def test_parameters_of_launch_files_of_forks_are_searched_for(read: Any) -> None:
    server = read({"simplify_map": 1}, {**OUTER, "/outer/seed": 3})
    assert server.get("world_path") == "outer.yaml"
    assert server.get("step_size") == 0.1
    assert server.get("simplify_map") == 1
    assert server.get("update_rate") is None
    assert server.get("seed") is None
    assert server.use_sim_time is None
    assert server.found() == {"/node/simplify_map": 1}


def test_a_value_with_the_name_of_the_node_is_no_namespace(read: Any) -> None:
    server = read(5, {}, False)
    assert server.get("seed") is None
    assert server.found() == {"/use_sim_time": False}
