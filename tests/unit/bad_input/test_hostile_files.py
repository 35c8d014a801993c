"""Files that are no files, huge, cyclic or programs: each ends, with at most 500 MB.

They are loaded in one process without privileges, whose address space and processor time per file
are limited. More expressions are in tests/unit/config/test_lua.py.
"""

from __future__ import annotations

import json
import os
import shutil
import struct
import sys
import tempfile
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import hostile_inputs
import pytest
from programs import run_program
from waiting import TIMEOUT

import flatland

MAX_MEBIBYTES = 500
LARGE = 100 * 10**6
NOT_A_FILE = "it is not a regular file"


@dataclass(frozen=True)
class Hostile:
    """One hostile file.

    Attributes:
        role: What the file is: world, model, map, image, data or include.
        create: Creates the file at a path.
        text: Text of the error; {path} is the file, {folder} its folder. Empty for no error.
        error_class: Class of the error.
    """

    role: str
    create: Callable[[Path], object]
    text: str
    error_class: str = "YamlError"


def png(width: int, height: int, rows: int) -> bytes:
    """Returns a grey PNG file with fewer rows than its header says."""

    def chunk(name: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        )

    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    pixels = zlib.compress((b"\0" + b"\xff" * width) * rows)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", pixels)


def holes(path: Path) -> None:
    """Creates a sparse file of 100 MB of null bytes."""
    with path.open("wb") as file:
        file.truncate(LARGE)


