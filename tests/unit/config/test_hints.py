"""Hints for frequent mistakes, and the places of errors."""

from __future__ import annotations

from pathlib import Path

import pytest

from flatland.config import hints


@pytest.mark.parametrize(
    ("text", "kind", "hint"),
    [
        ("0,5", "float", "decimals are written with a point: 0.5"),
        ("-1,25", "float", "decimals are written with a point: -1.25"),
        ("90deg", "float", "angles are in radians: $eval math.rad(90)"),
        ("-45 °", "float", "angles are in radians: $eval math.rad(-45)"),
        ("5m", "float", "numbers are written without a unit: 5"),
        ("10 Hz", "float", "numbers are written without a unit: 10"),
        ("10.0", "int", "a whole number without a point is required, such as 10"),
        ("pi/2", "float", "expressions start with $eval: $eval pi/2"),
        ("maybe", "bool", "true or false"),
        ("fast", "float", ""),
        ("", "vector", "two numbers are written as [x, y]"),
    ],
)
def test_conversion(text, kind, hint):
    assert hints.conversion(text, kind) == hint


@pytest.mark.parametrize(
    ("key", "known", "part"),
    [
        ("colour", ["color", "pose"], 'did you mean "color"?'),
        ("Density", ["density"], 'did you mean "density"?'),
        ("mass", ["pose"], "density"),
        ("xyz", ["pose", "color"], "other keys that are known here: color, pose"),
        ("5", ["pose"], "decimals"),
        ("xyz", [], ""),
    ],
)
def test_unknown_keys(key, known, part):
    hint = hints.unknown_key(key, known)
    assert part in hint
    assert bool(part) == bool(hint)


def test_missing_keys():
    assert hints.missing_key("radius", {"raduis": 7}) == (
        '"raduis" in line 7 may be a misspelling of "radius"'
    )
    assert "properties: {}" in hints.missing_key("properties", {"layers": 1})
    assert hints.missing_key("body", {}) == ""


def test_choices():
    assert hints.choice("fixed", ["weld", "revolute"]) == 'did you mean "weld"?'
    assert hints.choice("box", ["circle", "polygon"]) == 'did you mean "polygon"?'
    assert hints.choice("box", ["weld", "revolute"]) == ""
    assert hints.choice("dinamic", ["static", "dynamic"]) == 'did you mean "dynamic"?'


@pytest.mark.parametrize(
    ("word", "hint"),
    [
        ("odom_pubb", 'did you mean "odom_pub"?'),  # a typing mistake: no others
        ("twist_topic", 'did you mean "twist_pub" or "twist_sub"?'),
        ("xyz", "keys: odom_pub, twist_sub, twist_pub"),
    ],
)
def test_near_names(word: str, hint: str) -> None:
    known = ["odom_pub", "twist_sub", "twist_pub"]
    assert hints.did_you_mean(word, known, "keys") == hint


def test_no_names() -> None:
    assert hints.did_you_mean("a", [], "layers of the world") == "layers of the world: none"


def test_similar_files(tmp_path: Path):
    (tmp_path / "room.yaml").touch()
    assert hints.similar_file(str(tmp_path / "rom.yaml")) == 'did you mean "room.yaml"?'
    assert hints.similar_file(str(tmp_path / "room.yaml")) == ""
    folder = tmp_path / "no"
    assert hints.similar_file(str(folder / "a")) == f'the folder "{folder}" does not exist'
    assert hints.similar_file("\0") == ""
