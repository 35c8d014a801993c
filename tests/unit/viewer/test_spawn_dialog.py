"""Default names of spawned models."""

from __future__ import annotations

import pytest

pytest.importorskip("PyQt5.QtWidgets", reason="PyQt5 is not installed")

from flatland.viewer.spawn_dialog import numbered_name, suggested_name


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
def test_suggested_name_is_derived_from_the_file_name(path: str, name: str) -> None:
    assert suggested_name(path) == name


def test_numbered_name_uses_the_lowest_free_number() -> None:
    assert numbered_name("box", []) == "box1"
    assert numbered_name("box", {"box", "box1", "box2", "box4"}) == "box3"
