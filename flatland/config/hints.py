"""Hints for frequent mistakes in YAML files, in addition to the texts of errors."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable
from itertools import islice
from pathlib import Path

_MIN_SIMILARITY = 0.6
_MAX_FILES = 1000  # of a folder, compared with the name of a missing file

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


def did_you_mean(word: str, candidates: Iterable[str]) -> str:
    """Returns a question with the candidate that is most similar to a word; empty if none is."""
    similar = _most_similar(word, candidates)
    return "" if similar is None else f'did you mean "{similar}"?'


def _most_similar(word: str, candidates: Iterable[str]) -> str | None:
    by_lower = {candidate.lower(): candidate for candidate in candidates}
    found = difflib.get_close_matches(word.lower(), by_lower, 1, _MIN_SIMILARITY)
    return by_lower[found[0]] if found else None


def unknown_key(key: str, known: Iterable[str]) -> str:
    """Returns a hint for a key that is not used.

    Args:
        key: The key.
        known: Keys that are not in the map but would have been used.
    """
    if key.isdigit():
        return "decimals are written with a point, as in 0.5"
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
    similar = _most_similar(key, unread)
    if similar is not None:
        return f'"{similar}" in line {unread[similar]} may be a misspelling of "{key}"'
    return _MISSING_KEYS.get(key, "")


def wrong_size(key: str) -> str:
    """Returns a hint for a list with a wrong number of items."""
    return _SIZES.get(key.strip('"'), "")


def choice(value: str, choices: Iterable[str]) -> str:
    """Returns a hint for a value that is not one of some words."""
    meant = _VALUES.get(value.lower(), "")
    choices = list(choices)
    return f'did you mean "{meant}"?' if meant in choices else did_you_mean(value, choices)


def conversion(text: str, kind: str) -> str:
    """Returns a hint for a scalar that cannot be converted.

    Args:
        text: The scalar.
        kind: Name of the kind of value in the error message.
    """
    if kind in ("float", "int"):
        if re.fullmatch(r"[-+]?\d+,\d+", text):
            return f"decimals are written with a point: {text.replace(',', '.')}"
        if re.fullmatch(r"[-+]?[\d.]+ *(deg|degrees|°)", text):
            return f"angles are in radians: $eval math.rad({re.split('[ d°]', text)[0]})"
        if match := re.fullmatch(r"([-+]?[\d.]+) *[a-zA-Z/%²]+", text):
            return f"numbers are written without a unit: {match[1]}"
        if kind == "int" and re.fullmatch(r"[-+]?\d+\.\d*", text):
            return f"a whole number without a point is required, such as {text.split('.')[0]}"
        if re.search(r"[-+*/]|pi", text):
            return f"expressions start with $eval: $eval {text}"
    if kind == "bool":
        return "true or false"
    return ""


def similar_file(path: str) -> str:
    """Returns a hint for a file that does not exist: a similar name, or a missing folder."""
    file = Path(path)
    try:
        if file.exists():
            return ""
        if not file.parent.is_dir():
            return f'the folder "{file.parent}" does not exist'
        # The simulation may be waiting for this, and the folder may be large.
        names = (entry.name for entry in islice(file.parent.iterdir(), _MAX_FILES))
        return did_you_mean(file.name, names)
    except (OSError, ValueError):
        return ""


def malformed(why: str) -> str:
    """Returns a hint for a text that is not valid YAML."""
    if "cannot start any token" in why:
        return "indent with spaces, not with tabs, and quote values that start with @, ` or %"
    if "mapping values are not allowed" in why:
        return "check the indentation, and quote values that contain a colon"
    if "did not find expected" in why:
        return "check the indentation, brackets and commas of this and the previous lines"
    return ""
