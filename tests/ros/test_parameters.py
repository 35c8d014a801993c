"""The node's parameters: defaults, what is accepted, what is refused and how."""

from __future__ import annotations

import math
from typing import Any

import pytest

from flatland.ros.parameters import NodeParameters, ParameterError, read_parameters


def read(**given: Any) -> NodeParameters:
    return read_parameters({"world_path": "world.yaml", **given}.get)


def test_defaults() -> None:
    assert read() == NodeParameters(
        world_path="world.yaml",
        update_rate=200.0,
        step_size=0.005,
        show_viz=False,
        viz_pub_rate=30.0,
        simplify_map=0,
        seed=None,
        benchmark_duration=None,
    )


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("update_rate", 0, 0.0),
        ("update_rate", math.inf, 0.0),
        ("update_rate", "inf", 0.0),  # roslaunch hands it over as text
        ("update_rate", "1e3", 1000.0),
        ("update_rate", 0.5, 0.5),
        ("step_size", 1, 1.0),
        ("step_size", "1e-3", 0.001),
        ("show_viz", True, True),
        ("show_viz", "True", True),
        ("show_viz", "false", False),
        ("viz_pub_rate", 10, 10.0),
        ("simplify_map", 2, 2),
        ("simplify_map", "1", 1),
        ("seed", 0, 0),
        ("seed", "12345678901", 12345678901),  # too great for XML-RPC
        ("benchmark_duration", 2.5, 2.5),
    ],
)
def test_accepted(name: str, value: object, expected: object) -> None:
    got = getattr(read(**{name: value}), name)
    assert got == expected
    assert type(got) is type(expected)


@pytest.mark.parametrize("name", ["update_rate", "step_size", "viz_pub_rate", "benchmark_duration"])
@pytest.mark.parametrize("value", [math.nan, "nan", -1, -1e-300, "fast", "", True, [1], {"a": 1}])
def test_refused_numbers(name: str, value: object) -> None:
    with pytest.raises(ParameterError) as error:
        read(**{name: value})
    assert str(error.value).startswith(f'Invalid parameter "~{name}": it must be ')
    assert f"got {float(value) if value in (-1, -1e-300) else value!r}" in str(error.value)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("step_size", 0),
        ("step_size", math.inf),
        ("step_size", 1e-10),
        ("step_size", 10**400),
        ("viz_pub_rate", 0),
        ("benchmark_duration", 0),
        ("show_viz", 1),
        ("show_viz", "yes"),
        ("simplify_map", 3),
        ("simplify_map", -1),
        ("simplify_map", 1.0),
        ("simplify_map", True),
        ("seed", -1),
        ("seed", 1.5),
        ("seed", "a"),
        ("seed", False),
        ("world_path", 5),
        ("world_path", ["a"]),
    ],
)
def test_refused_values(name: str, value: object) -> None:
    with pytest.raises(ParameterError, match=f'Invalid parameter "~{name}": it must be '):
        read(**{name: value})


@pytest.mark.parametrize("path", [None, ""])
def test_world_path_is_required(path: str | None) -> None:
    with pytest.raises(ParameterError, match=r"^No world_path parameter given!$"):
        read(world_path=path)
