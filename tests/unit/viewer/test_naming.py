"""Names of spawned models."""

from __future__ import annotations

import pytest

from flatland.viewer.naming import model_name, numbered


@pytest.mark.parametrize(
    ("path", "name"),
    [
        ("/robots/diff_robot.model.yaml", "diff_robot_model"),
        ("chair.yaml", "chair"),
        ("chair", "chair"),
        ("my robot-2.v1.yaml", "my_robot_2_v1"),
        ("4wheels.yaml", "m4wheels"),
        ("_x.yaml", "m_x"),
        ("bücher.yaml", "b_cher"),
        ("", ""),
    ],
)
def test_name_comes_from_the_file(path: str, name: str) -> None:
    assert model_name(path) == name


def test_number_is_the_lowest_that_is_free() -> None:
    assert numbered("box", []) == "box1"
    assert numbered("box", {"box", "box1", "box2", "box4"}) == "box3"
