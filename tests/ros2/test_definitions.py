"""The definitions of messages and services: those of ROS 1 by the rules of ROS 2."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest
from rosidl_adapter.parser import parse_message_file, parse_service_file

CHECKOUT = Path(__file__).resolve().parents[2]
PACKAGE = CHECKOUT / "ros2" / "flatland_msgs"
DEFINITIONS = sorted([*CHECKOUT.glob("msg/*.msg"), *CHECKOUT.glob("srv/*.srv")])
ONLY_ROS_2 = {"ChangeRate.srv"}
CHANGED = {"Collision.msg", "StepWorld.srv"}


def fields(text: str) -> list[str]:
    """Returns the lines of a definition without comments, in the terms of ROS 2."""
    lines = (re.sub(" +", " ", line.partition("#")[0].strip()) for line in text.splitlines())
    terms = {"time ": "builtin_interfaces/Time ", "_A": "_a", "_B": "_b"}
    found = []
    for line in filter(None, lines):
        for old, new in terms.items():
            line = line.replace(old, new)
        found.append(line)
    return found


@pytest.mark.parametrize("path", DEFINITIONS, ids=lambda path: path.name)
def test_definitions_equal_those_of_ros_1(path: Path) -> None:
    own = PACKAGE / path.parent.name / path.name
    assert own.is_symlink() == (path.name not in CHANGED)
    assert fields(own.read_text()) == fields(path.read_text())


def test_all_definitions_are_legal_and_generated() -> None:
    names = {path.name for path in DEFINITIONS}
    found = [*PACKAGE.glob("msg/*.msg"), *PACKAGE.glob("srv/*.srv")]
    assert {path.name for path in found} == names | ONLY_ROS_2
    for path in found:
        parse = parse_message_file if path.suffix == ".msg" else parse_service_file
        parse("flatland_msgs", str(path))
        module = importlib.import_module(f"flatland_msgs.{path.parent.name}")
        assert hasattr(module, path.stem)
