"""The parameters of the node: defaults, accepted values and errors."""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
import math
from pathlib import Path
from typing import Any

import pytest

from flatland.node.parameters import (
    NodeParameters,
    ParameterError,
    TeleopParameters,
    read_parameters,
    read_table,
)


def read(**given: Any) -> NodeParameters:
    return read_parameters({"world_path": "world.yaml", **given}.get)


def test_defaults() -> None:
    assert read() == NodeParameters(
        world_path="world.yaml",
        update_rate=200.0,
        max_lag=0.1,
        step_size=0.005,
        lockstep=False,
        show_viz=False,
        viz_pub_rate=30.0,
        simplify_map=0,
        seed=None,
        benchmark_duration=None,
        plugin_timeout=60.0,
        shutdown_timeout=2.0,
        if_blocked="warn",
        move_keeps_odometry=False,
        initialpose_model="",
        record="",
        record_mcap="",
        use_sim_time=True,
        clock_rate=0.0,
        model_states_rate=50.0,
        publish_map="",
        map_frame="map",
        map_resolution=0.05,
        msgs_package="flatland",
        model_path=None,
        web=False,
        web_host="127.0.0.1",
        web_port=8000,
        web_token=None,
        web_view_token=None,
        web_read_only=False,
    )


VALID: dict[str, list[tuple[object, object]]] = {
    # roslaunch passes inf as text, and seeds that are too large for XML-RPC.
    "update_rate": [(0, 0.0), (math.inf, 0.0), ("inf", 0.0), ("1e3", 1000.0), (0.5, 0.5)],
    "max_lag": [(0, 0.0), ("0.5", 0.5)],
    "step_size": [(1, 1.0), ("1e-3", 0.001), ("1e-6", 1e-6), (1000, 1000.0)],
    "show_viz": [(True, True), ("True", True), ("false", False)],
    "viz_pub_rate": [(10, 10.0)],
    "simplify_map": [(2, 2), ("1", 1)],
    "seed": [(0, 0), ("12345678901", 12345678901)],
    "benchmark_duration": [(2.5, 2.5)],
    "plugin_timeout": [(2, 2.0), ("0.5", 0.5), (math.inf, None), ("inf", None)],
    "shutdown_timeout": [("0.5", 0.5), (math.inf, None)],
    "if_blocked": [("allow", "allow"), ("nearest", "nearest")],
    "move_keeps_odometry": [(True, True), ("true", True)],
    "initialpose_model": [("robot", "robot"), (7, "7"), (" ", "")],
    "record": [
        ("/tmp/a.flog", "/tmp/a.flog"),
        (" ", ""),
        ("a.flog", str(Path("a.flog").absolute())),
    ],
    "record_mcap": [
        ("/tmp/a.mcap", "/tmp/a.mcap"),
        ("~/a.mcap", str(Path("~/a.mcap").expanduser())),
    ],
    "use_sim_time": [(False, False), ("true", True)],
    "clock_rate": [(100, 100.0), ("inf", 0.0)],
    "publish_map": [("walls", "walls"), ("", ""), (" ", ""), (2, "2"), (False, None)],
    "map_frame": [("r1/map", "r1/map"), ("/map", "map")],
    "map_resolution": [("0.1", 0.1), (1, 1.0)],
    "msgs_package": [("flatland", "flatland"), ("flatland_msgs", "flatland_msgs")],
    "web": [("true", True)],
    "web_host": [("0.0.0.0", "0.0.0.0"), (" ", "127.0.0.1")],
    "web_port": [("0", 0)],
    "web_token": [(7, "7"), (" ", None)],
    "web_view_token": [("a token", "a token")],
    "web_read_only": [(True, True)],
    "model_path": [
        (" ", None),
        ("/usr:/tmp", ("/usr", "/tmp")),
        (["/usr", "/tmp"], ("/usr", "/tmp")),
    ],
}


def test_defaults_of_the_keyboard() -> None:
    assert read_table(TeleopParameters, {}.get) == TeleopParameters(
        max_linear=1.0, max_angular=2.0, rate=20.0, repeat_delay=0.6, key_timeout=0.2
    )


def test_valid_values() -> None:
    for name, values in VALID.items():
        for value, expected in values:
            got = getattr(read(**{name: value}), name)
            assert (got, type(got)) == (expected, type(expected)), (name, value)


