"""What `flatland check` prints for frequent mistakes: file, line, text and hint of each problem."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flatland_command import main
from PIL import Image

WORLD = "properties: {}\nlayers: [{name: room, map: room.yaml}]\n"
LINES = "type: line_segments\ndata: room.dat\nscale: 1\norigin: [0, 0, 0]\n"
IMAGE_MAP = "image: %s\nresolution: %s\norigin: [0, 0, 0]\noccupied_thresh: 0.65\n"
BODY = "{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}"
MODEL = f"bodies: [{BODY}]\n"
LASER = "{type: Laser, name: %s, body: base, range: 5, angle: {min: 0, max: 1, increment: 1}%s}"
IN_RAD = "angles are in radians; "
DEGREES = "angles are in radians; for degrees, write "
JOINTED = """\
bodies: [{name: b, pose: [0, 0, -22.5], footprints: []}, {name: d, footprints: []}]
joints:
- {type: revolute, name: j, limits: [-45, 45],
   bodies: [{name: b, anchor: [0, 0]}, {name: d, anchor: [0, 0]}]}
"""
DRIVE = "{type: DiffDrive, name: drive, body: base%s}"
ROBOT = "models:\n- {name: r, model: robot.yaml, pose: %s}\n"


def plugins(*entries: str) -> str:
    """Returns a model with plugins, each in a line of its own; the first is in line 3."""
    return f"{MODEL}plugins:\n" + "".join(f"- {entry}\n" for entry in entries)


@dataclass(frozen=True)
class Mistake:
    """Files with a mistake, and the problems that are printed.

    Attributes:
        files: Texts by name; `world.yaml` is checked, or the only file.
        problems: File, line, and the beginnings of the message and of the hint of each problem;
            a message that begins with `~` is a warning.
    """

    files: dict[str, str]
    problems: list[tuple[str, int | None, str, str]] = field(default_factory=list)


def of_world(text: str, *problems: tuple[str, int | None, str, str], **files: str) -> Mistake:
    """Returns a mistake in `world.yaml`; the other files by their names before `.yaml`."""
    others = {f"{name}.yaml": content for name, content in files.items()}
    return Mistake({"world.yaml": text, **others}, list(problems))


def polygon(points: str) -> str:
    """Returns a model with a polygon."""
    return (
        f"bodies: [{{name: base, footprints: [{{type: polygon, density: 1, points: {points}}}]}}]"
    )


def of_model(text: str, *problems: tuple[str, int | None, str, str]) -> Mistake:
    return Mistake({"robot.yaml": text}, list(problems))


MISTAKES: dict[str, Mistake] = {
    # Entries that are incomplete: no errors that follow from them.
    "plugin without a type": of_model(
        plugins("{name: bumper, topic: bump}"),
        ("robot.yaml", 3, 'Entry "type" does not exist (in model "robot" "plugins" index=0)', ""),
    ),
    "plugin without a name": of_model(
        plugins("{type: Laser, body: bas, range: 5, angle: {min: 0, max: 1, increment: 1}}"),
        ("robot.yaml", 3, 'Entry "name" does not exist (in model "robot" "plugins" index=0)', ""),
    ),
    "model that is a path": of_world(
        f"{WORLD}models:\n- robot.yaml\n",
        ("world.yaml", 4, 'Entry index=0 must be a map (in "models")', "a model is written as {"),
    ),
    "model without a name": of_world(
        f"{WORLD}models:\n- {{model: robot.yaml}}\n",
        ("world.yaml", 4, 'Entry "name" does not exist (in "models" index=0)', ""),
        ("robot.yaml", 1, 'Invalid "type" in model "?" body "base", must be one of', "did you"),
        robot=MODEL.replace("{name: base", "{name: base, type: dinamic"),
    ),
    "illegal namespace of a model with a mistake": of_world(
        f"{WORLD}models:\n- {{name: r, model: robot.yaml, namespace: my robot, pose: [1, 1, 0]}}\n",
        ("world.yaml", 4, 'failed to spawn model "r", namespace "my robot" is not', ""),
        ("robot.yaml", 3, 'Entry "type" does not exist (in model "r" "plugins" index=0)', ""),
        robot=plugins("{name: bumper}"),
    ),
    "layers without a dash": of_world(
        "properties: {publish_map: room}\nlayers:\n  name: room\n  map: room.yaml\n"
        f"{ROBOT % '[1, 1, 0]'}",
        ("world.yaml", 3, 'Entry "layers" must be a list', "each item of a list starts with"),
        robot=MODEL.replace("density: 1", "density: 1, layers: [room]"),
    ),
    "second layer without a dash": of_world(
        "properties: {}\nlayers:\n- name: room\n  map: room.yaml\n  name: second\n",
        ("world.yaml", 5, '~Duplicate key "name" ignored, the', "the next item of a list starts"),
    ),
    "layer without a name": of_world(
        f"properties: {{}}\nlayers: [{{map: room.yaml}}]\n{ROBOT % '[1, 1, 0]'}",
        ("world.yaml", 2, 'Entry "name" does not exist (in "layers" index=0)', ""),
        robot=plugins(LASER % ("l", ", layers: [room]")).replace("1}]", "1, layers: [room]}]"),
    ),
    "layer of an existing name": of_world(
        "properties: {}\nlayers:\n- {name: room, map: room.yaml}\n"
        f"- {{name: [room, attic], map: rom.yaml}}\n{ROBOT % '[1, 1, 0]'}",
        ("world.yaml", 4, 'Layer with name "room" already exists', ""),
        ("world.yaml", 4, "File does not exist", 'did you mean "room.yaml"?'),
        ("robot.yaml", 1, 'Invalid footprint "layers" in', "layers of the world: room, attic"),
        robot=MODEL.replace("density: 1", "density: 1, layers: [attic, cellar]"),
    ),
    "two bodies with errors": of_model(
        "bodies:\n- {name: a}\n- {name: b, footprints: 1}\n",
        ("robot.yaml", 2, 'Entry "footprints" does not exist', '"footprints: []" is a body'),
        ("robot.yaml", 3, 'Entry "footprints" must be a list', ""),
    ),
    # Files.
    "missing image": of_world(
        WORLD.replace("room.yaml", "map.yaml"),
        (
            "map.yaml",
            1,
            'Failed to load "{folder}/',
            'the file does not exist; did you mean "room.',
        ),
        map=IMAGE_MAP % ("roon.png", 0.05),
    ),
    "map file that is a pointer of Git LFS": of_world(
        WORLD.replace("room.yaml", "lfs.png"),
        ("lfs.png", 1, 'Entry must be a map (in layer "room")', "the file is a pointer of Git LFS"),
    ),
    "empty file": of_world(
        WORLD.replace("room.yaml", "empty.png"),
        ("empty.png", 1, 'Entry must be a map (in layer "room")', "the file is empty"),
    ),
    "layers that are a name": of_model(
        MODEL.replace("density: 1", "density: 1, layers: 2d"),
        ("robot.yaml", 1, 'Entry "layers" must be a list', "a list is written in brackets: [2d]"),
    ),
    "missing map": of_world(
        WORLD.replace("room.yaml", "rom.yaml"),
        ("world.yaml", 2, 'File does not exist, path="{folder}/rom.yaml"', 'did you mean "room.'),
        rob=MODEL,
    ),
    "missing map beside a model of a similar name": of_world(
        WORLD.replace("room.yaml", "robots.yaml"),
        ("world.yaml", 2, 'File does not exist, path="{folder}/robots.yaml"', ""),
        robot=MODEL,
    ),
    "missing map in another folder": of_world(
        WORLD.replace("room.yaml", "folder/../rom.yaml"),
        ("world.yaml", 2, 'File does not exist, path="{folder}/rom.yaml"', 'did you mean "room.'),
    ),
    "path with backslashes": of_world(
        WORLD.replace("room.yaml", "folder\\..\\room.yaml"),
        ("world.yaml", 2, "File does not exist", "the parts of a path are separated by /, not by"),
    ),
    "image in place of a map": of_world(
        WORLD.replace("room.yaml", "room.png"),
        ("world.yaml", 2, "Malformatted", 'this is an image; a map file is expected here: "other'),
        other=IMAGE_MAP % ("room.png", 0.05),
    ),
    "image in place of a map without a map file": of_world(
        WORLD.replace("room.yaml", "plain.png"),
        ("world.yaml", 2, "Malformatted", "this is an image; a map file is expected here, a YAML"),
    ),
    "data in place of a map": of_world(
        WORLD.replace("room.yaml", "room.dat"),
        ("room.dat", 1, 'Entry must be a map (in layer "room")', "this is a data file of line"),
    ),
    "world in place of a model": of_world(
        f"{WORLD}models: [{{name: r, model: other.yaml}}]\n",
        ("other.yaml", 1, 'Entry "bodies" does not exist', "this is a world file; a model file is"),
        other=f"{WORLD}models: []\n",
    ),
    "map in place of a world": Mistake(
        {"map.yaml": LINES},
        [("map.yaml", 1, 'Entry "properties" does not exist', "this is a map file; a world file")],
    ),
    "model in place of a map": of_world(
        WORLD.replace("room.yaml", "robot.yaml"),
        ("robot.yaml", 1, 'Entry "image" does not exist', "this is a model file; a map file is"),
        robot=MODEL,
    ),
    # Files and paths of other programs.
    "URDF in place of a model": of_world(
        f"{WORLD}models: [{{name: r, model: robot.yaml}}]\n",
        ("robot.yaml", 1, "Entry must be a map", "this is a URDF file of a robot; a model file is"),
        robot='<robot name="r">\n  <link name="base"/>\n</robot>\n',
    ),
    "launch file in place of a world": Mistake(
        {"demo.launch": '<launch>\n  <arg name="a" default="b: c"/>\n</launch>\n'},
        [("demo.launch", 2, "Malformatted file, path", "this is a launch file; give the world")],
    ),
    "octile map": of_world(
        WORLD,
        ("room.yaml", 1, "Entry must be a map (in layer", "this is a map of the Moving"),
        room="type octile\nheight 2\nwidth 2\nmap\n@@\n..\n",
    ),
    "CSV in place of line segments": of_world(
        WORLD.replace("room.yaml", "map.yaml"),
        ("rows.yaml", 1, "Failed to read line segment from line 1", "numbers are separated by sp"),
        map=LINES.replace("room.dat", "rows.yaml"),
        rows="0,0,6,0\n",
    ),
    "launch file in place of an image": of_world(
        WORLD.replace("room.yaml", "map.yaml"),
        ("map.yaml", 1, 'Failed to load "', "the file is not an image; this is a launch file"),
        map=IMAGE_MAP % ("demo.yaml", 0.05),
        demo="<launch/>\n",
    ),
    "path of a package": of_world(
        WORLD.replace("room.yaml", "package://maps/room.yaml"),
        ("world.yaml", 2, "File does not exist", "package:// is not resolved; write a path rel"),
    ),
    "path of a launch file": of_world(
        f'{WORLD}models: [{{name: r, model: "$(find robots)/robot.yaml"}}]\n',
        ("world.yaml", 3, "File does not exist", "$(find ...) is replaced in launch files only"),
    ),
    "backslash in double quotes": of_world(
        WORLD.replace("room.yaml", r'"C:\maps\room.yaml"'),
        ("world.yaml", 2, "Malformatted file", "in double quotes, a backslash begins an escape"),
    ),
    "backslash that is a line break": of_world(
        WORLD.replace("room.yaml", r'"maps\new.yaml"'),
        ("world.yaml", 2, "File does not exist", "in double quotes, a backslash begins an escape"),
    ),
    # Texts.
    "conflict of a merge": of_world(
        "properties: {}\nlayers:\n<<<<<<< HEAD\n- {name: a}\n=======\n- {name: b}\n>>>>>>> b\n",
        ("world.yaml", 4, "Malformatted file", "line 3 is a conflict marker of a merge, <<<<<<<"),
    ),
    "pose without brackets": of_world(
        f"{WORLD}{ROBOT % '1'}".replace("pose: 1", 'pose: "-2.0, -3.5, 0.0"'),
        ("world.yaml", 4, 'Entry "pose" must be a list (in model "r")', "[x, y, theta] in m and"),
        robot=MODEL,
    ),
    "pose 1e30": of_world(
        f"{WORLD}{ROBOT % '[1e30, 0, 0]'}",
        ("world.yaml", 4, 'Invalid "pose", must be within +-1e+09, got [1e+30, 0.0, 0.0]', ""),
        robot=MODEL,
    ),
    # Valid values that are probably mistakes.
    "pixels of 1e-9 m": of_world(
        WORLD.replace("room.yaml", "map.yaml"),
        ("map.yaml", 2, '~Layer "room": 8 of 8 edges are missing', ""),
        map=IMAGE_MAP % ("room.png", "1e-9"),
    ),
    "pixels of 4 m": of_world(
        WORLD.replace("room.yaml", "map.yaml") + ROBOT % "[-9, 1, 0]",
        ("map.yaml", 2, '~"resolution" is 4 m per pixel; 0.05 is usual', ""),
        ("world.yaml", 4, '~model "r" at (-9, 1) is outside of all walls, which extend from', ""),
        map=IMAGE_MAP % ("room.png", 4),
        robot=MODEL,
    ),
    "far outside of line segments": of_world(
        f"{WORLD}{ROBOT % '[900, 1, 0]'}",
        ("world.yaml", 4, '~model "r" at (900, 1) is outside of all walls', ""),
        robot=MODEL,
    ),
    "beside line segments": of_world(f"{WORLD}{ROBOT % '[9, 1, 0]'}", robot=MODEL),
    "outside of an image, on static bodies": of_world(
        WORLD.replace("room.yaml", "map.yaml") + ROBOT % "[9, 1, 0]",
        map=IMAGE_MAP % ("room.png", 0.05),
        robot=MODEL.replace("{name: base", "{name: base, type: static"),
    ),
    "a world without walls": of_world(
        f"properties: {{}}\nlayers: []\n{ROBOT % '[900, 1, 0]'}", robot=MODEL
    ),
    "occupied_thresh 65": of_world(
        WORLD.replace("room.yaml", "map.yaml"),
        ("map.yaml", 4, '~Layer "room": "occupied_thresh" is 65, outside the range', ""),
        map=(IMAGE_MAP % ("room.png", 0.05)).replace("0.65", "65"),
    ),
    "keys of a published map": of_world(
        WORLD.replace("room.yaml", "map.yaml"),
        (
            "map.yaml",
            5,
            '~Error converting entry "negate" to bool (in layer "room"), so',
            "true or",
        ),
        ("map.yaml", 6, '~Invalid "mode", must be one of: trinary, scale, raw, got tinary', "did"),
        map=IMAGE_MAP % ("room.png", 0.05) + "negate: no thanks\nmode: tinary\n",
    ),
    "a white image": of_world(
        WORLD.replace("room.yaml", "map.yaml"),
        ("map.yaml", 1, '~Layer "room", image "{folder}/white.png": all 400 pixels are free', ""),
        map=IMAGE_MAP % ("white.png", 0.05),
    ),
    "angles in degrees": of_world(
        WORLD.replace("room.yaml", "map.yaml") + ROBOT % "[0.2, 0.2, 90]",
        ("map.yaml", 3, '~"origin" is [0, 0, 45], with an angle of more than a full turn', IN_RAD),
        ("world.yaml", 4, '~"pose" is [0.2, 0.2, 90], with an angle of more than a', IN_RAD),
        ("robot.yaml", 1, '~"pose" is [0, 0, -22.5], with an angle of', IN_RAD),
        ("robot.yaml", 3, '~"limits" is [-45, 45], with an angle of', IN_RAD),
        ("robot.yaml", 6, '~"angle" is {min: -90, max: 90, increment: 0.5}, which is', DEGREES),
        ("robot.yaml", 6, '~"origin" is [0, 0, 180], with an angle of more than', IN_RAD),
        ("robot.yaml", 7, '~"angle" is {min: -1.57, max: 1.57, increment: 1}, which are', DEGREES),
        ("robot.yaml", 8, '~"delta" is [0, 0, 90], with an angle of', IN_RAD),
        ("robot.yaml", 9, '~"waypoints" is 270, with an angle of', IN_RAD),
        map=(IMAGE_MAP % ("room.png", 0.05)).replace("0, 0]", "0, 45]"),
        robot=JOINTED + "plugins:\n"
        "- {type: Laser, name: a, body: b, range: 5, angle: {min: -90, max: 90, increment: 0.5}, "
        "origin: [0, 0, 180]}\n"
        "- {type: Laser, name: c, body: b, range: 5, topic: c, "
        "angle: {min: -1.57, max: 1.57, increment: 1}}\n"
        "- {type: Tween, name: t, body: b, delta: [0, 0, 90]}\n"
        "- {type: PathFollower, name: p, body: d, waypoints: [[0, 0, 270], [1, 0]]}\n",
    ),
    "angles of up to a full turn, and whole turns": of_model(
        JOINTED.replace("-22.5", "-6.2832").replace("[-45, 45]", "[-3.14, 3.14]") + "plugins:\n"
        "- {type: Laser, name: a, body: b, range: 5, origin: [0, 0, 4.712], "
        "angle: {min: 0, max: 6.2832, increment: 0.5236}}\n"
        "- {type: Tween, name: t, body: b, delta: [0, 0, 12.566]}\n",
    ),
    "angles in degrees that are errors": of_model(
        plugins(
            "{type: Hitch, name: h, max_angle: 30}",
            "{type: Sonar, name: s, body: base, range: 4, field_of_view: 30}",
        ),
        (
            "robot.yaml",
            3,
            'Model Plugin "h" type "Hitch" model "robot": Flatland YAML: Inv',
            IN_RAD,
        ),
        (
            "robot.yaml",
            4,
            'Model Plugin "s" type "Sonar" model "robot": Flatland YAML: Inv',
            IN_RAD,
        ),
    ),
    "radius 0 and colours up to 255": of_model(
        MODEL.replace("radius: 0.2", "radius: 0").replace(
            "base,", "base, color: [255, 0, 0, 255],"
        ),
        ("robot.yaml", 1, '~"color" is [255, 0, 0, 255], but each of [r, g, b, a] is from', ""),
        ("robot.yaml", 1, '~"radius" is 0, so that the circle is a point', ""),
    ),
    "a concave footprint": of_model(
        polygon("[[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]"),
        (
            "robot.yaml",
            1,
            '~"points" is concave in body "base"; the physics uses the convex hull, with an area '
            "of 3.5 m² instead of 3 m²",
            "",
        ),
    ),
    "a footprint that crosses itself": of_model(
        polygon("[[0, 0], [2, 1], [2, 0], [0, 1]]"),
        (
            "robot.yaml",
            1,
            '~"points" is a polygon of body "base" that crosses itself; the physics uses its '
            "convex hull, with an area of 2 m²",
            "",
        ),
    ),
    # Conflicts of plugins.
    "two lasers of one frame without transforms": of_model(
        plugins(
            LASER % ("a", ", frame: eye, broadcast_tf: false"),
            LASER % ("b", ", frame: eye, topic: b, origin: [0.1, 0, 0], broadcast_tf: false"),
        ),
        ("robot.yaml", 4, '~frame "eye" has two poses, of Model Plugin "a" type "Laser"', ""),
    ),
    "two publishers of one topic": of_model(
        plugins(LASER % ("a", ""), LASER % ("b", "")),
        ("robot.yaml", 4, '~topic "/scan" is published by Model Plugin "a" type "Laser" model', ""),
    ),
    "two robots without namespaces": of_world(
        f"{WORLD}models:\n- {{name: a, model: robot.yaml, pose: [1, 1, 0]}}\n"
        "- {name: b, model: robot.yaml, pose: [2, 2, 0]}\n",
        ("robot.yaml", 3, '~TF frame "base" is sent with two poses in "odom", by Model Plugin', ""),
        ("robot.yaml", 3, '~topic "/odometry/filtered" is published by Model Plugin "drive"', ""),
        ("robot.yaml", 3, '~topic "/odometry/ground_truth" is published by', ""),
        ("robot.yaml", 3, '~topic "/twist" is published by', ""),
        robot=plugins(DRIVE % ""),
    ),
    "bumpers of one topic": of_model(plugins("{type: Bumper, name: a}", "{type: Bumper, name: b}")),
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a map, images, and files that are not images."""
    pixels = np.zeros((20, 20), np.uint8)
    pixels[2:18, 2:18] = 255
    for name in ("room.png", "plain.png"):
        Image.fromarray(pixels).save(tmp_path / name)
    Image.fromarray(np.full_like(pixels, 255)).save(tmp_path / "white.png")
    (tmp_path / "empty.png").touch()
    (tmp_path / "lfs.png").write_text("version https://git-lfs.example/spec/v1\noid sha256:1\n")
    (tmp_path / "room.dat").write_text("0 0 6 0\n6 0 6 6\n6 6 0 6\n0 6 0 0\n")
    (tmp_path / "room.yaml").write_text(LINES)
    (tmp_path / "folder").mkdir()
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake(folder: Path, capsys: Any, name: str) -> None:
    mistake = MISTAKES[name]
    for file, text in mistake.files.items():
        (folder / file).write_text(text)
    code = main("check", next(iter(mistake.files)), "--json")
    found = json.loads(capsys.readouterr().out)["problems"]
    shown = [(Path(p["file"]).name, p["line"], p["message"], p["hint"]) for p in found]
    assert len(found) == len(mistake.problems), shown
    for problem, (file, line, message, hint) in zip(shown, mistake.problems, strict=True):
        start = message.removeprefix("~").replace("{folder}", str(folder))
        assert problem[:2] == (file, line)
        assert problem[2].startswith(start), problem
        assert problem[3].startswith(hint.replace("{folder}", str(folder))), problem
        assert bool(problem[3]) == bool(hint), problem
    warnings = [message.startswith("~") for _, _, message, _ in mistake.problems]
    assert [problem["severity"] == "warning" for problem in found] == warnings
    assert code == (0 if all(warnings) else 1)
    assert main("check", next(iter(mistake.files)), "--strict") == (1 if found else 0)
