"""Hints about files and paths of other programs."""

from __future__ import annotations

import pytest

from flatland.config.foreign_files import escape_error, foreign_file, foreign_path

XML = '<?xml version="1.0"?>\n<!-- a <b> -->\n'
FILES = [
    (f'{XML}<robot name="r">', "a URDF file of a robot; a model file is YAML"),
    ('<robot name="r"><link/></robot>', "a URDF file of a robot"),
    (f'{XML}<robot name="r" xmlns:xacro="http://x">', "a xacro file of a robot; a model file"),
    (f'{XML}<sdf version="1.6"><world name="w">', "an SDF file of Gazebo; a world file is YAML"),
    ('<launch>\n  <node pkg="a"/>', "a launch file; give the world file that its argument"),
    ("import os\nfrom launch import LaunchDescription\n", "a launch file; give the world file"),
    ("type octile\nheight 4\nwidth 4\nmap\n....\n", "a map of the Moving AI benchmarks; convert"),
    ("type octile height 4 width 4 map ....", "a map of the Moving AI benchmarks; convert"),
    ("0,0,1,1\n1,1,2,2\n", "a table with commas (CSV); line segments are written as x1 y1 x2 y2"),
    ("x1;y1;x2;y2\n0;0;1;1\n", "a table with commas (CSV)"),
    ("# Stage\ndefine block model\n(\n  size [1 1 1]\n)\n", "a world file of Stage; a world file"),
    ("<!DOCTYPE html>\n<html>", "a web page; download the file itself instead"),
    ('<svg xmlns="x">', "an SVG drawing; export it as a PNG image"),
    ("<unknown>\n", "an XML file, which is not read here"),
    ("import numpy as np\n", "a Python program, which is not read here"),
    ("#ROSBAG V2.0\n", "a bag of ROS, which is not read here"),
    ("PK\x03\x04", "a compressed archive; extract it first"),
]


@pytest.mark.parametrize(("text", "hint"), FILES)
def test_a_file_of_another_program(text: str, hint: str) -> None:
    assert foreign_file(text.encode()).startswith(f"this is {hint}")


@pytest.mark.parametrize(
    "text",
    [
        "",
        "a text",
        "1 2 3 4\n",
        "properties: {}\nlayers: [a, b, c]\n",
        "- a, b, c\n",
        "# <robot> and <launch>, of a, b, c\nbodies: []\n",
        "{a: 1, b: 2, c: 3}",
        "name: from, import, define\n",
    ],
)
def test_other_texts_have_no_hint(text: str) -> None:
    assert foreign_file(text.encode()) == ""


@pytest.mark.parametrize(
    ("path", "hint"),
    [
        ("/a/package:/robots/r.yaml", "package:// is not resolved; write a path relative to the"),
        ("/a/file:/home/you/w.yaml", 'paths have no scheme: "/home/you/w.yaml"'),
        ("file:///home/you/w.yaml", 'paths have no scheme: "/home/you/w.yaml"'),
        ("/a/https:/host/map.png", "files are not downloaded, as https:// requires"),
        ("/a/$(find robots)/r.yaml", "$(find ...) is replaced in launch files only"),
        ("/a/$(find-pkg-share robots)/r.yaml", "$(find ...) is replaced in launch files only"),
        ("/a/${HOME}/r.yaml", 'variables are not replaced; use $eval env("HOME") .. "/..."'),
        ("/a/maps\new.png", "in double quotes, a backslash begins an escape sequence"),
        ("/a/b.yaml", ""),
        ("/a/file:b", ""),
    ],
)
def test_a_path_of_another_program(path: str, hint: str) -> None:
    assert foreign_path(path).startswith(hint)
    assert bool(foreign_path(path)) == bool(hint)


def test_errors_about_escape_sequences() -> None:
    for why in ("found unknown escape character", "did not find expected hexdecimal number"):
        assert escape_error(why).startswith("in double quotes, a backslash begins an escape")
    assert escape_error("did not find expected key") == ""
