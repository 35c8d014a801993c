"""Invalid contents of files: the class of the error, its text, its line and its hint.

Files that differ in one entry are in the table errors.txt, all others are here.

`test_keys.py` generates the cases of single keys: missing, misspelled, of a wrong type or size.
Text that is not valid YAML and errors of `$include` are in the tests of `flatland.config`.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Iterator
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


def model(text: str, error: str, hint: str = "") -> Input:
    """Returns a model whose last line has an error."""
    return Input("model", text, f"Flatland YAML: {error}", text.count("\n"), hint)


def world(text: str, error: str, hint: str = "") -> Input:
    """Returns a world whose last line has an error."""
    return Input("world", text, f"Flatland YAML: {error}", text.count("\n"), hint)


def plugin(start: str, error: str, hint: str = "", body: str = BODY) -> Input:
    """Returns a model with a plugin; `start` begins with its type."""
    text = f"bodies: [{body}]\nplugins:\n  - {{name: p, type: {start}}}\n"
    name = f'Model Plugin "p" type "{start.split(",")[0]}" {PLACE}'
    return Input("model", text, f"Flatland plugin: {name}: {error}", 3, hint, "PluginError")


def world_plugin(start: str, error: str, hint: str = "") -> Input:
    """Returns a world with a plugin, and a robot on the line through the only wall."""
    text = (
        "properties: {}\nlayers: [{name: 2d, map: map.yaml}]\n"
        "models: [{name: robot, model: good.model.yaml, pose: [5, 9, 0]}]\n"
        f"plugins:\n  - {{name: w, type: {start}}}\n"
    )
    name = f'World Plugin "w" type "{start.split(",")[0]}"'
    return Input("world", text, f"Flatland plugin: {name}: {error}", 5, hint, "PluginError")


JOINTED = f"bodies: [{BODY}, {WHEEL}]\njoints:\n"
WORLD = "properties: {}\nlayers: "
YAML = "Flatland YAML: "
# By kind of a file, the place of its entry in errors, and the function that creates the input from
# the entry, the error and the hint.
KINDS: dict[str, tuple[str, Callable[..., Input]]] = {
    "body": (
        f'{PLACE} body "base"',
        lambda entry, *rest: model(f"bodies:\n  - {{name: base, {entry}}}\n", *rest),
    ),
    "footprint": (
        f'{PLACE} body "base" "footprints" index=0',
        lambda entry, *rest: model(
            f"bodies:\n  - {{name: base, footprints: [{{{entry}}}]}}\n", *rest
        ),
    ),
    "joint": (
        f'{PLACE} joint "j"',
        lambda entry, *rest: model(f"{JOINTED}  - {{name: j, {entry}}}\n", *rest),
    ),
    "plugin": (f'{PLACE} plugin "p"', lambda entry, error, hint: plugin(entry, YAML + error, hint)),
    "raising plugin": ("", plugin),
    "layers": ('"layers" index=0', lambda entry, *rest: world(f"{WORLD}{entry}\n", *rest)),
    "models": ("", lambda entry, *rest: world(f"{WORLD}[]\nmodels: [{entry}]\n", *rest)),
    "world plugin": (
        'world_plugin "w"',
        lambda entry, error, hint: world_plugin(entry, YAML + error, hint),
    ),
    "raising world plugin": ("", world_plugin),
}


def read_table() -> Iterator[tuple[str, Input]]:
    """Yields the names and inputs of errors.txt."""
    text = Path(__file__).with_name("errors.txt").read_text()
    for block in re.split(r"\n(?=\w)", text.split("\n", 3)[3].rstrip()):
        head, *rows = re.split(r"\n  (?! )", block)
        kind, _, start = head.partition(":")
        for row in rows:
            entry, error, *hint = (line.strip() for line in row.split("\n"))
            entry = f"{start.strip()}, {entry}" if start else entry
            place, create = KINDS[kind]
            hint_text = "".join(hint).removeprefix("hint: ")
            yield f"{kind}: {entry}", create(entry, error.replace("@", place), hint_text)


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


NO_BODY = f'{YAML}Body with name "bas" does not exist'
ON_A_BODY = ("DiffDrive", "Gps", "Imu", "Tween", "BoolSensor", "PosePublisher", "TricycleDrive")
NO_FORCE = f'{YAML}"mode: force" requires a dynamic body with a mass, but body "base"'
FORCE = "DiffDrive, body: base, mode: force, max_force: 1, max_torque: 1"
TWO_WHEELS = f"bodies:\n  - {WHEEL}\n  - {WHEEL}\n"
TWO_JOINTS = f"  - {{name: j, type: weld, bodies: {ENDS}}}\n" * 2
TWO_PLUGINS = "  - {name: p, type: ModelTfPublisher}\n" * 2
NO_WHEEL = f"[{BODY}, {{name: wheel, footprints: [], enabled: false}}]"
INPUTS: dict[str, Input] = {
    **dict(read_table()),
    # Models.
    "no bodies": model(
        "bodies: []\n",
        'Invalid "bodies" in "robot" model, must be a list of bodies of at least size 1',
    ),
    "body twice": model(
        TWO_WHEELS, 'Invalid "bodies" in "robot" model, body with name "wheel" already exists'
    ),
    "joint of a disabled body": model(
        f"bodies: {NO_WHEEL}\njoints:\n  - {{name: j, type: weld, bodies: {ENDS}}}\n",
        f'Cannot find body with name "wheel" in {PLACE} joint "j" "bodies" index=1',
        "bodies of the model: base",
    ),
    "joint twice": model(
        f"bodies: [{BODY}, {WHEEL}]\njoints:\n{TWO_JOINTS}",
        'Invalid "joints" in "robot" model, joint with name "j" already exists',
    ),
    "plugin twice": model(
        f"bodies: [{BODY}]\nplugins:\n{TWO_PLUGINS}",
        'Invalid "plugins" in "robot" model, plugin with name "p" already exists',
    ),
    # Plugins.
    **{
        entry: plugin(entry, NO_BODY, 'did you mean "base"?')
        for entry in (
            *(f"{name}, body: bas" for name in ON_A_BODY),
            "Laser, body: bas, range: 5, angle: {min: 0, max: 1, increment: 1}",
            "WheelStates, wheels: [{name: w, radius: 1}], body: bas",
            "ModelTfPublisher, reference: bas",
            "ModelTfPublisher, exclude: [base, bas]",
            "Bumper, exclude: [base, bas]",
        )
    },
    "covariance of NaN": plugin(
        f"DiffDrive, body: base, odom_twist_covariance: [{', '.join(['.nan'] * 36)}]",
        f'{YAML}Invalid "odom_twist_covariance", must not hold NaN (in {PLACE} plugin "p")',
    ),
    "force of a kinematic body": plugin(
        FORCE, f"{NO_FORCE} is kinematic", body=BODY.replace("base,", "base, type: kinematic,")
    ),
    "force of a body without a mass": plugin(
        FORCE, f"{NO_FORCE} has none", body="{name: base, footprints: []}"
    ),
    # Worlds.
    "a list": world("[a]\n", "Entry must be a map"),
    "a text": world("text\n", "Entry must be a map"),
    "two unknown keys": world(
        "{properties: {}, layers: [], b: 1, a: 2}\n",
        'Entry contains unrecognized entry(s) {"a", "b"}',
        "other keys that are known here: models, plugins",
    ),
    "published map": world(
        "layers: [{name: [a, c]}, {name: b}]\nproperties:\n  publish_map: roof\n",
        'Invalid "publish_map", must be the name of a layer (a, b), got roof (in "properties")',
    ),
    "published map without layers": world(
        "layers: []\nproperties: {publish_map: roof}\n",
        'Invalid "publish_map", must be the name of a layer (none), got roof (in "properties")',
    ),
    "model twice": world(
        f"{WORLD}[]\nmodels:\n" + "  - {name: m, model: good.model.yaml}\n" * 2,
        'Model with name "m" already exists',
    ),
    "world plugin twice": world(
        "properties: {}\nlayers: []\nplugins:\n  - {name: w, type: DummyWorldPlugin}\n"
        "  - {name: w, type: DummyWorldPlugin}\n",
        'Invalid "world plugins" with name "w", type "DummyWorldPlugin" already exists',
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
    (folder / "zero.model.yaml").write_text(KINDS["footprint"][1](entries, "").text)
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
