"""Targets of `make fuzz`: functions that pass arbitrary bytes to one reader of files.

A target returns if the input is read or rejected with a documented error, and raises anything else.
`tests/unit/test_fuzz.py` passes the inputs in `tests/fuzz/corpus` to the same functions.
"""

from __future__ import annotations

import json
import os
import tempfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final
from unittest.mock import patch

import numpy as np

from flatland.config.convert import to_plain
from flatland.config.documents import load_documents
from flatland.config.inputs import Inputs
from flatland.config.reader import YamlReader
from flatland.errors import FlatlandError, MapFileError, PluginError, YamlError
from flatland.maps.grey_image import read_grey_image
from flatland.maps.line_segments import read_line_segments
from flatland.maps.map_file import load_map
from flatland.maps.map_image import image_edges, threshold_in_place
from flatland.plugin_api.manifest import read_manifest, read_reference_names
from flatland.plugin_api.package_exports import package_exports
from flatland.recording.log_file import RecordingError, decode_value, encode_value, read_recording

SEPARATOR: Final = b"\n%%\n"
"""Separates the files of an input that consists of several."""

PARAMS: Final = {"number": 1.5, "text": "a", "flag": True, "list": [1], "huge": 10**400}
_KINDS: Final = ("string", "int", "float", "bool", "vector", "pose", "color")
_MOST_READS: Final = 100  # entries of a map that are read as all kinds

# One folder for the whole process, since a target is called thousands of times per second.
_FOLDER: Final = tempfile.TemporaryDirectory(prefix="flatland_fuzz_")


def _file(name: str, content: bytes) -> str:
    path = Path(_FOLDER.name, name)
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(content)
    return str(path)


def fuzz_yaml(data: bytes) -> None:
    """Parses a YAML file."""
    try:
        roots = load_documents(_file("input.yaml", data), Inputs())
    except YamlError:
        return
    for root in roots:
        to_plain(root)


def fuzz_preprocessor(data: bytes) -> None:
    """Expands the first of up to four files, which can include each other, and reads its entries.

    The files are named `0.yaml` to `3.yaml`.
    """
    contents = data.split(SEPARATOR, 3)
    paths = [_file(f"{i}.yaml", content) for i, content in enumerate(contents)]
    try:
        reader = YamlReader.from_file(paths[0], PARAMS)
        keys = list(reader.keys())[:_MOST_READS]
    except YamlError:
        return
    for key in keys:
        for kind in _KINDS:
            try:
                reader.get(key, kind, None)
            except YamlError:
                continue


def fuzz_manifest(data: bytes) -> None:
    """Reads a plugin manifest."""
    path = _file("plugins.xml", data)
    for read in (read_manifest, read_reference_names):
        try:
            read(path)
        except PluginError:
            continue


def fuzz_package(data: bytes) -> None:
    """Finds the exports of a package file."""
    path = _file("package/package.xml", data)
    with patch.dict(os.environ, {"ROS_PACKAGE_PATH": str(Path(path).parent)}):
        package_exports()


def fuzz_map(data: bytes) -> None:
    """Loads a map file and its data: the image `image` and the line segments `data`."""
    text, _, content = data.partition(SEPARATOR)
    _file("data", content)
    _file("image", content)
    path = _file("map.yaml", text)
    try:
        layer_map = load_map(path, "layer", inputs=Inputs(), simplify=len(data) % 3)
    except FlatlandError:
        return
    assert np.isfinite(layer_map.edges).all()
    assert layer_map.edges.shape[1] == 4


def fuzz_image(data: bytes) -> None:
    """Reads a map image and finds its edges."""
    try:
        image = read_grey_image(_file("image", data))
    except OSError:
        return
    assert image.ndim == 2
    if image.size > 250_000:
        return  # which takes long, and is not different
    edges, count = image_edges(threshold_in_place(image, 0.5), 0.05, len(data) % 3)
    assert np.isfinite(edges).all()
    assert count >= 0


def fuzz_segments(data: bytes) -> None:
    """Reads line segments."""
    try:
        segments = read_line_segments(_file("data", data))
    except MapFileError:
        return
    assert np.isfinite(segments).all()
    assert segments.shape[1] == 4


def fuzz_recording(data: bytes) -> None:
    """Reads a recording, as it is and with the right checksum of each line."""
    lines = data.split(b"\n")
    checked = b"\n".join(b"%08x %s" % (zlib.crc32(line), line) for line in lines[:-1])
    for content in (data, checked + b"\n" + lines[-1]):
        try:
            records = read_recording(_file("run.flog", content)).records
        except RecordingError:
            continue
        for record in records:
            for value in record.values():
                _decode(value)


def fuzz_value(data: bytes) -> None:
    """Decodes a recorded value."""
    try:
        value = json.loads(data)
    except (ValueError, RecursionError):
        return
    _decode(value)


def _decode(value: Any) -> None:
    try:
        decoded = decode_value(value)
    except RecordingError:
        return
    try:
        encoded = encode_value(decoded)
    except TypeError:
        return
    json.dumps(encoded)


TARGETS: Final[dict[str, Callable[[bytes], None]]] = {
    "yaml": fuzz_yaml,
    "preprocessor": fuzz_preprocessor,
    "manifest": fuzz_manifest,
    "package": fuzz_package,
    "map": fuzz_map,
    "image": fuzz_image,
    "segments": fuzz_segments,
    "recording": fuzz_recording,
    "value": fuzz_value,
}
"""The targets by name; the corpus of each is in a folder with this name."""
