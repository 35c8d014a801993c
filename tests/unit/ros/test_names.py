"""Legal ROS names for things that may be called anything."""

from __future__ import annotations

import pytest

from flatland.ros.names import UniqueNames, legal_name, sendable_text


@pytest.mark.parametrize("name", ["2d", "robot1", "a/b", "_", "A_3d"])
def test_legal_names_stay(name: str) -> None:
    assert legal_name(name) == name


@pytest.mark.parametrize(
    ("name", "legal"),
    [
        ("my robot-1", "my_robot_1"),
        ("a//b/", "a/b"),
        ("/a", "a"),
        ("", "_"),
        ("///", "_"),
        ("Größe", "Gr__e"),  # roscpp takes no letters beyond ASCII
        ("robot\n", "robot_"),
        ("~x{}", "_x__"),
    ],
)
def test_other_names_are_made_legal(name: str, legal: str) -> None:
    assert legal_name(name) == legal


def test_claimed_names_are_unique() -> None:
    names = UniqueNames()
    claimed = [names.claim(wanted) for wanted in ("a", "a", "a_2", "a", "b")]
    assert claimed == ["a", "a_2", "a_2_2", "a_3", "b"]


def test_released_names_are_free_again() -> None:
    names = UniqueNames()
    assert [names.claim("a"), names.claim("a")] == ["a", "a_2"]
    names.release("a")
    assert names.claim("a") == "a"


def test_text_that_utf8_cannot_hold() -> None:
    assert sendable_text("Größe 1") == "Größe 1"
    assert sendable_text("a\ud800b") == "a?b"
