"""Conversion of arbitrary names to legal, unique ROS names."""

from __future__ import annotations

import pytest

from flatland.node.names import UniqueNames, legal_name, sendable_text


@pytest.mark.parametrize("name", ["2d", "robot1", "a/b", "_", "A_3d"])
def test_legal_names_are_unchanged(name: str) -> None:
    assert legal_name(name) == name


@pytest.mark.parametrize(
    ("name", "legal"),
    [
        ("my robot-1", "my_robot_1"),
        ("a//b/", "a/b"),
        ("/a", "a"),
        ("", "_"),
        ("///", "_"),
        ("Größe", "Gr__e"),  # roscpp accepts only ASCII letters
        ("robot\n", "robot_"),
        ("~x{}", "_x__"),
    ],
)
def test_illegal_names_are_converted(name: str, legal: str) -> None:
    assert legal_name(name) == legal


def test_claimed_names_are_unique() -> None:
    names = UniqueNames()
    claimed = [names.claim(preferred) for preferred in ("a", "a", "a_2", "a", "b")]
    assert claimed == ["a", "a_2", "a_2_2", "a_3", "b"]


def test_released_name_can_be_claimed_again() -> None:
    names = UniqueNames()
    assert [names.claim("a"), names.claim("a")] == ["a", "a_2"]
    names.release("a")
    assert names.claim("a") == "a"


def test_text_that_cannot_be_encoded_as_utf8() -> None:
    assert sendable_text("Größe 1") == "Größe 1"
    assert sendable_text("a\ud800b") == "a?b"
