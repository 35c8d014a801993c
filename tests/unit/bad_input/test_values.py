"""Values that have the right type but no meaning, in worlds, maps, models, manifests and calls."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import flatland
from flatland.plugin_api.manifest import read_manifest

NAN, INF = math.nan, math.inf
CIRCLE = "{type: circle, radius: 0.2, density: 1}"
BODY = f"{{name: base, footprints: [{CIRCLE}]}}"
WHEEL = "{name: wheel, footprints: []}"
PLACE = 'model "robot"'
FOOTPRINT = f'{PLACE} body "base" "footprints" index=0'
PLUGIN = 'Flatland plugin: Model Plugin "p" type "{0}" model "robot": Flatland YAML: '


def body(entries: str) -> str:
    """Returns a model with one body that has further entries in line 2."""
    return f"bodies:\n  - {{name: base, {entries}}}\n"


def footprint(entries: str) -> str:
    """Returns a model with one footprint in line 2."""
    return body(f"footprints: [{{{entries}}}]")


def joint(entries: str) -> str:
    """Returns a model with one joint in line 3."""
    return f"bodies: [{BODY}, {WHEEL}]\njoints:\n  - {{name: j, {entries}}}\n"


def plugin(entries: str) -> str:
    """Returns a model with one plugin in line 3."""
    return f"bodies: [{BODY}]\nplugins:\n  - {{name: p, {entries}}}\n"


ENDS = "[{name: base, anchor: [0, 0]}, {name: wheel, anchor: [0, 0]}]"
ONE_END = "[{name: base, anchor: [0, 0]}]"
LOST_END = "[{name: base, anchor: [0, 0]}, {name: wheeel, anchor: [0, 0]}]"
LASER = "type: Laser, body: base, range: 5, angle: {min: 0, max: 1, increment: 0.5}"

# Per name: the file, the error without the prefix "Flatland YAML: ", and the line.
MODELS: dict[str, tuple[str, str, int]] = {
    "no bodies": (
        "bodies: []\n",
        'Invalid "bodies" in "robot" model, must be a list of bodies of at least size 1',
        1,
    ),
    "all bodies disabled": (
        body("footprints: [], enabled: false"),
        'Invalid "bodies" in "robot" model, must be a list of bodies of at least size 1',
        2,
    ),
    "body twice": (
        f"bodies:\n  - {WHEEL}\n  - {WHEEL}\n",
        'Invalid "bodies" in "robot" model, body with name "wheel" already exists',
        3,
    ),
    "body type": (
        body("footprints: [], type: dynamik"),
        f'Invalid "type" in {PLACE} body "base", must be one of: static, kinematic, dynamic',
        2,
    ),
    "footprint type": (
        footprint("type: box, density: 1"),
        f'Invalid footprint "type" in {FOOTPRINT}, support footprints are: circle, polygon',
        2,
    ),
    "footprint layers": (
        footprint("type: circle, radius: 1, density: 1, layers: [2d, 5d, 6d]"),
        f'Invalid footprint "layers" in {FOOTPRINT}, {{5d,6d}} layer(s) does not exist',
        2,
    ),
    "two points": (
        footprint("type: polygon, density: 1, points: [[0, 0], [1, 0]]"),
        f'Entry "points" must have size >= 3 (in {FOOTPRINT})',
        2,
    ),
    "no points": (
        footprint("type: polygon, density: 1, points: []"),
        f'Entry "points" must have size >= 3 (in {FOOTPRINT})',
        2,
    ),
    "nine points": (
        footprint(f"type: polygon, density: 1, points: [{', '.join(['[0, 0]'] * 9)}]"),
        f'Entry "points" must have size <= 8 (in {FOOTPRINT})',
        2,
    ),
    "point with NaN": (
        footprint("type: polygon, density: 1, points: [[0, 0], [1, .nan], [0, 1]]"),
        'Invalid "points", must be finite, got [(0.0, 0.0), (1.0, nan), (0.0, 1.0)] '
        f"(in {FOOTPRINT})",
        2,
    ),
    "joint type": (
        joint(f"type: hinge, bodies: {ENDS}"),
        f'Invalid joint "type" in {PLACE} joint "j", supported joints are: revolute, weld',
        3,
    ),
    "joint of one body": (
        joint(f"type: weld, bodies: {ONE_END}"),
        f'Invalid "bodies" in {PLACE} joint "j", must be a sequence of exactly two items',
        3,
    ),
    "joint without bodies": (
        joint("type: weld, bodies: []"),
        f'Invalid "bodies" in {PLACE} joint "j", must be a sequence of exactly two items',
        3,
    ),
    "joint of an unknown body": (
        joint(f"type: weld, bodies: {LOST_END}"),
        f'Cannot find body with name "wheeel" in {PLACE} joint "j" "bodies" index=1',
        3,
    ),
    "limits in the wrong order": (
        joint(f"type: revolute, bodies: {ENDS}, limits: [1, -1]"),
        'Invalid "limits", the lower limit 1.0 must not be above the upper limit -1.0 '
        f'(in {PLACE} joint "j")',
        3,
    ),
    "no merge keys": (
        "bodies:\n  - {<<: {name: base}, footprints: []}\n",
        f'Entry "name" does not exist (in {PLACE} "bodies" index=0)',
        2,
    ),
    "undefined alias": (
        "bodies: *nothing\n",
        'Malformatted file, path="{path}", line 1 col 9, undefined alias "nothing"',
        0,
    ),
    "a list as a key": (
        "? [a]\n: b\n",
        'Malformatted file, path="{path}", line 1 col 3, a key must be a scalar',
        0,
    ),
    "tab as indentation": (
        "bodies:\n\t- name: base\n",
        'Malformatted file, path="{path}", line 2 col 1, found character that cannot start any '
        "token",
        0,
    ),
    "a list item without a list": (
        "bodies: $[include] other.yaml\n",
        "$[include] must be an item of a list",
        1,
    ),
    "included file is missing": (
        "bodies:\n  $include nothing.yaml\n",
        "File specified in $include does not exist, path={folder}/nothing.yaml, "
        "include=nothing.yaml",
        2,
    ),
    "include of nothing": (
        "bodies: $include\n",
        "File specified in $include does not exist, path={folder}, include=",
        1,
    ),
}
# Rejected by the engine: only the start of the text is that of flatland.
PHYSICS: dict[str, tuple[str, str, int]] = {
    "collinear points": (
        footprint("type: polygon, density: 1, points: [[0, 0], [1, 0], [2, 0]]"),
        f"Invalid entry in {FOOTPRINT}, ",
        2,
    ),
    "one point thrice": (
        footprint("type: polygon, density: 1, points: [[0, 0], [0, 0], [-0, -0]]"),
        f"Invalid entry in {FOOTPRINT}, ",
        2,
    ),
    "radius 1e308": (
        footprint("type: circle, radius: 1e308, density: 1"),
        f"Invalid entry in {FOOTPRINT}, ",
        2,
    ),
    "density 1e308": (
        footprint("type: circle, radius: 1, density: 1e308"),
        f"Invalid entry in {FOOTPRINT}, ",
        2,
    ),
    "center 1e308": (
        footprint("type: circle, radius: 1, density: 1, center: [1e308, 0]"),
        f"Invalid entry in {FOOTPRINT}, ",
        2,
    ),
    "pose 1e308": (
        body("footprints: [], pose: [1e308, 0, 0]"),
        f'Invalid entry in {PLACE} body "base", ',
        2,
    ),
    "angle 1e308": (
        body("footprints: [], pose: [0, 0, 1e308]"),
        f'Invalid entry in {PLACE} body "base", ',
        2,
    ),
    "damping 1e308": (
        body("footprints: [], linear_damping: 1e308"),
        f'Invalid entry in {PLACE} body "base", ',
        2,
    ),
    "anchor 1e308": (
        joint(f"type: weld, bodies: {ENDS.replace('[0, 0]', '[1e308, 0]')}"),
        f'Invalid entry in {PLACE} joint "j", ',
        3,
    ),
    "joint of a body with itself": (
        joint(f"type: weld, bodies: {ENDS.replace('wheel', 'base')}"),
        f'Invalid entry in {PLACE} joint "j", ',
        3,
    ),
}
# Per name: the plugin, its type, the error after the usual start, and the line.
PLUGINS: dict[str, tuple[str, str, str]] = {
    "Laser increment 0": (
        LASER.replace("increment: 0.5", "increment: 0"),
        "Laser",
        'Invalid "angle" params, increment must not be zero!',
    ),
    "Laser increment -0": (
        LASER.replace("increment: 0.5", "increment: -0"),
        "Laser",
        'Invalid "angle" params, increment must not be zero!',
    ),
    "Laser max < min": (
        LASER.replace("max: 1", "max: -1"),
        "Laser",
        'Invalid "angle" params, must have max > min when increment > 0',
    ),
    "Laser min < max": (
        LASER.replace("increment: 0.5", "increment: -0.5"),
        "Laser",
        'Invalid "angle" params, must have min > max when increment < 0',
    ),
    "Laser angle NaN": (
        LASER.replace("max: 1", "max: .nan"),
        "Laser",
        'Invalid "angle" params, must be finite, got [0.0, nan, 0.5]',
    ),
    "Laser with too many beams": (
        LASER.replace("increment: 0.5", "increment: 1e-300"),
        "Laser",
        'Invalid "angle" params, more than 1000000 beams between 0.0 and 1.0 in steps of 1e-300',
    ),
    **{
        f"Laser range {text}": (
            LASER.replace("range: 5", f"range: {text}"),
            "Laser",
            f'Invalid "range", must be greater than 0 and at most 1e+06 m, got {got}',
        )
        for text, got in (
            ("0", "0.0"),
            ("-0", "-0.0"),
            ("-1", "-1.0"),
            (".nan", "nan"),
            (".inf", "inf"),
            ("1e308", "1e+308"),
        )
    },
    "Laser layers": (
        LASER + ", layers: [2d, a, b]",
        "Laser",
        "Cannot find layer(s): {a,b}",
    ),
    "Laser no_hit": (
        LASER + ", no_hit: zero",
        "Laser",
        'Invalid "no_hit", must be one of: nan, inf, range, got zero',
    ),
    **{
        f"{name} of an unknown body": (
            f"type: {name}, {key}: bas{more}",
            name,
            'Body with name "bas" does not exist',
        )
        for name, key, more in (
            ("Laser", "body", ", range: 5, angle: {min: 0, max: 1, increment: 1}"),
            ("DiffDrive", "body", ""),
            ("Gps", "body", ""),
            ("Imu", "body", ""),
            ("Tween", "body", ""),
            ("BoolSensor", "body", ""),
            ("PosePublisher", "body", ""),
            ("TricycleDrive", "body", ""),
            ("ModelTfPublisher", "reference", ""),
        )
    },
    "Bumper excludes an unknown body": (
        "type: Bumper, exclude: [base, bas]",
        "Bumper",
        'Body with name "bas" does not exist',
    ),
    "TricycleDrive of an unknown joint": (
        "type: TricycleDrive, body: base, front_wheel_joint: f, rear_left_wheel_joint: l, "
        "rear_right_wheel_joint: r",
        "TricycleDrive",
        'Joint with name "f" does not exist',
    ),
    "Tween mode": ("type: Tween, body: base, mode: jump", "Tween", "Mode jump does not exist"),
    "Tween easing": (
        "type: Tween, body: base, easing: soft",
        "Tween",
        "Easing soft does not exist",
    ),
    "Tween duration 0": (
        "type: Tween, body: base, duration: 0",
        "Tween",
        'Invalid "duration", must be greater than 0, got 0.0',
    ),
    "Tween duration -1": (
        "type: Tween, body: base, duration: -1",
        "Tween",
        'Invalid "duration", must be greater than 0, got -1.0',
    ),
    "Gps at 91 degrees": (
        "type: Gps, body: base, ref_lat: 91",
        "Gps",
        'Invalid "ref_lat", must be from -90 to 90, got 91.0',
    ),
    "PosePublisher of another message": (
        "type: PosePublisher, message: tf",
        "PosePublisher",
        'Invalid "message", must be one of: pose, odometry, got tf',
    ),
    "PosePublisher of a pose with a child frame": (
        "type: PosePublisher, child_frame_id: base",
        "PosePublisher",
        'Invalid "child_frame_id", only used with "message: odometry"',
    ),
    "Dummy with another number": (
        "type: DummyModelPlugin, dummy_param_float: 0.123456, "
        "dummy_param_string: dummy_test_123456, dummy_param_int: 7",
        "DummyModelPlugin",
        'Invalid "dummy_param_int", must be 123456, got 7',
    ),
}

MAP = "image: map.png\nresolution: {resolution}\norigin: {origin}\noccupied_thresh: 0.5\n"
LINES = "type: line_segments\ndata: walls.dat\nscale: {scale}\norigin: [0, 0, 0]\n"
WORLD = "properties: {{}}\nlayers: [{{name: 2d, map: m.yaml}}]\n"
MAPS: dict[str, tuple[str, str, int]] = {
    **{
        f"resolution {text}": (
            MAP.format(resolution=text, origin="[0, 0, 0]"),
            f'Flatland YAML: Invalid "resolution", must be positive, got {got} (in layer "2d")',
            2,
        )
        for text, got in (("0", "0.0"), ("-0", "-0.0"), ("-0.05", "-0.05"))
    },
    "scale 0": (
        LINES.format(scale="0"),
        'Flatland YAML: Invalid "scale", must not be 0 (in layer "2d")',
        3,
    ),
    "scale -0": (
        LINES.format(scale="-0"),
        'Flatland YAML: Invalid "scale", must not be 0 (in layer "2d")',
        3,
    ),
    "scale 1e308": (
        LINES.format(scale="1e308"),
        'Flatland YAML: Invalid "scale", a coordinate does not fit a 32-bit float (in layer "2d")',
        3,
    ),
    "a list": ("[a]\n", 'Flatland YAML: Entry must be a map (in layer "2d")', 1),
}

NAMES = ", ".join(f"n{i}" for i in range(17))
WORLDS: dict[str, tuple[str, str, str, int]] = {
    "a list": ("[a]\n", "YamlError", "Flatland YAML: Entry must be a map", 1),
    "a text": ("text\n", "YamlError", "Flatland YAML: Entry must be a map", 1),
    "layer twice": (
        "properties: {}\nlayers:\n  - name: 2d\n  - name: [3d, 2d]\n",
        "YamlError",
        'Flatland YAML: Layer with name "2d" already exists',
        4,
    ),
    "17 layers": (
        f"properties: {{}}\nlayers:\n  - name: [{NAMES}]\n",
        "YamlError",
        f"Flatland YAML: Unable to add 17 additional layer(s) {{{NAMES}}}, current layers count is "
        "0, max allowed is 16",
        3,
    ),
    "published map": (
        "properties:\n  publish_map: 3d\nlayers: [{name: 2d}]\n",
        "YamlError",
        'Flatland YAML: Invalid "publish_map", must be the name of a layer (2d), got 3d (in '
        '"properties")',
        2,
    ),
    "model twice": (
        "properties: {}\nlayers: []\nmodels:\n  - {name: m, model: good.model.yaml}\n"
        "  - {name: m, model: good.model.yaml}\n",
        "YamlError",
        'Flatland YAML: Model with name "m" already exists',
        5,
    ),
    "illegal namespace": (
        "properties: {}\nlayers: []\nmodels:\n  - {name: m, model: good.model.yaml, "
        "namespace: my robot}\n",
        "YamlError",
        'Flatland YAML: failed to spawn model "m", namespace "my robot" is not a legal ROS name: '
        'it must start with a letter and hold only letters, digits, "_" and "/"',
        4,
    ),
    "empty model name": (
        "properties: {}\nlayers: []\nmodels:\n  - {name: '', model: good.model.yaml}\n",
        "YamlError",
        "Flatland YAML: failed to spawn model, its name must not be empty",
        4,
    ),
    "unknown world plugin": (
        "properties: {}\nlayers: []\nplugins:\n  - {name: w, type: RandomWal}\n",
        "MissingPluginsError",
        'Flatland plugin: World Plugin "w" type "RandomWal": ',
        4,
    ),
    "world plugin of a model": (
        "properties: {}\nlayers: []\nplugins:\n  - {name: w, type: Laser}\n",
        "PluginError",
        'Flatland plugin: World Plugin "w" type "Laser": ',
        4,
    ),
    "wall without a layer": (
        "properties: {}\nlayers: []\nplugins:\n  - {name: w, type: RandomWall, layer: a, "
        "robot_name: r}\n",
        "PluginError",
        'Flatland plugin: World Plugin "w" type "RandomWall": ',
        4,
    ),
}


@pytest.fixture(scope="module")
def extended_folder(folder: Path) -> Path:
    Image.fromarray(np.full((4, 4), 255, np.uint8)).save(folder / "map.png")
    return folder


def spawn(world: flatland.World, unchanged: Any, path: Path, text: str) -> flatland.FlatlandError:
    path.write_text(text)
    try:
        with unchanged(world), pytest.raises(flatland.FlatlandError) as caught:
            world.spawn_model(path, "robot", "robot", (9, 9, 0))
    finally:
        if len(world.models) > 1:  # so that further cases are not affected
            world.delete_model("robot")
    return caught.value


def place(path: Path, line: int) -> str:
    return f" [{path}:{line}]" if line else ""


@pytest.mark.parametrize("name", MODELS)
def test_a_model(running_world: flatland.World, folder: Path, unchanged: Any, name: str) -> None:
    text, message, line = MODELS[name]
    path = folder / "value.model.yaml"
    error = spawn(running_world, unchanged, path, text)
    message = message.replace("{path}", str(path)).replace("{folder}", str(folder))
    assert str(error) == f"Flatland YAML: {message}{place(path, line)}"
    assert type(error) is flatland.YamlError


@pytest.mark.parametrize("name", PHYSICS)
def test_a_model_that_physics_rejects(
    running_world: flatland.World, folder: Path, unchanged: Any, name: str
) -> None:
    text, start, line = PHYSICS[name]
    path = folder / "value.model.yaml"
    error = spawn(running_world, unchanged, path, text)
    assert str(error).startswith(f"Flatland YAML: {start}")
    assert str(error).endswith(place(path, line))
    assert type(error) is flatland.YamlError


@pytest.mark.parametrize("number", ["0", "-0"])
@pytest.mark.parametrize("key", ["radius", "density", "friction", "restitution"])
def test_zero_is_valid_with_any_sign(
    running_world: flatland.World, folder: Path, unchanged: Any, key: str, number: str
) -> None:
    values = {"type": "circle", "radius": "1", "density": "1", key: number}
    text = footprint(", ".join(f"{name}: {value}" for name, value in values.items()))
    (folder / "zero.model.yaml").write_text(text)
    with unchanged(running_world):
        running_world.spawn_model("zero.model.yaml", "zero", pose=(9, 9, 0))
        running_world.delete_model("zero")


@pytest.mark.parametrize("name", PLUGINS)
def test_a_plugin(running_world: flatland.World, folder: Path, unchanged: Any, name: str) -> None:
    entries, type_name, message = PLUGINS[name]
    path = folder / "value.model.yaml"
    error = spawn(running_world, unchanged, path, plugin(entries))
    assert str(error) == f"{PLUGIN.format(type_name)}{message}{place(path, 3)}"
    assert type(error) is flatland.PluginError


@pytest.mark.parametrize("name", MAPS)
def test_a_map(extended_folder: Path, unchanged: Any, name: str) -> None:
    text, message, line = MAPS[name]
    path = extended_folder / "m.yaml"
    path.write_text(text)
    world = extended_folder / "mapped.yaml"
    world.write_text(WORLD.format())
    with unchanged(), pytest.raises(flatland.YamlError) as caught:
        flatland.World.from_yaml(world, seed=1)
    assert str(caught.value) == f"{message}{place(path, line)}"


@pytest.mark.parametrize("name", WORLDS)
def test_a_world(folder: Path, unchanged: Any, name: str) -> None:
    text, class_name, start, line = WORLDS[name]
    path = folder / "value.yaml"
    path.write_text(text)
    with unchanged(), pytest.raises(flatland.FlatlandError) as caught:
        flatland.World.from_yaml(path, seed=1)
    assert type(caught.value).__name__ == class_name
    assert str(caught.value).startswith(start)
    assert str(caught.value).endswith(place(path, line))


# -- manifests -----------------------------------------------------------------------------------

CLASS = '<class name="a::B" type="{type}" base_class_type="{base}"/>'
MANIFESTS: dict[str, tuple[str | None, str]] = {
    "empty": ("", '" is not XML, line 1 col 0, no element found'),
    "no XML": ("text", '" is not XML, line 1 col 0, syntax error'),
    "not closed": ("<library>\n", '" is not XML, line 2 col 0, no element found'),
    "mismatched": ("<library>\n</lib>", '" is not XML, line 2 col 2, mismatched tag'),
    "other root": ("<package/>", '" must contain <library> or <class_libraries>, got <package>'),
    "no module": (
        f"<library>{CLASS.format(type='Belt', base='flatland::ModelPlugin')}</library>",
        '", class "a::B": type must be the dotted path of a Python class, got "Belt"',
    ),
    "no type": (
        f"<library>{CLASS.format(type='', base='flatland::ModelPlugin')}</library>",
        '", class "a::B": type must be the dotted path of a Python class, got ""',
    ),
    "no base class": (
        f"<library>{CLASS.format(type='m.Belt', base='')}</library>",
        '", class "a::B": base_class_type must be flatland::ModelPlugin or flatland::WorldPlugin, '
        'got ""',
    ),
    "misspelled base class": (
        f"<library>{CLASS.format(type='m.Belt', base='flatland::ModelPlugins')}</library>",
        '", class "a::B": base_class_type must be flatland::ModelPlugin or flatland::WorldPlugin, '
        'got "flatland::ModelPlugins"',
    ),
    "undefined entity": ("<library>&a;</library>", '" is not XML, line 1 col 9, undefined entity'),
}


@pytest.mark.parametrize("name", MANIFESTS)
def test_a_manifest(tmp_path: Path, unchanged: Any, name: str) -> None:
    text, end = MANIFESTS[name]
    path = tmp_path / "plugins.xml"
    path.write_text(text or "")
    with unchanged(), pytest.raises(flatland.PluginError) as caught:
        read_manifest(path)
    assert str(caught.value).startswith(f'Flatland plugin: manifest "{path}{end}')


def test_a_manifest_that_is_no_file(tmp_path: Path, unchanged: Any) -> None:
    os.mkfifo(tmp_path / "pipe.xml")
    (tmp_path / "link.xml").symlink_to("/dev/zero")
    (tmp_path / "folder.xml").mkdir()
    for name, why in (
        ("pipe.xml", "it is not a regular file"),
        ("link.xml", "it is not a regular file"),
        ("folder.xml", "Is a directory"),
        ("missing.xml", "No such file or directory"),
    ):
        path = tmp_path / name
        with unchanged(), pytest.raises(flatland.PluginError) as caught:
            read_manifest(path)
        assert str(caught.value) == f'Flatland plugin: manifest "{path}" cannot be read: {why}'


# -- arguments and requests ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"seed": -1}, "seed"),
        ({"step_size": 0.0}, "step"),
        ({"step_size": -0.0}, "step"),
        ({"step_size": NAN}, "step"),
        ({"step_size": INF}, "step"),
        ({"step_size": 1e308}, "step"),
        ({"simplify_map": 3}, "simplify_map must be 0, 1 or 2, got 3"),
        ({"simplify_map": -1}, "simplify_map must be 0, 1 or 2, got -1"),
        ({"plugin_timeout": 0.0}, "plugin_timeout must be positive"),
        ({"plugin_timeout": NAN}, "plugin_timeout must be positive"),
        ({"model_path": []}, "model_path must contain at least one folder"),
        ({"model_path": "/tmp"}, "model_path must be a list of folders, got '/tmp'"),
        (
            {"model_path": ["/nowhere"]},
            "model_path must be a list of folders, '/nowhere' is not a folder",
        ),
    ],
    ids=str,
)
def test_an_argument(folder: Path, unchanged: Any, options: Any, message: str) -> None:
    with unchanged(), pytest.raises(ValueError, match=message):
        flatland.World.from_yaml(folder / "world.yaml", **options)


Request = Callable[[flatland.World], object]
REQUESTS: dict[str, tuple[Request, str]] = {
    "delete an unknown model": (
        lambda world: world.delete_model("nobody"),
        'Flatland World: failed to delete model, model with name "nobody" does not exist',
    ),
    "move an unknown model": (
        lambda world: world.move_model("nobody", (0, 0, 0)),
        'Flatland World: failed to move model, model with name "nobody" does not exist',
    ),
    **{
        f"move to {number}": (
            lambda world, number=number: world.move_model("first", (0, number, 0)),  # type: ignore[misc]
            'Flatland World: failed to move model "first", ',
        )
        for number in (NAN, INF, -INF, 1e308)
    },
    **{
        f"spawn at {number}": (
            lambda world, number=number: world.spawn_model(  # type: ignore[misc]
                "good.model.yaml", "new", "", (0, 0, number)
            ),
            "Flatland ",
        )
        for number in (NAN, INF, -INF, 1e308)
    },
    "spawn without a name": (
        lambda world: world.spawn_model("good.model.yaml", ""),
        "Flatland World: failed to spawn model, its name must not be empty",
    ),
    "spawn without a path": (
        lambda world: world.spawn_model("", "new"),
        'Flatland World: failed to spawn model "new", the path must not be empty',
    ),
    "spawn an existing name": (
        lambda world: world.spawn_model("good.model.yaml", "first"),
        'Flatland YAML: Model with name "first" already exists',
    ),
    "spawn in an illegal namespace": (
        lambda world: world.spawn_model("good.model.yaml", "new", "my robot"),
        'Flatland World: failed to spawn model "new", namespace "my robot" is not a legal ROS name',
    ),
    "spawn a path with a null character": (
        lambda world: world.spawn_model("good\0.yaml", "new"),
        "Flatland YAML: File does not exist, path=",
    ),
    "spawn a path of 100 000 characters": (
        lambda world: world.spawn_model("a" * 100_000, "new"),
        "Flatland YAML: Failed to read file, path=",
    ),
}


@pytest.mark.parametrize("name", REQUESTS)
def test_a_request(running_world: flatland.World, unchanged: Any, name: str) -> None:
    request, start = REQUESTS[name]
    with unchanged(running_world), pytest.raises(flatland.FlatlandError) as caught:
        request(running_world)
    assert str(caught.value).startswith(start)