def numbers(path: Path) -> None:
    """Creates a file of 100 MB of digits in one line."""
    path.write_bytes(b"1 " * (LARGE // 2))


def unreadable(path: Path) -> None:
    path.write_text("bodies: []\n")
    path.chmod(0)


def content(text: str | bytes) -> Callable[[Path], object]:
    """Returns a function that writes a file."""
    return lambda path: path.write_bytes(text.encode() if isinstance(text, str) else text)


SPECIAL: dict[str, tuple[Callable[[Path], object], str]] = {
    "device": (lambda path: path.symlink_to("/dev/zero"), NOT_A_FILE),
    "terminal": (lambda path: path.symlink_to("/dev/tty"), NOT_A_FILE),
    "pipe": (lambda path: os.mkfifo(path), NOT_A_FILE),
    "folder": (lambda path: path.mkdir(), NOT_A_FILE),
    "broken link": (lambda path: path.symlink_to("nowhere"), "missing"),
    "missing": (lambda path: None, "missing"),
    "link to itself": (lambda path: path.symlink_to(path), "Too many levels of symbolic links"),
    "no permission": (unreadable, "Permission denied"),
    "100 MB": (holes, "it is larger than 64 MiB"),
}
PLACES = {
    "world": "",
    "model": "",
    "map": " [{folder}/world.yaml:3]",
    "image": " [{folder}/map.yaml:1]",
    "data": " [{folder}/map.yaml:2]",
    "include": " [{folder}/outer.model.yaml:2]",
}


def special_files() -> Iterator[tuple[str, Hostile]]:
    """Yields all special files in all roles."""
    for role, place in PLACES.items():
        for name, (create, why) in SPECIAL.items():
            text = f'Flatland YAML: Failed to read file, path="{{path}}", {why}'
            error_class = "UnreadableFileError" if role in ("world", "model") else "YamlError"
            if why == "missing":
                text = 'Flatland YAML: File does not exist, path="{path}"'
            if role == "image":
                text = 'Flatland YAML: Failed to load "{path}" in layer "2d"'
            elif role == "data":
                text, error_class = 'Flatland File: Failed to load "{path}"', "MapFileError"
            elif role == "include" and name in ("missing", "broken link", "link to itself"):
                text = (
                    "Flatland YAML: File specified in $include does not exist, path={path}, "
                    "include={name}"
                )
            yield f"{role}: {name}", Hostile(role, create, text + place, error_class)


BOMB = "a: &a [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{b}: &{b} [{', '.join([f'*{a}'] * 10)}]\n"
    for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)


def slow_expressions(path: Path) -> None:
    loop = "local stop = os.clock() + 0.3 while os.clock() < stop do end return 1"
    path.write_text("".join(f"k{i}: $eval {loop}\n" for i in range(50)))


HOSTILE: dict[str, Hostile] = {
    **dict(special_files()),
    "model: zero bytes": Hostile(
        "model",
        content(""),
        'Flatland YAML: Entry "bodies" does not exist (in model "new") [{path}:1]',
    ),
    "model: alias bomb": Hostile(
        "model",
        content(f"{BOMB}bodies: *i\n"),
        'Flatland YAML: Entry index=0 must be a map (in model "new" "bodies") [{path}:8]',
    ),
    "model: unused alias bomb": Hostile(
        "model",
        content(f"{BOMB}bodies: [{{name: b, footprints: []}}]\n"),
        'Flatland YAML: Entry contains unrecognized entry(s) {{"a", "b", "c", "d", "e", "f", "g", '
        '"h", "i"}} (in model "new") [{path}:1]',
    ),
    "world: alias bomb": Hostile(
        "world",
        content(f"properties: {{}}\nlayers: []\n{BOMB}models: *i\n"),
        'Flatland YAML: Entry index=0 must be a map (in "models") [{path}:10]',
    ),
    "world: alias bomb in properties of a layer": Hostile(
        "world",
        content(
            "properties: {}\nlayers: [{name: 2d, properties: {\n"
            + BOMB.replace("\n", ",\n")
            + "z: *i}}]\nlayer: 1\n"
        ),
        'Flatland YAML: Entry contains unrecognized entry(s) {{"layer"}} [{path}:13]',
    ),
    "model: slow expressions": Hostile(
        "model",
        slow_expressions,
        'Flatland YAML: Failed to evaluate "local stop = os.clock() + 0.3 while os.clock() < stop '
        'do end return 1", all expressions together exceed the time limit of 1 s [{path}:4]',
    ),
    "image: only a header of 60 000 x 60 000": Hostile(
        "image",
        content(png(60_000, 60_000, 1)),
        'Flatland YAML: Failed to load "{path}" in layer "2d" [{folder}/map.yaml:1]',
    ),
    "image: only a header of 2 000 000 000 x 1": Hostile(
        "image",
        content(png(1, 2_000_000_000, 1)),
        'Flatland YAML: Failed to load "{path}" in layer "2d" [{folder}/map.yaml:1]',
    ),
    "data: 100 MB of numbers": Hostile(
        "data",
        numbers,
        'Flatland File: Failed to load "{path}" [{folder}/map.yaml:2]',
        "MapFileError",
    ),
}


def roles(folder: Path, path: Path, role: str) -> tuple[str, Path]:
    """Writes the files around a hostile one; returns the kind of the request and its file."""
    if role == "model":
        return "model", path
    if role == "world":
        return "world", path
    if role == "include":
        outer = folder / "outer.model.yaml"
        outer.write_text(f"joints: []\nbodies: $include {path.name}\n")
        return "model", outer
    map_path = path if role == "map" else folder / "map.yaml"
    rest = "origin: [0, 0, 0]\n"
    if role == "image":
        map_path.write_text(f"image: {path.name}\nresolution: 1\noccupied_thresh: 0.5\n{rest}")
    elif role == "data":
        map_path.write_text(f"type: line_segments\ndata: {path.name}\nscale: 1\n{rest}")
    world = folder / "world.yaml"
    world.write_text(f"properties: {{}}\nlayers:\n  - {{name: 2d, map: {map_path.name}}}\n")
    return "world", world


@pytest.fixture(scope="module")
def results() -> Iterator[dict[str, tuple[Path, dict[str, Any]]]]:
    """Files and results by name; all cases run in one process."""
    # Not the folder of pytest, which other users cannot read.
    root = Path(tempfile.mkdtemp(prefix="flatland-hostile-"))
    try:
        root.chmod(0o755)
        good = root / "good.yaml"
        good.write_text("properties: {}\nlayers: []\nmodels: [{name: m, model: m.model.yaml}]\n")
        # The expression loads the Lua sandbox while the process can still read a checkout in /root.
        (root / "m.model.yaml").write_text("bodies: [{name: $eval \"'b'\", footprints: []}]\n")
        paths, cases = {}, []
        for number, (name, hostile) in enumerate(HOSTILE.items()):
            folder = root / str(number)
            folder.mkdir()
            path = paths[name] = folder / f"hostile.{hostile.role}"
            hostile.create(path)
            kind, file = roles(folder, path, hostile.role)
            cases.append({"name": name, "kind": kind, "path": str(file)})
        package = str(Path(flatland.__file__).resolve().parents[1])
        done = run_program(
            [sys.executable, hostile_inputs.__file__],
            input=json.dumps({"world": str(good), "cases": cases}),
            env={**os.environ, "PYTHONPATH": f"{package}:{os.environ.get('PYTHONPATH', '')}"},
            silence=4 * TIMEOUT,
        )
        assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
        found = [json.loads(line) for line in done.stdout.splitlines()]
        assert len(found) == len(HOSTILE)
        yield {result["name"]: (paths[result["name"]], result) for result in found}
    finally:
        shutil.rmtree(root)


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_file(results: dict[str, tuple[Path, dict[str, Any]]], name: str) -> None:
    hostile, (path, result) = HOSTILE[name], results[name]
    text = hostile.text.format(path=path, folder=path.parent, name=path.name)
    assert result["text"] == text
    assert result["class"] == hostile.error_class
    assert result["memory"] < MAX_MEBIBYTES
    assert result["unchanged"]
