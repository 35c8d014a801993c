"""Finds plugin classes by the names that XML manifests give them.

A manifest is a file as pluginlib has them, with the dotted path of a Python class as its type.
Reading manifests imports no plugin; a class is imported when a world first asks for it.
"""

from __future__ import annotations

import difflib
import importlib
import importlib.metadata
import importlib.resources
import logging
import os
import sys
import threading
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path

from flatland.errors import PLUGIN_FAULTS, PluginError
from flatland.plugin_api.plugin import FlatlandPlugin, ModelPlugin, WorldPlugin

_LOG = logging.getLogger("flatland")

INCLUDED_PACKAGE = "flatland_plugins"
ENTRY_POINT_GROUP = "flatland.plugins"
MANIFEST_VARIABLE = "FLATLAND_PLUGIN_PATH"
_BASE_CLASSES: dict[str, type[FlatlandPlugin]] = {
    "flatland::ModelPlugin": ModelPlugin,
    "flatland::WorldPlugin": WorldPlugin,
}
# Many worlds may load in threads of one process, and sys.path is shared by all of them.
_IMPORT_LOCK = threading.RLock()


@dataclass(frozen=True, slots=True)
class PluginClass:
    """One `<class>` of a manifest.

    Attributes:
        lookup_name: The name that YAML files use, such as `my_robots::Belt`.
        class_path: Dotted path of the Python class.
        base_class_type: `flatland::ModelPlugin` or `flatland::WorldPlugin`.
        manifest: File that it stands in.
        import_path: Folder to put on `sys.path` first, None when there is none.
        description: For people.
    """

    lookup_name: str
    class_path: str
    base_class_type: str
    manifest: str
    import_path: str | None
    description: str = ""


def read_manifest(path: str | os.PathLike[str]) -> list[PluginClass]:
    """Reads the classes of one manifest.

    Raises:
        PluginError: It cannot be read, is not XML, or a class lacks its type or base class.
    """
    path = os.fspath(path)
    try:
        # A manifest names code that runs: who may write one needs no XML trick to do harm.
        root = ElementTree.parse(path).getroot()  # noqa: S314
    except ElementTree.ParseError as error:
        line, column = error.position
        reason = str(error).split(":")[0]
        raise PluginError(
            f'manifest "{path}" is not XML, line {line} col {column}, {reason}'
        ) from error
    except OSError as error:
        raise PluginError(f'manifest "{path}" cannot be read: {error.strerror}') from error
    if root.tag == "library":
        libraries = [root]
    elif root.tag == "class_libraries":
        libraries = root.findall("library")
    else:
        raise PluginError(
            f'manifest "{path}" must hold <library> or <class_libraries>, got <{root.tag}>'
        )
    found = []
    for library in libraries:
        folder = library.get("path")
        import_path = None if folder is None else str(Path(path).resolve().parent / folder)
        for element in library.findall("class"):
            class_path = element.get("type", "")
            lookup_name = element.get("name") or class_path
            base = element.get("base_class_type", "")
            if "." not in class_path:
                raise PluginError(
                    f'manifest "{path}", class "{lookup_name}": type must be the dotted path of '
                    f'a Python class, got "{class_path}"'
                )
            if base not in _BASE_CLASSES:
                raise PluginError(
                    f'manifest "{path}", class "{lookup_name}": base_class_type must be '
                    f'flatland::ModelPlugin or flatland::WorldPlugin, got "{base}"'
                )
            text = " ".join((element.findtext("description") or "").split())
            found.append(PluginClass(lookup_name, class_path, base, path, import_path, text))
    return found


def included_manifest() -> Path:
    """Returns the manifest of the plugins that flatland itself brings."""
    return Path(str(importlib.resources.files("flatland.plugins") / "flatland_plugins.xml"))


def _package_path_manifests(problems: list[PluginError]) -> list[str]:
    """Lists the manifests that packages on `ROS_PACKAGE_PATH` export; rospkg is no ROS client."""
    if not os.environ.get("ROS_PACKAGE_PATH"):
        return []
    try:
        import rospkg
    except ImportError:
        return []
    manifests: list[str] = []
    packages = rospkg.RosPack()
    for package in packages.list():
        if package == "flatland":
            continue
        try:
            exports = packages.get_manifest(package).get_export("flatland", "plugin")
            folder = packages.get_path(package)
        except Exception as error:
            # Several libraries read package.xml, each with errors of its own; a package that is
            # broken is no reason to miss the others.
            reason = " ".join(str(error).split())
            problems.append(PluginError(f'package "{package}" cannot be read: {reason}'))
            continue
        manifests += [export.replace("${prefix}", folder) for export in exports]
    return manifests


def _entry_point_manifests() -> list[str]:
    """Lists the manifests that Python distributions export.

    The value of an entry point is `package` or `package:file.xml`; the file stands in the
    package, and is called `flatland_plugins.xml` when it is not named.
    """
    manifests = []
    for entry_point in importlib.metadata.entry_points(group=ENTRY_POINT_GROUP):
        package, _, name = entry_point.value.partition(":")
        try:
            resource = importlib.resources.files(package.strip())
        except ImportError as error:
            _LOG.warning("plugins of entry point %r are left out: %s", entry_point.name, error)
            continue
        manifests.append(str(resource / (name.strip() or "flatland_plugins.xml")))
    return manifests


