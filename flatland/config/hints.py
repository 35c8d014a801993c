"""Hints for frequent mistakes in YAML files, in addition to the texts of errors."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Iterable
from itertools import islice
from pathlib import Path

from flatland.config.files import IMAGE_SUFFIXES
from flatland.config.foreign_files import escape_error, foreign_path
from flatland.config.plugin_parameters import owners_of
from flatland.suggestions import did_you_mean as did_you_mean
from flatland.suggestions import question, similar_names

_MAX_SHOWN = 40  # characters of a value
_MAX_FILES = 1000  # of a folder, compared with the name of a missing file
_CONFLICT_MARKER = re.compile(r"^(<{7}|={7}|>{7})(?: .*)?$", re.MULTILINE)

_UNKNOWN_KEYS = {
    "mass": "the mass results from the density [kg/m²] and the area of the footprints",
    "position": 'poses are written as "pose: [x, y, theta]"',
    "orientation": 'poses are written as "pose: [x, y, theta]"',
    "rotation": 'poses are written as "pose: [x, y, theta]"',
    "origin": 'poses are written as "pose: [x, y, theta]"',
    "shape": 'shapes are entries of the list "footprints" of a body',
    "geometry": 'shapes are entries of the list "footprints" of a body',
    "fixtures": 'shapes are entries of the list "footprints" of a body',
    "width": "a rectangle is a polygon with four points",
    "length": "a rectangle is a polygon with four points",
    "height": "a rectangle is a polygon with four points",
    "size": "a rectangle is a polygon with four points",
    "parent": 'a joint has a list "bodies" of two entries {name: BODY, anchor: [x, y]}',
    "child": 'a joint has a list "bodies" of two entries {name: BODY, anchor: [x, y]}',
    "rate": "most plugins call their rate [Hz] update_rate or pub_rate",
    "hz": "most plugins call their rate [Hz] update_rate or pub_rate",
}
_MISSING_KEYS = {
    "properties": 'every world file has the key; "properties: {}" is enough',
    "layers": 'every world file has the key; "layers: []" is a world without walls',
    "bodies": "a model file has a list of bodies, each with a name and footprints",
    "footprints": '"footprints: []" is a body without a shape',
    "density": "in kg/m², for example 1; 0 for parts without mass",
    "resolution": "size of a pixel [m], for example 0.05",
    "occupied_thresh": "pixels of at least this brightness (0 to 1) are on, for example 0.65",
    "origin": "[x, y, theta] of the lower left pixel [m, m, rad]",
}
_SIZES = {"pose": "[x, y, theta] in m and rad", "color": "[r, g, b, a], each from 0 to 1"}
_SIZES |= {"origin": _SIZES["pose"], "anchor": "[x, y] in m", "center": "[x, y] in m"}
_ITEMS = {
    "layers": "a layer is written as {name: walls, map: map.yaml}",
    "models": "a model is written as {name: robot, model: robot.model.yaml}",
    "bodies": "a body is written as {name: base, footprints: []}",
    "footprints": "a footprint is written as {type: circle, radius: 0.2, density: 1}",
    "plugins": "a plugin is written as {type: DiffDrive, name: drive, body: base}",
}
_VALUES = {
    "fixed": "weld",
    "rigid": "weld",
    "hinge": "revolute",
    "continuous": "revolute",
    "box": "polygon",
    "rectangle": "polygon",
    "rect": "polygon",
    "disc": "circle",
    "sphere": "circle",
    "cylinder": "circle",
}


_NAN = "nan is the result of an invalid computation, such as 0/0"
_NOT_A_NUMBER = r"(?i:[-+]?(\.?nan(\(.*\))?|1\.#(ind|qnan|snan))\d*)"
_INFINITY = r"(?i:[-+]?(\.?inf(inity)?|1\.#inf)\d*)"
_WITH_UNIT = r"([-+]?(?:\d+\.?\d*|\.\d+)) *([a-zA-Zµ%][a-zA-Zµ/%²^\d]*)"
_SI = ["m", "meter", "meters", "s", "sec", "Hz", "hz", "kg", "N", "Nm", "rad", "rad/s", "m/s", "px"]
_SI += ["rad/s²", "rad/s^2", "m/s²", "m/s^2", "m/s2", "kg/m²", "kg/m^2", "kg/m2"]
_UNITS: dict[str, float] = dict.fromkeys(_SI, 1)
_UNITS |= {"cm": 0.01, "mm": 0.001, "km": 1000, "cm/s": 0.01, "mm/s": 0.001, "km/h": 1 / 3.6}
_UNITS |= {"ms": 0.001, "µs": 1e-6, "us": 1e-6, "min": 60, "kHz": 1000, "g": 0.001, "%": 0.01}
_UNITS |= {"rpm": math.tau / 60}
_ARITHMETIC = (
    r"(?:\d++\.?+\d*+(?:e[-+]?\d++)?+|\.\d++|(?:math\.)?(?:pi|sqrt|sin|cos|tan|rad)|[-+*/(),\s])++"
)
_XACRO = r"\$\{(.*)\}|\$\((?:eval|arg) (.*)\)"

MAX_TURNS = 1.02
"""Full turns above which an angle is suspicious; it may be rounded up."""
_ANGLE_STEP = math.pi / 12  # multiples of which are used in files
_ANGLE_ERROR = 0.005  # of a multiple that is written with two decimals
_NAN_ANGLE = (
    "map_saver writes nan if the orientation of the map is not a valid quaternion; the angle of a "
    "map is usually 0"
)


def unknown_key(key: str, known: Iterable[str], name: str = "") -> str:
    """Returns a hint for a key that is not used.

    Args:
        key: The key.
        known: Keys that are not in the map but would have been used.
        name: Name of the map in error messages.
    """
    if key.isdigit():
        return "decimals are written with a point, as in 0.5"
    owners = owners_of(key) if name.lower().startswith("plugin") else []
    if owners:  # A key of another plugin is no misspelling of one of this plugin.
        return f'"{key}" is a parameter of {" and ".join(owners)}'
    known = sorted(known)
    similar = did_you_mean(key, known)
    if similar or key.lower() in _UNKNOWN_KEYS:
        return similar or _UNKNOWN_KEYS[key.lower()]
    return f"other keys that are known here: {', '.join(known)}" if known else ""


def missing_key(key: str, unread: dict[str, int]) -> str:
    """Returns a hint for a required key that is missing.

    Args:
        key: The key.
        unread: Lines of the keys of the map that have not been read.
    """
    similar = similar_names(key, [each for each in unread if not owners_of(each)])
    if similar:
        return f'"{similar[0]}" in line {unread[similar[0]]} may be a misspelling of "{key}"'
    return _MISSING_KEYS.get(key, "")


def wrong_size(key: str) -> str:
    """Returns a hint for a list with a wrong number of items."""
    return _SIZES.get(key.strip('"'), "")


def not_a_list(key: str, location: str, text: str | None) -> str:
    """Returns a hint for an entry that should be a list.

    Args:
        key: Key of the entry, as in error messages.
        location: Location of the entry in error messages.
        text: The value; None for a map.
    """
    if text is None:
        return 'each item of a list starts with a dash and a space, "- "'
    # Lists of maps are written in several lines; the layers of a footprint are names.
    is_plain = key.strip('"') not in _ITEMS or (key == '"layers"' and location)
    bracketed = f"a list is written in brackets: [{text}]" if len(text) <= _MAX_SHOWN else ""
    return wrong_size(key) or (bracketed if is_plain else "")


def not_a_map(location: str) -> str:
    """Returns a hint for an entry that should be a map.

    Args:
        location: Location of the entry in error messages; ends with the key of the list.
    """
    return _ITEMS.get(location.rpartition(" ")[2].strip('"'), "")


def degrees(angle: float) -> str:
    """Returns a hint for an angle [rad] that is probably in degrees, empty for any other."""
    if not math.isfinite(angle) or abs(angle) <= MAX_TURNS * math.tau:
        return ""
    steps = angle / _ANGLE_STEP
    is_multiple = abs(steps - round(steps)) * _ANGLE_STEP < _ANGLE_ERROR
    if is_multiple and not float(angle).is_integer():
        return ""
    return (
        f"angles are in radians; {angle:g} degrees are {math.radians(angle):.6g}, or "
        f"$eval math.rad({angle:g})"
    )


def degrees_of(value: object, kind: object) -> str:
    """Returns a hint for the first angle of a value that is probably in degrees.

    Args:
        value: An angle, a pose, or a list of either.
        kind: Kind of the value, see `YamlReader.get`; others than angles and poses have no hint.
    """
    if kind not in ("angle", "pose"):
        return ""
    values = value if isinstance(value, list) else [value]
    if kind == "pose":
        values = [pose[2] for pose in values if isinstance(pose, tuple)]
    angles = (angle for angle in values if isinstance(angle, float))
    return next(filter(None, map(degrees, angles)), "")


def unmet_limit(value: object, kind: object, location: str) -> str:
    """Returns a hint for a value that is out of range or not finite.

    Args:
        value: A number, or a tuple or list of numbers.
        kind: Kind of the value, see `YamlReader.get`.
        location: Location of the value in error messages, with its name.
    """
    if isinstance(value, tuple) and math.isnan(value[-1]) and _is_map_origin(location):
        return _NAN_ANGLE
    return degrees_of(value, kind)


def choice(value: str, choices: Iterable[str]) -> str:
    """Returns a hint for a value that is not one of some words."""
    meant = _VALUES.get(value.lower(), "")
    choices = list(choices)
    return f'did you mean "{meant}"?' if meant in choices else did_you_mean(value, choices)


def conversion(text: str, kind: str, location: str = "") -> str:
    """Returns a hint for a scalar that cannot be converted.

    Args:
        text: The scalar.
        kind: Name of the kind of value in the error message.
        location: Location of the scalar in error messages.
    """
    if kind in ("float", "int") and len(text) <= _MAX_SHOWN:
        if re.fullmatch(_NOT_A_NUMBER, text):
            return _NAN_ANGLE if _is_map_origin(location) else _NAN
        return _number(text, kind)
    if kind == "bool":
        return "true or false"
    if kind == "vector":
        return "two numbers are written as [x, y]"
    return ""


def _is_map_origin(location: str) -> bool:
    return location.startswith('layer "') and location.endswith('"origin"')


def _number(text: str, kind: str) -> str:
    """Returns a hint for a text that should be a number."""
    if re.fullmatch(r"[-+]?\d+,\d+", text):
        return f"decimals are written with a point: {text.replace(',', '.')}"
    if re.fullmatch(_INFINITY, text):
        return f"infinity is written {'-' if text.startswith('-') else ''}.inf"
    if match := re.fullmatch(r"([-+]?[\d.]+) *(?:deg|degrees?|°)(/s)?", text):
        what = "angular velocities are in rad/s" if match[2] else "angles are in radians"
        return f"{what}: $eval math.rad({match[1]})"
    if match := re.fullmatch(_WITH_UNIT, text):
        factor = _UNITS.get(match[2])
        number = match[1] if factor in (None, 1) else f"{float(match[1]) * factor:.6g}"
        other = "" if factor is not None else ", but in SI units"
        return f"numbers are written without a unit{other or f': {number}'}"
    if kind == "int" and re.fullmatch(r"[-+]?\d+\.\d*", text):
        return f"a whole number without a point is required, such as {text.split('.')[0]}"
    if match := re.fullmatch(_XACRO, text):
        inner = match[1] or match[2]
        expression = _expression(inner)
        meant = f": {expression}" if expression else ', such as $eval param("/name", 1)'
        return f"expressions of xacro and of launch files are not evaluated here; use $eval{meant}"
    expression = _expression(text)
    return f"expressions start with $eval: {expression}" if expression else ""


def _expression(text: str) -> str:
    """Returns the expression of Lua for a text, empty if the text is not arithmetic."""
    from flatland.config.lua import EvalError, evaluate  # late, since only mistakes need it

    if not re.fullmatch(_ARITHMETIC, text):
        return ""
    code = re.sub(r"(?<![\w.])(pi|sqrt|sin|cos|tan|rad)", r"math.\1", text.strip())
    try:
        evaluate(code, lambda _: None)
    except EvalError:
        return ""
    return f"$eval {code}"


def is_yaml_name(file: Path) -> bool:
    """Returns whether a name can be that of a YAML file: it has no extension of an image."""
    return file.suffix.lower() not in IMAGE_SUFFIXES


def similar_file(path: str, accepts: Callable[[Path], bool] = is_yaml_name) -> str:
    """Returns a hint for a file that does not exist: a similar name, or a missing folder.

    Args:
        path: The file.
        accepts: Returns whether a file of the folder is a useful suggestion.
    """
    file = Path(path)
    try:
        if "\0" not in path and file.exists():
            return ""
        foreign = foreign_path(path)
        if foreign:
            return foreign
        slashed = Path(os.path.normpath(path.replace("\\", "/")))
        if "\\" in path:
            found = f': "{slashed}"' if slashed.exists() else ""
            return f"the parts of a path are separated by /, not by \\{found}"
        if not file.parent.is_dir():
            return f'the folder "{file.parent}" does not exist'
        # The simulation may wait for this function, and the folder may be large.
        files = islice(file.parent.iterdir(), _MAX_FILES)
        # The extension, which many files share, would make all names similar.
        names: dict[str, list[str]] = {}
        for entry in files:
            names.setdefault(entry.stem, []).append(entry.name)
        similar = [name for stem in similar_names(file.stem, names) for name in sorted(names[stem])]
        return question(name for name in similar if accepts(file.parent / name))
    except (OSError, ValueError):
        return ""


def duplicate_key(key: str) -> str:
    """Returns a hint for a key that occurs again in a later line of an item of a list."""
    return 'the next item of a list starts with a dash, "- "' if key in ("name", "type") else ""


def malformed(why: str, text: str) -> str:
    """Returns a hint for a text that is not valid YAML.

    Args:
        why: Description of the problem.
        text: The text.
    """
    marker = _CONFLICT_MARKER.search(text)
    if marker:
        line = text.count("\n", 0, marker.start()) + 1
        return f"line {line} is a conflict marker of a merge, {marker[1]}; resolve the conflict"
    if escape := escape_error(why):
        return escape
    if "cannot start any token" in why:
        return "indent with spaces, not with tabs, and quote values that start with @, ` or %"
    if "mapping values are not allowed" in why:
        return "check the indentation, and quote values that contain a colon"
    if "did not find expected" in why:
        return "check the indentation, brackets and commas of this and the previous lines"
    return ""
