"""Finds plugin classes by their names in XML manifests.

Reading manifests imports no plugin; a class is imported when it is first instantiated.
"""

from __future__ import annotations

import importlib
import importlib.resources
import logging
import os
import sys
import threading
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from flatland.errors import PLUGIN_FAULTS, PluginError
from flatland.plugin_api.manifest import PluginClass, listed_manifests, lookup_name, read_manifest
from flatland.plugin_api.missing_plugins import LookupHints, MissingPluginsError, PluginEntry
from flatland.plugin_api.package_exports import (
    PYTHON_TAG,
    are_settled,
    modification_time,
    package_exports,
)
from flatland.plugin_api.plugin import FlatlandPlugin, ModelPlugin, WorldPlugin

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

_LOG = logging.getLogger("flatland")

ENTRY_POINT_GROUP = "flatland.plugins"
_BASE_CLASSES: dict[str, type[FlatlandPlugin]] = {
    "flatland::ModelPlugin": ModelPlugin,
    "flatland::WorldPlugin": WorldPlugin,
}
_Times = dict[str, int | None]
_last_entry_points: tuple[_Times | None, Sequence[EntryPoint]] = (None, ())
# Worlds may load concurrently in several threads, and sys.path is shared by the process.
_IMPORT_LOCK = threading.RLock()


def included_manifest() -> Path:
    """Returns the manifest of the included plugins."""
    return Path(str(importlib.resources.files("flatland.plugins") / "flatland_plugins.xml"))


def _entry_point_manifests() -> tuple[list[str], list[PluginError]]:
    """Returns the manifests exported by Python distributions, and the errors of invalid exports.

    The value of an entry point is `package` or `package:file.xml`. The file is in the folder of
    the package; its default name is `flatland_plugins.xml`.
    """
    manifests, problems = [], []
    for entry_point in _entry_points():
        package, _, name = entry_point.value.partition(":")
        try:
            resource = importlib.resources.files(package.strip())
        except ImportError as error:
            problems.append(PluginError(f'entry point "{entry_point.name}": {error}'))
            continue
        manifests.append(str(resource / (name.strip() or "flatland_plugins.xml")))
    return manifests, problems


def _entry_points() -> Sequence[EntryPoint]:
    """Returns the entry points of the group, cached until a folder of `sys.path` changes."""
    # Late, since most worlds need only included plugins.
    from importlib.metadata import entry_points

    global _last_entry_points
    start = time.time_ns()
    times = {folder: modification_time(folder or ".") for folder in sys.path}
    if times != _last_entry_points[0]:
        found = tuple(entry_points(group=ENTRY_POINT_GROUP))
        _last_entry_points = (times if are_settled(times, start) else None, found)
    return _last_entry_points[1]


class PluginRegistry:
    """The plugin classes declared by manifests.

    The included manifest is read at the first look-up, and the other manifests when a name is not
    in the included one. All are read again when a name is not found and a manifest or package has
    changed since.
    """

    def __init__(self) -> None:
        """Creates a registry without reading any manifest."""
        self._classes: dict[str, PluginClass] = {}
        self._problems: list[PluginError] = []
        self._others_read: object = None

    @property
    def classes(self) -> dict[str, PluginClass]:
        """All known classes by look-up name."""
        self._read_others()
        return dict(self._classes)

    def find(self, type_name: str) -> PluginClass:
        """Returns the entry of a `type:` of a YAML file.

        Raises:
            PluginError: The plugin is declared by no manifest.
        """
        if self.find_missing([type_name]):
            hints = self._hints()
            raise PluginError(f"{hints.describe(type_name)}; {hints.advise([type_name])}")
        return self._classes.get(lookup_name(type_name)) or self._classes[type_name]

    def find_missing(self, type_names: Iterable[str]) -> list[str]:
        """Returns the given `type:` values that are declared by no manifest."""
        if not self._classes:
            self._add_manifest(included_manifest())
        missing = [name for name in type_names if not self._is_known(name)]
        if missing:
            self._read_others()
        return [name for name in missing if not self._is_known(name)]

    def missing_plugins_error(self, entries: Sequence[PluginEntry]) -> MissingPluginsError | None:
        """Returns one error about all entries whose plugin is declared by no manifest.

        Args:
            entries: Entries of any models and of the world.

        Returns:
            The error, or None if a plugin exists for each entry.
        """
        missing = set(self.find_missing(entry.type_name for entry in entries))
        if not missing:
            return None
        return self._hints().error(entry for entry in entries if entry.type_name in missing)

    def _hints(self) -> LookupHints:
        return LookupHints(self._classes, self._problems)

    def create(self, type_name: str, base: type[FlatlandPlugin]) -> FlatlandPlugin:
        """Creates an instance of a plugin class, which is imported if necessary.

        Args:
            type_name: The `type:` of a YAML file.
            base: The required base class, `ModelPlugin` or `WorldPlugin`.

        Raises:
            PluginError: The name is unknown, the module or class is missing, the base class is
                wrong, or the constructor raises.
        """
        entry = self.find(type_name)
        plugin_class = _load_class(entry)
        if not issubclass(plugin_class, base) or _BASE_CLASSES[entry.base_class_type] is not base:
            raise PluginError(
                f'class "{entry.class_path}" of plugin "{entry.lookup_name}" must be a '
                f"{base.base_class_type}, got a {_base_name(entry, plugin_class)}"
            )
        try:
            return plugin_class()
        except PLUGIN_FAULTS as error:
            raise PluginError(
                f'class "{entry.class_path}" cannot be instantiated: '
                f"{type(error).__name__}: {error}"
            ) from error

    def _is_known(self, type_name: str) -> bool:
        return lookup_name(type_name) in self._classes or type_name in self._classes

    def _read_others(self) -> None:
        """Reads all manifests if any has changed since the last call."""
        packages = package_exports()
        entry_points, problems = _entry_point_manifests()
        exported = [export.manifest for export in packages.exports if export.tag == PYTHON_TAG]
        paths = [*listed_manifests(), *exported, *entry_points]
        found = ([(path, modification_time(path)) for path in paths], packages)
        if found == self._others_read:
            return
        self._others_read = found
        self._classes.clear()
        self._add_manifest(included_manifest())
        self._problems = [*packages.problems, *problems]
        for path in paths:
            try:
                self._add_manifest(path)
            except PluginError as error:
                # One invalid manifest must not make all others unavailable.
                _LOG.error("%s", error)
                self._problems.append(error)

    def _add_manifest(self, path: str | os.PathLike[str]) -> None:
        """Adds the classes of a manifest; the first class of a name takes precedence.

        Raises:
            PluginError: The manifest is invalid.
        """
        for entry in read_manifest(path):
            known = self._classes.setdefault(entry.lookup_name, entry)
            if known is not entry and not Path(known.manifest).samefile(entry.manifest):
                _LOG.warning(
                    'plugin "%s" of "%s" is hidden by the one of "%s"',
                    entry.lookup_name,
                    entry.manifest,
                    known.manifest,
                )


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
            f'module "{module_name}" ({module.__file__}) has no class "{class_name}", required by '
            f'plugin "{entry.lookup_name}" (manifest "{entry.manifest}")'
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
    return f'{actual} (manifest "{entry.manifest}" declares a {entry.base_class_type})'