class PluginRegistry:
    """The plugin classes that manifests name; read at the first look-up."""

    def __init__(self) -> None:
        """Reads nothing yet."""
        self._classes: dict[str, PluginClass] = {}
        self._problems: list[PluginError] = []
        self._read_included = False
        self._read_others = False

    @property
    def classes(self) -> dict[str, PluginClass]:
        """All known classes by look-up name."""
        self._read_all()
        return dict(self._classes)

    def add_manifest(self, path: str | os.PathLike[str]) -> None:
        """Adds the classes of a manifest; a name that is known already keeps its first class.

        Raises:
            PluginError: The manifest is broken.
        """
        for entry in read_manifest(path):
            known = self._classes.setdefault(entry.lookup_name, entry)
            if known is not entry and not Path(known.manifest).samefile(entry.manifest):
                _LOG.warning(
                    'plugin "%s" of "%s" is hidden by that of "%s"',
                    entry.lookup_name,
                    entry.manifest,
                    known.manifest,
                )

    def find(self, type_name: str) -> PluginClass:
        """Returns what the manifests say about a `type:` of a YAML file.

        Raises:
            PluginError: No manifest names it; lists the known names, the nearest first, and the
                manifests that could not be read.
        """
        lookup_name = type_name if "::" in type_name else f"{INCLUDED_PACKAGE}::{type_name}"
        if not self._read_included:
            self._read_included = True
            self.add_manifest(included_manifest())
        # The included plugins are found without searching the package path, which takes long.
        if lookup_name not in self._classes:
            self._read_all()
        if lookup_name in self._classes:
            return self._classes[lookup_name]
        if type_name in self._classes:
            return self._classes[type_name]
        near = difflib.get_close_matches(lookup_name, self._classes, n=len(self._classes), cutoff=0)
        text = f'no plugin "{lookup_name}", known are: {", ".join(near)}'
        if self._problems:
            text += "; not read: " + "; ".join(problem.message for problem in self._problems)
        raise PluginError(text)

    def make(self, type_name: str, base: type[FlatlandPlugin]) -> FlatlandPlugin:
        """Makes an instance of a plugin class, importing it if that has not been done.

        Args:
            type_name: The `type:` of a YAML file.
            base: `ModelPlugin` or `WorldPlugin`: what it must be.

        Raises:
            PluginError: Unknown name, module or class missing, or the wrong base class.
        """
        entry = self.find(type_name)
        plugin_class = _load_class(entry)
        if not issubclass(plugin_class, base) or _BASE_CLASSES[entry.base_class_type] is not base:
            raise PluginError(
                f'class "{entry.class_path}" of plugin "{entry.lookup_name}" must be a '
                f"{base.base_class_type} here, it is a {_base_name(entry, plugin_class)}"
            )
        try:
            return plugin_class()
        except PLUGIN_FAULTS as error:
            raise PluginError(
                f'class "{entry.class_path}" cannot be made: {type(error).__name__}: {error}'
            ) from error

    def _read_all(self) -> None:
        if self._read_others:
            return
        self._read_others = True
        if not self._read_included:
            self._read_included = True
            self.add_manifest(included_manifest())
        listed = [path for path in os.environ.get(MANIFEST_VARIABLE, "").split(":") if path]
        exported = _package_path_manifests(self._problems)
        for path in [*listed, *exported, *_entry_point_manifests()]:
            try:
                self.add_manifest(path)
            except PluginError as error:
                # One broken package must not take all others away.
                _LOG.error("%s", error)
                self._problems.append(error)


def _load_class(entry: PluginClass) -> type[FlatlandPlugin]:
    module_name, _, class_name = entry.class_path.rpartition(".")
    with _IMPORT_LOCK:
        if entry.import_path is not None and entry.import_path not in sys.path:
            sys.path.insert(0, entry.import_path)
            importlib.invalidate_caches()
        try:
            module = importlib.import_module(module_name)
        except PLUGIN_FAULTS as error:
            raise PluginError(
                f'module "{module_name}" of plugin "{entry.lookup_name}" (manifest '
                f'"{entry.manifest}") cannot be imported: {type(error).__name__}: {error}'
            ) from error
    plugin_class = getattr(module, class_name, None)
    if plugin_class is None:
        raise PluginError(
            f'module "{module_name}" ({module.__file__}) has no class "{class_name}", which plugin '
            f'"{entry.lookup_name}" (manifest "{entry.manifest}") names'
        )
    if not (isinstance(plugin_class, type) and issubclass(plugin_class, FlatlandPlugin)):
        raise PluginError(
            f'"{entry.class_path}" of plugin "{entry.lookup_name}" must be a class derived from '
            f"{entry.base_class_type}, got {plugin_class!r}"
        )
    return plugin_class


def _base_name(entry: PluginClass, plugin_class: type[FlatlandPlugin]) -> str:
    actual = plugin_class.base_class_type or "flatland::FlatlandPlugin"
    if actual == entry.base_class_type:
        return actual
    return f'{actual} (manifest "{entry.manifest}" calls it {entry.base_class_type})'
