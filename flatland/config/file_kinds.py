"""The kinds of the files of a world, recognized by their contents."""

from __future__ import annotations

from pathlib import Path
from typing import Final, Literal

from flatland.config import hints
from flatland.config.documents import load_documents
from flatland.config.files import (
    IMAGE_SUFFIXES,
    LFS_HINT,
    LFS_START,
    foreign_kind,
    open_regular,
)
from flatland.config.foreign_files import foreign_file
from flatland.config.inputs import Inputs
from flatland.config.node import MapNode, Node, NullNode, ScalarNode
from flatland.errors import YamlError

FileKind = Literal["world", "model", "map", "data", "image"]

REQUIRED_KEYS: Final[dict[FileKind, tuple[str, ...]]] = {
    "world": ("properties", "layers"),
    "model": ("bodies",),
    "map": ("image", "resolution", "origin", "occupied_thresh", "data", "scale"),
}
"""Keys at the root of a file that are required there, in the order in which they are read."""
_WORLD_KEYS: Final = {"properties", "layers", "models"}
_MODEL_KEYS: Final = {"bodies", "joints"}
_NAMES: Final[dict[FileKind, str]] = {
    "world": "a world file",
    "model": "a model file",
    "map": "a map file",
    "data": "a data file of line segments",
    "image": "an image",
}
_MAX_MAPS: Final = 100  # files of a folder among which the map file of an image is searched


def kind_of(root: Node) -> FileKind | None:
    """Returns the kind of a file with a given root, None if it cannot be recognized.

    Args:
        root: Root of the file; it need not be preprocessed.
    """
    if isinstance(root, ScalarNode):
        return foreign_kind(root.text.encode("utf-8", "replace"))
    if not isinstance(root, MapNode):
        return None
    keys = root.entries.keys()
    if keys & _MODEL_KEYS and not keys & {"properties", "layers"}:
        return "model"
    if keys & _WORLD_KEYS:
        return "world"
    return "map" if keys & {"image", "occupied_thresh"} or keys >= {"data", "scale"} else None


def kind_of_file(path: str) -> FileKind | None:
    """Returns the kind of a file, None if it cannot be read or recognized."""
    try:
        with open_regular(path) as file:
            foreign = foreign_kind(file.read(4096))
        if foreign is not None:
            return foreign
        documents = load_documents(path, Inputs(logs=False))
    except (OSError, YamlError):
        return None
    return kind_of(documents[0]) if documents else None


def mistaken_file(root: Node, key: str = "") -> str:
    """Returns a hint for a file of another kind than expected, empty if there is no such hint.

    Args:
        root: Root of the file.
        key: The key that is missing there; empty if the file has no keys.
    """
    if isinstance(root, NullNode):
        return "the file is empty"
    if isinstance(root, ScalarNode) and root.text.startswith(LFS_START.decode()):
        return LFS_HINT
    found = kind_of(root)
    if found is None and isinstance(root, ScalarNode):
        return foreign_file(root.text.encode("utf-8", "replace"))
    if found == "data":
        return f'this is {_NAMES[found]}; a map file names it under "data"'
    expected = [kind for kind, keys in REQUIRED_KEYS.items() if key in keys]
    if found is None or not expected or found in expected:
        return ""
    return f"this is {_NAMES[found]}; {_NAMES[expected[0]]} is expected here"


def missing_file(path: str, kind: FileKind) -> str:
    """Returns a hint for a file that does not exist: a similar name of a file of the same kind.

    Args:
        path: The file.
        kind: The expected kind.
    """

    def accepts(file: Path) -> bool:
        if kind == "image":
            return file.suffix.lower() in IMAGE_SUFFIXES
        return hints.is_yaml_name(file) and kind_of_file(str(file)) in (kind, None)

    return hints.similar_file(path, accepts)


def unreadable_file(path: str, kind: FileKind) -> str:
    """Returns a hint for a path that is given in place of a YAML file of a kind.

    Args:
        path: The file, which does not exist, or is an image or a data file.
        kind: The expected kind.
    """
    found = kind_of_file(path)
    if found is None:
        return missing_file(path, kind)
    text = f"this is {_NAMES[found]}; {_NAMES[kind]} is expected here"
    if kind != "map" or found != "image":
        return text
    beside = _map_of_image(Path(path))
    if beside:
        return f'{text}: "{beside}", beside the image'
    keys = "image, resolution, origin and occupied_thresh"
    return f"{text}, a YAML file with the keys {keys}"


def _map_of_image(image: Path) -> str:
    """Returns the name of the map file beside an image, empty without one.

    It names the image, or its name differs in the extension only.
    """
    try:
        files = sorted(image.parent.glob("*.yaml"))[:_MAX_MAPS]
    except OSError:
        return ""
    by_name = ""
    for file in files:
        try:
            documents = load_documents(str(file), Inputs(logs=False))
        except YamlError:
            continue
        root = documents[0] if documents else None
        if not isinstance(root, MapNode) or kind_of(root) != "map":
            continue
        named = root.entries.get("image")
        if isinstance(named, ScalarNode) and Path(named.text).name == image.name:
            return file.name
        if file.stem == image.stem:
            by_name = file.name
    return by_name
