"""Model files that can be spawned, and their contents."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import yaml

from flatland.config.documents import is_yaml_text
from flatland.config.files import open_regular
from flatland.config.inputs import Inputs
from flatland.config.node import ListNode, MapNode, Node, ScalarNode
from flatland.config.preprocessor import preprocess_file
from flatland.errors import WorldError, YamlError
from flatland.scene.model_preview import describe_file
from flatland.web.model_tracker import Json, shape_json
from flatland.world import World

_MAX_FILES: Final = 500
_MAX_DEPTH: Final = 3  # levels of folders below the folder of the world file
_MAX_VISITED: Final = 5000  # files in these folders
_HEAD_SIZE: Final = 64 * 1024  # bytes of a file that are searched for the key `bodies`
_BODIES: Final = re.compile(rb"^bodies[ \t]*:", re.MULTILINE)


def model_files(world: World) -> list[dict[str, str]]:
    """Returns the model files that can be spawned in a world.

    They are the files of its models, and the model files in the folder of the world file and
    below. Reads files, which takes long for large folders.

    Returns:
        Label and absolute path of each file.
    """
    folder = Path(world.resolve_path("."))
    found = {model.path for model in world.models if Path(model.path).is_absolute()}
    found = {os.path.normpath(path) for path in found}
    if world.path:
        found.update(os.path.normpath(path) for path in _files_below(folder))
    allowed = [path for path in sorted(found) if _is_allowed(world, path)]
    return [{"label": _label(path, folder), "path": path} for path in allowed[:_MAX_FILES]]


def _files_below(folder: Path) -> Iterator[Path]:
    visited = 0
    for root, folders, files in os.walk(folder):
        depth = len(Path(root).relative_to(folder).parts)
        folders[:] = (
            sorted(f for f in folders if not f.startswith(".")) if depth < _MAX_DEPTH else []
        )
        for name in sorted(files):
            visited += 1
            if visited > _MAX_VISITED:
                return
            if name.endswith((".yaml", ".yml")) and _is_model(Path(root, name)):
                yield Path(root, name)


def _is_model(path: Path) -> bool:
    try:
        with open_regular(str(path)) as file:
            return _BODIES.search(file.read(_HEAD_SIZE)) is not None
    except OSError:
        return False


def _is_allowed(world: World, path: str) -> bool:
    if world.model_path is None:
        return True
    real = Path(os.path.realpath(path))
    return any(real.is_relative_to(folder) for folder in world.model_path)


def _label(path: str, folder: Path) -> str:
    try:
        return str(Path(path).relative_to(folder))
    except ValueError:
        return path


def check_file(path: str) -> str:
    """Returns a path of a model file that a client has sent.

    Raises:
        WorldError: The path is YAML text.
    """
    if is_yaml_text(path):
        raise WorldError("the path of a model file is expected, not YAML text")
    return path


def preview(world: World, path: str) -> Json:
    """Describes the bodies of a model file as in the reply to `preview`; reads files.

    Args:
        world: World in which the model may be spawned.
        path: Path of the file, absolute or relative to the folder of the world file.

    Raises:
        FlatlandError: The file cannot be read, or a body in it is invalid.
    """
    inputs = Inputs(world.params, folders=world.model_path)
    file = world.resolve_path(check_file(path))
    bodies = describe_file(file, inputs, name=Path(path).name)
    return {
        "bodies": [
            {
                "color": list(body.color),
                "pose": list(body.pose),
                "shapes": [shape_json(shape, []) for shape in body.shapes],
            }
            for body in bodies
        ]
    }


def plugin_parameters(world: World, path: str) -> dict[str, Any]:
    """Returns the parameters of the plugins in a model file by the name of the plugin.

    Args:
        world: World that contains the model.
        path: Path of the file.

    Returns:
        An empty dictionary for a model without a file, or whose file cannot be read any more.
    """
    if not Path(path).is_absolute():
        return {}
    try:
        root = preprocess_file(path, Inputs(world.params, folders=world.model_path))
    except (YamlError, OSError):
        return {}
    plugins = root.entries.get("plugins") if isinstance(root, MapNode) else None
    found = {}
    for entry in plugins.items if isinstance(plugins, ListNode) else []:
        values = _plain(entry)
        if isinstance(values, dict):
            name = str(values.get("name", ""))
            found[name] = {k: v for k, v in values.items() if k not in ("name", "type")}
    return found


def _plain(node: Node) -> Any:
    """Converts a YAML tree to Python objects."""
    if isinstance(node, MapNode):
        return {key: _plain(value) for key, value in node.entries.items()}
    if isinstance(node, ListNode):
        return [_plain(item) for item in node.items]
    return _scalar(node.text) if isinstance(node, ScalarNode) else None


def _scalar(text: str) -> Any:
    try:
        value = yaml.safe_load(text)
    except yaml.YAMLError:
        return text
    return value if isinstance(value, bool | int | float) else text