def error_of(name: str, value: object) -> str:
    """Returns what is wrong with a value of a parameter."""
    try:
        read(**{name: value})
    except ParameterError as error:
        start, _, text = str(error).partition(": ")
        assert start == f'Invalid parameter "~{name}"'
        return text
    return "nothing"


NUMBERS = (
    *("update_rate", "max_lag", "step_size", "viz_pub_rate", "benchmark_duration"),
    *("plugin_timeout", "shutdown_timeout", "clock_rate", "model_states_rate", "map_resolution"),
)


def test_invalid_numbers() -> None:
    invalid: list[Any] = [math.nan, "nan", -1, -1e-300, "fast", "", True, [1], {"a": 1}]
    for name, value in itertools.product(NUMBERS, invalid):
        error = error_of(name, value)
        assert error.startswith("it must be "), (name, value)
        assert f"got {float(value) if value in (-1, -1e-300) else value!r}" in error


INVALID: dict[str, list[Any]] = {
    "max_lag": [math.inf, "inf"],
    "step_size": [0, math.inf, 1e-10, 0.9e-6, 1001, 10**400],
    "viz_pub_rate": [0],
    "map_resolution": [0, math.inf],
    "map_frame": ["", "/", 1],
    "publish_map": [True, 1.5, ["walls"]],
    "benchmark_duration": [0],
    "plugin_timeout": [0],
    "shutdown_timeout": [0],
    "show_viz": [1, "yes"],
    "lockstep": [1, "on"],
    "simplify_map": [3, -1, 1.0, True],
    "seed": [-1, 1.5, "a", False],
    "use_sim_time": ["maybe"],
    "if_blocked": ["stop", "", True, ["warn"]],
    "move_keeps_odometry": [1],
    "initialpose_model": [True, ["robot"], 1.5],
    "record": [1],
    "record_mcap": [["a"]],
    "msgs_package": ["std_msgs", "", True, ["flatland"]],
    "world_path": [5, ["a"]],
    "model_path": [
        "relative/path",
        "/nowhere/at/all",
        "/usr:",
        "/etc/passwd",
        [],
        [""],
        ["/usr", 1],
        True,
        {"a": "/usr"},
    ],
    "web": ["yes"],
    "web_host": [True],
    "web_port": [-1, 65536, "http", 80.5],
    "web_token": [["a"]],
    "web_read_only": [1],
}


def test_invalid_values() -> None:
    for name, values in INVALID.items():
        for value in values:
            error = error_of(name, value)
            assert error.startswith("it must be "), (name, value)
            shown = {repr(value)}
            with contextlib.suppress(TypeError, ValueError, OverflowError):
                shown.add(repr(float(value)))
            assert error.rpartition(", got ")[2] in shown, (name, error)


def test_the_choices_are_named() -> None:
    text = "it must be one of allow, warn, refuse, nearest, got 'Warn'"
    assert error_of("if_blocked", "Warn") == text


def test_lockstep_excludes_a_benchmark() -> None:
    with pytest.raises(ParameterError, match=r'Invalid parameter "~lockstep": it must be false'):
        read(lockstep=True, benchmark_duration=1)


def test_empty_seed_is_no_seed() -> None:
    assert read(seed="").seed is None


@pytest.mark.parametrize("path", [None, ""])
def test_world_path_is_required(path: str | None) -> None:
    with pytest.raises(ParameterError, match=r"^No world_path parameter given!$"):
        read(world_path=path)


def test_every_parameter_has_a_meaning_for_those_who_list_them() -> None:
    for field in dataclasses.fields(NodeParameters):
        assert field.metadata["meaning"].endswith("."), field.name


@pytest.mark.parametrize(
    "field",
    [field for field in dataclasses.fields(NodeParameters) if field.metadata["limits"]],
    ids=lambda field: str(field.name),
)
def test_limits_are_those_of_the_values_that_are_accepted(field: Any) -> None:
    """Tools of ROS 2 show them; only open ends are accepted neither by them nor by the reader."""
    low, high = field.metadata["limits"]
    above = low + (1 if isinstance(low, int) else 1e-3)
    field.metadata["read"](above)
    assert above <= high
    assert math.isinf(high) or high < 2**63, "ROS 2 has integers of 64 bits"
    with pytest.raises(ParameterError):
        read(**{field.name: low - 1})
    if high < 2**63 - 1:
        field.metadata["read"](high)
        with pytest.raises(ParameterError):
            read(**{field.name: high + 1})
