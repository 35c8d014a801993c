"""Invalid contents of files: the class of the error, its text, its line and its hint.

`test_keys.py` generates the cases of single keys: missing, misspelled, of a wrong type or size. The
parameters of plugins with a rule of their own are in the tests of the plugins, text that is not
valid YAML and errors of `$include` are in the tests of `flatland.config`.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import flatland
from flatland.plugin_api.manifest import read_manifest

NAN, INF = math.nan, math.inf
BODY = "{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}"
WHEEL = "{name: wheel, footprints: []}"
ENDS = "[{name: base, anchor: [0, 0]}, {name: wheel, anchor: [0, 0]}]"
PLACE = 'model "robot"'
FOOTPRINT = f'{PLACE} body "base" "footprints" index=0'
LASER = "type: Laser, body: base, range: 5, angle: {min: 0, max: 1, increment: 0.5}"


@dataclass(frozen=True)
class Input:
    """A file and its error.

    Attributes:
        role: `model`, `world` or `map`.
        text: The file.
        error: Text of the error, without the place at its end; `{path}` is the file, `{folder}` its
            folder.
        line: Line of the place, 0 if the text contains the position.
        hint: The hint of the error.
        error_class: Class of the error.
    """

    role: str
    text: str
    error: str
    line: int
    hint: str = ""
    error_class: str = "YamlError"


def model(text: str, error: str, line: int = 1, hint: str = "") -> Input:
    return Input("model", text, f"Flatland YAML: {error}", line, hint)


def body(entries: str, error: str, hint: str = "") -> Input:
    """Returns a model with one body that has further entries."""
    return model(f"bodies:\n  - {{name: base, {entries}}}\n", error, 2, hint)


def footprint(entries: str, error: str, hint: str = "") -> Input:
    """Returns a model with one footprint."""
    return body(f"footprints: [{{{entries}}}]", error, hint)


def polygon(points: str, error: str, hint: str = "") -> Input:
    return footprint(f"type: polygon, density: 1, points: {points}", error, hint)


def joint(entries: str, error: str, hint: str = "") -> Input:
    text = f"bodies: [{BODY}, {WHEEL}]\njoints:\n  - {{name: j, {entries}}}\n"
    return model(text, error, 3, hint)


def plugin(type_name: str, entries: str, error: str, hint: str = "") -> Input:
    text = f"bodies: [{BODY}]\nplugins:\n  - {{name: p, type: {type_name}, {entries}}}\n"
    start = f'Flatland plugin: Model Plugin "p" type "{type_name}" {PLACE}: Flatland YAML: '
    return Input("model", text, start + error, 3, hint, "PluginError")


def laser(old: str, new: str, error: str, hint: str = "") -> Input:
    return plugin("Laser", LASER.replace(old, new).removeprefix("type: Laser, "), error, hint)


def world(text: str, error: str, line: int = 1, hint: str = "") -> Input:
    return Input("world", text, f"Flatland YAML: {error}", line, hint)


def layers(text: str, error: str, hint: str = "") -> Input:
    return world(f"properties: {{}}\nlayers: {text}\n", error, 2, hint)


def models(text: str, error: str, line: int = 3, hint: str = "") -> Input:
    return world(f"properties: {{}}\nlayers: []\nmodels: [{text}]\n", error, line, hint)


def world_plugin(text: str, error: str) -> Input:
    entry = f"properties: {{}}\nlayers: []\nplugins:\n  - {{name: w, type: {text}}}\n"
    return Input("world", entry, f"Flatland plugin: {error}", 4, "", "PluginError")


def image_map(error: str, line: int, **keys: str) -> Input:
    entries = {
        "image": "map.png",
        "resolution": "0.1",
        "origin": "[0, 0, 0]",
        "occupied_thresh": "0.5",
        **keys,
    }
    text = "".join(f"{key}: {value}\n" for key, value in entries.items())
    return Input("map", text, f'Flatland YAML: {error} (in layer "2d")', line)


def line_map(scale: str, error: str) -> Input:
    text = f"type: line_segments\ndata: walls.dat\nscale: {scale}\norigin: [0, 0, 0]\n"
    return Input("map", text, f'Flatland YAML: Invalid "scale", {error} (in layer "2d")', 3)


NO_BODIES = 'Invalid "bodies" in "robot" model, must be a list of bodies of at least size 1'
TWO_ITEMS = f'Invalid "bodies" in {PLACE} joint "j", must be a sequence of exactly two items'
RANGE = 'Invalid "range", must be greater than 0 and at most 1e+06 m, got '
NINE_POINTS = f"[{', '.join(['[0, 0]'] * 9)}]"
NO_BODY = ('Body with name "bas" does not exist', 'did you mean "base"?')
TWO_WHEELS = f"bodies:\n  - {WHEEL}\n  - {WHEEL}\n"
TWO_JOINTS = f"  - {{name: j, type: weld, bodies: {ENDS}}}\n" * 2
TWO_PLUGINS = "  - {name: p, type: ModelTfPublisher}\n" * 2
NO_WHEEL = f"[{BODY}, {{name: wheel, footprints: [], enabled: false}}]"
FIFTEEN = ", ".join(f"l{number}" for number in range(15))
SEVENTEEN = ", ".join(f"n{number}" for number in range(17))
RANGES = {"0": "0.0", "-1": "-1.0", ".nan": "nan", ".inf": "inf", "1e308": "1e+308"}
INPUTS: dict[str, Input] = {
    # Models.
    "no bodies": model("bodies: []\n", NO_BODIES),
    "all bodies disabled": body("footprints: [], enabled: false", NO_BODIES),
    "body twice": model(
        TWO_WHEELS, 'Invalid "bodies" in "robot" model, body with name "wheel" already exists', 3
    ),
    "body type": body(
        "footprints: [], type: dynamik",
        f'Invalid "type" in {PLACE} body "base", must be one of: static, kinematic, dynamic',
        'did you mean "dynamic"?',
    ),
    "footprint type": footprint(
        "type: box, density: 1",
        f'Invalid footprint "type" in {FOOTPRINT}, support footprints are: circle, polygon',
        'did you mean "polygon"?',
    ),
    "footprint layers": footprint(
        "type: circle, radius: 1, density: 1, layers: [2d, 5d, 6d]",
        f'Invalid footprint "layers" in {FOOTPRINT}, {{5d,6d}} layer(s) does not exist',
        "layers of the world: 2d, 3d",
    ),
    "points of a circle": footprint(
        "type: circle, radius: 1, density: 1, points: []",
        f'Entry index=0 contains unrecognized entry(s) {{"points"}} (in {PLACE} body "base" '
        '"footprints")',
        "other keys that are known here: center, collision, friction, layers, material, "
        "restitution, sensor",
    ),
    "transmission and specular": footprint(
        "type: circle, radius: 1, density: 1, material: {transmission: 0.5, specular: 0.6}",
        'Invalid "specular", transmission + specular must be at most 1, got 0.5 + 0.6 '
        f'(in {FOOTPRINT} "material")',
    ),
    "two points": polygon(
        "[[0, 0], [1, 0]]", f'Entry "points" must have size >= 3 (in {FOOTPRINT})'
    ),
    "nine points": polygon(NINE_POINTS, f'Entry "points" must have size <= 8 (in {FOOTPRINT})'),
    "point of three": polygon(
        "[[0, 0], [1, 0], [1, 1, 1]]",
        f'Error converting entry index=2 to vector (in {FOOTPRINT} "points")',
        hint="two numbers are written as [x, y]",
    ),
    "point with NaN": polygon(
        "[[0, 0], [1, .nan], [0, 1]]",
        'Invalid "points", must be finite, got [(0.0, 0.0), (1.0, nan), (0.0, 1.0)] '
        f"(in {FOOTPRINT})",
    ),
    "collinear points": polygon(
        "[[0, 0], [1, 0], [2, 0]]",
        f"Invalid entry in {FOOTPRINT}, a polygon must have a positive area, but its points are "
        "collinear",
    ),
    "radius 1e308": footprint(
        "type: circle, radius: 1e308, density: 1",
        f"Invalid entry in {FOOTPRINT}, radius must be finite and within +-1e+09, got 1e+308",
    ),
    "pose 1e308": body(
        "footprints: [], pose: [1e308, 0, 0]",
        f'Invalid entry in {PLACE} body "base", '
        "pose must be finite and within +-1e+09, got (1e+308, 9)",
    ),
    "joint type": joint(
        f"type: hinge, bodies: {ENDS}",
        f'Invalid joint "type" in {PLACE} joint "j", supported joints are: revolute, weld',
        'did you mean "revolute"?',
    ),
    "joint of one body": joint("type: weld, bodies: [{name: base, anchor: [0, 0]}]", TWO_ITEMS),
    "joint without bodies": joint("type: weld, bodies: []", TWO_ITEMS),
    "joint of an unknown body": joint(
        f"type: weld, bodies: {ENDS.replace('wheel', 'wheeel')}",
        f'Cannot find body with name "wheeel" in {PLACE} joint "j" "bodies" index=1',
        'did you mean "wheel"?',
    ),
    "joint of a disabled body": model(
        f"bodies: {NO_WHEEL}\njoints:\n  - {{name: j, type: weld, bodies: {ENDS}}}\n",
        f'Cannot find body with name "wheel" in {PLACE} joint "j" "bodies" index=1',
        3,
        "bodies of the model: base",
    ),
    "joint of a body with itself": joint(
        f"type: weld, bodies: {ENDS.replace('wheel', 'base')}",
        f'Invalid entry in {PLACE} joint "j", a joint must connect two different bodies',
    ),
    "anchor 1e308": joint(
        f"type: weld, bodies: {ENDS.replace('[0, 0]', '[1e308, 0]')}",
        f'Invalid entry in {PLACE} joint "j", '
        "anchor_a must be finite and within +-1e+09, got (1e+308, 0)",
    ),
    "limits in the wrong order": joint(
        f"type: revolute, bodies: {ENDS}, limits: [1, -1]",
        'Invalid "limits", the lower limit 1.0 must not be above the upper limit -1.0 '
        f'(in {PLACE} joint "j")',
    ),
    "limits of a weld": joint(
        f"type: weld, bodies: {ENDS}, limits: [-1, 1]",
        f'Entry joint "j" contains unrecognized entry(s) {{"limits"}} (in {PLACE})',
        "other keys that are known here: angle, collide_connected, color, damping, enabled, "
        "frequency",
    ),
    "angle of a revolute joint": joint(
        f"type: revolute, bodies: {ENDS}, frequency: 2, angle: 1",
        f'Entry joint "j" contains unrecognized entry(s) {{"angle", "frequency"}} (in {PLACE})',
        "other keys that are known here: collide_connected, color, enabled, limits",
    ),
    "joint twice": model(
        f"bodies: [{BODY}, {WHEEL}]\njoints:\n{TWO_JOINTS}",
        'Invalid "joints" in "robot" model, joint with name "j" already exists',
        4,
    ),
    "plugin twice": model(
        f"bodies: [{BODY}]\nplugins:\n{TWO_PLUGINS}",
        'Invalid "plugins" in "robot" model, plugin with name "p" already exists',
        4,
    ),
    # Plugins.
    "Laser increment 0": laser(
        "increment: 0.5", "increment: -0", 'Invalid "angle" params, increment must not be zero!'
    ),
    "Laser max < min": laser(
        "max: 1", "max: -1", 'Invalid "angle" params, must have max > min when increment > 0'
    ),
    "Laser min < max": laser(
        "increment: 0.5",
        "increment: -0.5",
        'Invalid "angle" params, must have min > max when increment < 0',
    ),
    "Laser angle NaN": laser(
        "max: 1", "max: .nan", 'Invalid "angle" params, must be finite, got [0.0, nan, 0.5]'
    ),
    "Laser increment inf": laser(
        "increment: 0.5",
        "increment: .inf",
        'Invalid "angle" params, must be finite, got [0.0, 1.0, inf]',
    ),
    "Laser with too many beams": laser(
        "increment: 0.5",
        "increment: 1e-300",
        'Invalid "angle" params, more than 1000000 beams between 0.0 and 1.0 in steps of 1e-300',
    ),
    **{
        f"Laser range {text}": laser("range: 5", f"range: {text}", RANGE + got)
        for text, got in RANGES.items()
    },
    "Laser layers": laser(
        "range: 5",
        "layers: [a, 2d, b], range: 5",
        "Cannot find layer(s): {a,b}",
        "layers of the world: 2d, 3d",
    ),
    "Laser no_hit": laser(
        "range: 5",
        "no_hit: zero, range: 5",
        'Invalid "no_hit", must be one of: nan, inf, range, got zero',
    ),
    **{
        f"{name} of an unknown body": plugin(name, f"{key}: bas{more}", *NO_BODY)
        for name, key, more in (
            ("Laser", "body", ", range: 5, angle: {min: 0, max: 1, increment: 1}"),
            ("DiffDrive", "body", ""),
            ("Gps", "body", ""),
            ("Imu", "body", ""),
            ("Tween", "body", ""),
            ("BoolSensor", "body", ""),
            ("PosePublisher", "body", ""),
            ("TricycleDrive", "body", ""),
            ("WheelStates", "wheels: [{name: w, radius: 1}], body", ""),
            ("ModelTfPublisher", "reference", ""),
        )
    },
    "Bumper excludes an unknown body": plugin("Bumper", "exclude: [base, bas]", *NO_BODY),
    "ModelTfPublisher excludes an unknown body": plugin(
        "ModelTfPublisher", "exclude: [base, bas]", *NO_BODY
    ),
    "TricycleDrive of an unknown joint": plugin(
        "TricycleDrive",
        "body: base, front_wheel_joint: f, rear_left_wheel_joint: l, rear_right_wheel_joint: r",
        'Joint with name "f" does not exist',
        "joints of the model: none",
    ),
    "Tween mode": plugin(
        "Tween",
        "body: base, mode: jump",
        "Mode jump does not exist",
        "modes: yoyo, loop, once, trigger",
    ),
    "Tween easing": plugin(
        "Tween",
        "body: base, easing: Linear",
        "Easing Linear does not exist",
        'did you mean "linear"?',
    ),
    "Tween duration 0": plugin(
        "Tween",
        "body: base, duration: 0",
        'Invalid "duration", must be greater than 0, got 0.0',
    ),
    "Gps at 91 degrees": plugin(
        "Gps", "body: base, ref_lat: 91", 'Invalid "ref_lat", must be from -90 to 90, got 91.0'
    ),
    "Imu with both rates": plugin(
        "Imu",
        "body: base, update_rate: 5, pub_rate: 5",
        'Invalid "pub_rate", the older spelling of "update_rate", must not be combined with it',
    ),
    "PosePublisher of another message": plugin(
        "PosePublisher",
        "message: tf",
        'Invalid "message", must be one of: pose, odometry, got tf',
    ),
    "PosePublisher of a pose with a child frame": plugin(
        "PosePublisher",
        "child_frame_id: base",
        'Invalid "child_frame_id", only used with "message: odometry"',
    ),
    "Dummy with another float": plugin(
        "DummyModelPlugin",
        "dummy_param_float: 0.5, dummy_param_string: dummy_test_123456, dummy_param_int: 123456",
        'Invalid "dummy_param_float", must be 0.123456, got 0.5',
    ),
    "Dummy with another text": plugin(
        "DummyModelPlugin",
        "dummy_param_float: 0.123456, dummy_param_string: x, dummy_param_int: 123456",
        'Invalid "dummy_param_string", must be dummy_test_123456, got x',
    ),
    "Dummy with another number": plugin(
        "DummyModelPlugin",
        "dummy_param_float: 0.123456, dummy_param_string: dummy_test_123456, dummy_param_int: 7",
        'Invalid "dummy_param_int", must be 123456, got 7',
    ),
    # Worlds.
    "a list": world("[a]\n", "Entry must be a map"),
    "a text": world("text\n", "Entry must be a map"),
    "two unknown keys": world(
        "{properties: {}, layers: [], b: 1, a: 2}",
        'Entry contains unrecognized entry(s) {"a", "b"}',
        hint="other keys that are known here: models, plugins",
    ),
    "layer without a map": layers(
        "[2d]",
        'Entry index=0 must be a map (in "layers")',
        "a layer is written as {name: walls, map: map.yaml}",
    ),
    "second layer": layers(
        "[{name: L}, {name: [K, J], color: red}]",
        'Entry "color" must be a list (in "layers" index=1)',
        "[r, g, b, a], each from 0 to 1",
    ),
    "layer twice": layers("[{name: 2d}, {name: [3d, 2d]}]", 'Layer with name "2d" already exists'),
    "layer alias twice": layers("[{name: [b, b]}]", 'Layer with name "b" already exists'),
    "17 layers": layers(
        f"[{{name: [{SEVENTEEN}]}}]",
        f"Unable to add 17 additional layer(s) {{{SEVENTEEN}}}, current layers count is 0, max "
        "allowed is 16",
    ),
    "two layers beside 15": layers(
        f"[{{name: [{FIFTEEN}]}}, {{name: [a, b]}}]",
        "Unable to add 2 additional layer(s) {a, b}, current layers count is 15, max allowed is 16",
    ),
    "class of a layer": layers(
        "[{name: 2d, class: ''}]", 'Invalid "class", must not be empty (in "layers" index=0)'
    ),
    "published map": world(
        "layers: [{name: [a, c]}, {name: b}]\nproperties:\n  publish_map: roof\n",
        'Invalid "publish_map", must be the name of a layer (a, b), got roof (in "properties")',
        3,
    ),
    "published map without layers": world(
        "layers: []\nproperties: {publish_map: roof}\n",
        'Invalid "publish_map", must be the name of a layer (none), got roof (in "properties")',
        2,
    ),
    "model twice": models(
        "{name: m, model: good.model.yaml},\n{name: m, model: good.model.yaml}",
        'Model with name "m" already exists',
        4,
    ),
    "illegal namespace": models(
        "{name: m, model: good.model.yaml, namespace: my robot}",
        'failed to spawn model "m", namespace "my robot" is not a legal ROS name: '
        'it must start with a letter and hold only letters, digits, "_" and "/"',
    ),
    "empty model name": models(
        "{name: '', model: good.model.yaml}",
        "failed to spawn model, its name must not be empty",
    ),
    "empty model path": models(
        "{name: m, model: ''}", 'failed to spawn model "m", the path must not be empty'
    ),
    "map of an invalid topic": layers(
        "[{name: a, map: 'topic://my map'}]",
        'Invalid "map", "my map" is not a legal topic name: it must start with a letter or "/" and '
        'hold only letters, digits, "_" and "/", expected topic:///map (in "layers" index=0)',
    ),
    "missing map": layers(
        "[{name: a, map: nothing.map.yaml}]",
        'File does not exist, path="{folder}/nothing.map.yaml"',
    ),
    "missing model": models(
        "{name: m, model: god.model.yaml}",
        'File does not exist, path="{folder}/god.model.yaml"',
        hint='did you mean "good.model.yaml"?',
    ),
    "model of an unknown user": models(
        "{name: m, model: ~no-such-user/m.yaml}",
        'File does not exist, path="{folder}/~no-such-user/m.yaml"',
        hint='the folder "{folder}/~no-such-user" does not exist',
    ),
    "world plugin twice": world(
        "properties: {}\nlayers: []\nplugins:\n  - {name: w, type: DummyWorldPlugin}\n"
        "  - {name: w, type: DummyWorldPlugin}\n",
        'Invalid "world plugins" with name "w", type "DummyWorldPlugin" already exists',
        5,
    ),
    "world plugin of a model": world_plugin(
        "Laser",
        'World Plugin "w" type "Laser": class "flatland.plugins.laser.Laser" of plugin '
        '"flatland_plugins::Laser" must be a flatland::WorldPlugin, got a flatland::ModelPlugin',
    ),
    "wall without a layer": world_plugin(
        "RandomWall, layer: a, robot_name: r",
        'World Plugin "w" type "RandomWall": layer with name "a" does not exist',
    ),
    # Maps.
    "map that is a list": Input(
        "map", "[a]\n", 'Flatland YAML: Entry must be a map (in layer "2d")', 1
    ),
    "resolution 0": image_map(
        'Invalid "resolution", must be positive, got -0.0', 2, resolution="-0"
    ),
    "resolution -0.05": image_map(
        'Invalid "resolution", must be positive, got -0.05', 2, resolution="-0.05"
    ),
    "resolution 1e38": image_map(
        'Invalid "resolution", resolution must be positive and the size of the map in the range of '
        "a 32-bit float, got 1e+38",
        2,
        resolution="1e38",
    ),
    "type that is a list": image_map('Error converting entry "type" to string', 5, type="[indoor]"),
    "null character in the name of an image": Input(
        "map",
        image_map("", 1, image='"a\\0b"').text,
        'Flatland YAML: Failed to load "{folder}/a\0b" in layer "2d"',
        1,
        "the file does not exist",
    ),
    "null character in the name of data": Input(
        "map",
        line_map("1", "").text.replace("walls.dat", '"a\\0b"'),
        'Flatland File: Failed to load "{folder}/a\0b"',
        2,
        error_class="MapFileError",
    ),
    "scale 0": line_map("0", "must not be 0"),
    "scale -0": line_map("-0", "must not be 0"),
    "scale 1e308": line_map("1e308", "a coordinate does not fit a 32-bit float"),
}


@pytest.mark.parametrize("name", INPUTS)
def test_an_input(running_world: flatland.World, folder: Path, unchanged: Any, name: str) -> None:
    given = INPUTS[name]
    path = folder / f"input.{given.role}.yaml"
    path.write_text(given.text)
    world = running_world if given.role == "model" else None
    requests: dict[str, Callable[[], object]] = {
        "model": lambda: running_world.spawn_model(path, "robot", "robot", (9, 9, 0)),
        "world": lambda: flatland.World.from_yaml(path, seed=1),
        "map": lambda: flatland.World.from_yaml(folder / "mapped.yaml", seed=1),
    }
    with unchanged(world), pytest.raises(flatland.FlatlandError) as caught:
        requests[given.role]()
    error = caught.value
    place = f" [{path}:{given.line}]" if given.line else ""
    text = (given.error + place).replace("{path}", str(path))
    assert str(error) == text.replace("{folder}", str(folder))
    assert type(error).__name__ == given.error_class
    assert error.hint == given.hint.replace("{folder}", str(folder))


@pytest.mark.parametrize("number", ["0", "-0"])
@pytest.mark.parametrize("key", ["radius", "density", "friction", "restitution"])
def test_zero_is_valid_with_any_sign(
    running_world: flatland.World, folder: Path, unchanged: Any, key: str, number: str
) -> None:
    values = {"type": "circle", "radius": "1", "density": "1", key: number}
    entries = ", ".join(f"{name}: {value}" for name, value in values.items())
    (folder / "zero.model.yaml").write_text(footprint(entries, "").text)
    with unchanged(running_world):
        running_world.spawn_model("zero.model.yaml", "zero", pose=(9, 9, 0))
        running_world.delete_model("zero")


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
