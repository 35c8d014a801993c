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
        ("pi/2", "float", "expressions start with $eval: $eval math.pi/2"),
        ("math.sqrt(2) * 3", "float", "expressions start with $eval: $eval math.sqrt(2) * 3"),
        ("1/2", "int", "expressions start with $eval: $eval 1/2"),
        (
            "${pi/4}",
            "float",
            "expressions of xacro and of launch files are not evaluated here; use "
            "$eval: $eval math.pi/4",
        ),
        (
            "$(arg r)",
            "float",
            "expressions of xacro and of launch files are not evaluated here; use "
            '$eval, such as $eval param("/name", 1)',
        ),
        ("5cm", "float", "numbers are written without a unit: 0.05"),
        ("36 km/h", "float", "numbers are written without a unit: 10"),
        ("3 feet", "float", "numbers are written without a unit, but in SI units"),
        ("90 deg/s", "float", "angular velocities are in rad/s: $eval math.rad(90)"),
        ("-nan", "float", "nan is the result of an invalid computation, such as 0/0"),
        ("-1.#IND", "float", "nan is the result of an invalid computation, such as 0/0"),
        ("-Infinity", "float", "infinity is written -.inf"),
        ("front-left", "float", ""),
        ("1 +", "float", ""),
        ("9" * 10_000 + "+", "float", ""),
        ("maybe", "bool", "true or false"),
        ("fast", "float", ""),
        ("", "vector", "two numbers are written as [x, y]"),
    ],
)
def test_conversion(text, kind, hint):
    assert hints.conversion(text, kind) == hint


def test_the_angle_of_a_map_of_map_saver():
    hint = hints.conversion("-nan", "float", 'layer "walls" "origin"')
    assert hint.startswith("map_saver writes nan if the orientation of the map is not a valid")
    pose = (1.0, 2.0, float("nan"))
    assert hints.unmet_limit(pose, "pose", 'layer "walls" "origin"') == hint
    assert hints.unmet_limit(pose, "pose", 'model "robot" "pose"') == ""


@pytest.mark.parametrize(
    ("angle", "radians"),
    [(90, 1.5708), (-180, -3.14159), (22.5, 0.392699), (7, 0.122173), (355, 6.19592)],
)
def test_angles_in_degrees(angle, radians):
    text = f"angles are in radians; {angle:g} degrees are {radians:g}, or $eval math.rad({angle:g})"
    assert hints.degrees(angle) == text


@pytest.mark.parametrize("angle", [0, 6.28, -6.3, 7.854, 9.42, 12.566, -18.85, float("inf")])
def test_angles_in_radians(angle):
    assert hints.degrees(angle) == ""


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
