"""Reader of XML plugin manifests, in the format of pluginlib."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from flatland.errors import PluginError

INCLUDED_PACKAGE = "flatland_plugins"
MANIFEST_VARIABLE = "FLATLAND_PLUGIN_PATH"
BASE_CLASS_TYPES = ("flatland::ModelPlugin", "flatland::WorldPlugin")
PORTING_GUIDE = 'section "From a C++ plugin" of docs/write_a_plugin.md'
_REFERENCE_PREFIX = "flatland_server::"  # namespace of the base classes of C++ plugins


@dataclass(frozen=True, slots=True)
class PluginClass:
    """A `<class>` element of a manifest.

    Attributes:
        lookup_name: Name used in YAML files, such as `my_robots::Belt`.
        class_path: Dotted path of the Python class.
        base_class_type: `flatland::ModelPlugin` or `flatland::WorldPlugin`.
        manifest: Path of the manifest.
        import_path: Folder to insert into `sys.path` before the import, None if not required.
        description: Description for users.
    """

    lookup_name: str
    class_path: str
    base_class_type: str
    manifest: str
    import_path: str | None
    description: str = ""


def lookup_name(type_name: str) -> str:
    """Returns the look-up name in manifests for a `type:` of a YAML file."""
    return type_name if "::" in type_name else f"{INCLUDED_PACKAGE}::{type_name}"


def listed_manifests() -> list[str]:
    """Returns the manifests listed in the environment variable `FLATLAND_PLUGIN_PATH`."""
    return [path for path in os.environ.get(MANIFEST_VARIABLE, "").split(":") if path]


def read_manifest(path: str | os.PathLike[str]) -> list[PluginClass]:
    """Reads the Python classes of a manifest, without the C++ plugins of the reference.

    Raises:
        PluginError: The manifest cannot be read or is not XML, or the type or base class of a
            class is missing or invalid.
    """
    path = os.fspath(path)
    found = []
    for folder, element in _class_elements(path):
        import_path = None if folder is None else str(Path(path).resolve().parent / folder)
        class_path = element.get("type", "")
        lookup_name = element.get("name") or class_path
        base = element.get("base_class_type", "")
        if base.startswith(_REFERENCE_PREFIX):
            continue
        if "::" in class_path:
            raise PluginError(
                f'manifest "{path}", class "{lookup_name}": "{class_path}" is a C++ plugin, which '
                f"cannot be loaded; {PORTING_GUIDE} explains how to port it to Python"
            )
        if "." not in class_path:
            raise PluginError(
                f'manifest "{path}", class "{lookup_name}": type must be the dotted path of '
                f'a Python class, got "{class_path}"'
            )
        if base not in BASE_CLASS_TYPES:
            raise PluginError(
                f'manifest "{path}", class "{lookup_name}": base_class_type must be '
                f'{" or ".join(BASE_CLASS_TYPES)}, got "{base}"'
            )
        text = " ".join((element.findtext("description") or "").split())
        found.append(PluginClass(lookup_name, class_path, base, path, import_path, text))
    return found


def read_reference_names(path: str | os.PathLike[str]) -> list[str]:
    """Reads the look-up names of the C++ plugins of the reference in a manifest.

    Raises:
        PluginError: The manifest cannot be read or is not XML.
    """
    return [
        element.get("name") or element.get("type") or ""
        for _, element in _class_elements(os.fspath(path))
        if element.get("base_class_type", "").startswith(_REFERENCE_PREFIX)
    ]


def _class_elements(path: str) -> Iterator[tuple[str | None, ElementTree.Element]]:
    """Iterates over the `<class>` elements of a manifest with the `path` of their library.

    Raises:
        PluginError: The manifest cannot be read, is not XML, or has an unknown root element.
    """
    if not Path(path).is_dir() and Path(path).exists() and not Path(path).is_file():
        # Opening a pipe can block.
        raise PluginError(f'manifest "{path}" cannot be read: it is not a regular file')
    try:
        # Manifests are trusted input: the code that they name is executed anyway.
        root = ElementTree.parse(path).getroot()  # noqa: S314
    except ElementTree.ParseError as error:
        line, column = error.position
        reason = str(error).split(":")[0]
        raise PluginError(
            f'manifest "{path}" is not XML, line {line} col {column}, {reason}'
        ) from error
    except OSError as error:
        raise PluginError(f'manifest "{path}" cannot be read: {error.strerror}') from error
    except (LookupError, ValueError) as error:  # an encoding that Python or expat does not support
        raise PluginError(f'manifest "{path}" cannot be read: {error}') from error
    if root.tag == "library":
        libraries = [root]
    elif root.tag == "class_libraries":
        libraries = root.findall("library")
    else:
        raise PluginError(
            f'manifest "{path}" must contain <library> or <class_libraries>, got <{root.tag}>'
        )
    for library in libraries:
        for element in library.findall("class"):
            yield library.get("path"), element
