"""Plugins that files name and no manifest declares: finds all of them and explains what to do."""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from flatland.errors import PluginError
from flatland.plugin_api.manifest import (
    INCLUDED_PACKAGE,
    listed_manifests,
    lookup_name,
    read_reference_names,
)
from flatland.plugin_api.package_exports import PYTHON_TAG, Export, package_exports

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.plugin_api.registry import PluginRegistry

PORTING_GUIDE = 'section "From a C++ plugin" of docs/write_a_plugin.md'
# For tests of manifests; they are not what a user misspelled.
_UNLISTED = {f"{INCLUDED_PACKAGE}::Dummy{kind}Plugin" for kind in ("Model", "World")}
_LEAST_SIMILARITY = 0.7  # of a suggestion to the name that is missing
_MOST_SUGGESTIONS = 3


class MissingPluginsError(PluginError):
    """No manifest declares some of the plugins of a model or world."""


@dataclass(frozen=True, slots=True)
class PluginEntry:
    """An enabled entry of a `plugins` list.

    Attributes:
        name: Of the plugin.
        type_name: The `type:`.
        place: File and line of the entry, as ` [robot.model.yaml:12]`.
        model: Name of the model, None for a world plugin.
    """

    name: str
    type_name: str
    place: str
    model: str | None


def read_entries(entries: Iterable[YamlReader], model: str | None) -> list[PluginEntry]:
    """Reads the enabled entries of a `plugins` list.

    Args:
        entries: Of the list.
        model: Name of the model, None for world plugins.

    Raises:
        YamlError: An entry has no name or type.
    """
    return [
        PluginEntry(
            entry.get("name", "string"), entry.get("type", "string"), entry.error("").message, model
        )
        for entry in entries
        if entry.get("enabled", "bool", True)
    ]


def missing_plugins_error(
    registry: PluginRegistry, entries: Sequence[PluginEntry]
) -> MissingPluginsError | None:
    """Makes one error of all entries whose plugin no manifest declares.

    Models that share a file share its lines.

    Args:
        registry: Of the known plugins.
        entries: Of any models and the world.

    Returns:
        None when there is a plugin for each entry.
    """
    missing_types = set(registry.find_missing(entry.type_name for entry in entries))
    if not missing_types:
        return None
    hints = registry.hints()
    advice = hints.advise(missing_types)
    models: dict[tuple[str, str, str], list[str | None]] = {}
    for entry in entries:
        if entry.type_name in missing_types:
            models.setdefault((entry.name, entry.type_name, entry.place), []).append(entry.model)
    lines = []
    for (name, type_name, place), owners in models.items():
        kind = "World" if owners[0] is None else "Model"
        text = f'{kind} Plugin "{name}" type "{type_name}"'
        if owners[0] is not None:
            text += " model " + ", ".join(f'"{owner}"' for owner in owners)
        text += f": {hints.describe(type_name)}"
        if len(models) == 1:
            return MissingPluginsError(f"{text}; {advice}{place}")
        lines.append(text + place)
    return MissingPluginsError("\n".join([*lines, advice]))


class LookupHints:
    """Texts about plugins that no manifest declares."""

    def __init__(self, known: Collection[str], problems: Iterable[PluginError]) -> None:
        """Reads which C++ plugins of the reference are exported.

        Args:
            known: Look-up names of all plugins.
            problems: Why some manifests could not be read.
        """
        self._known = set(known) - _UNLISTED
        self._problems = list(problems)
        self._reference_plugins: dict[str, list[str]] = {}
        listed = [Export("", PYTHON_TAG, path) for path in listed_manifests()]
        for export in [*listed, *package_exports().exports]:
            place = f'manifest "{export.manifest}"'
            if export.package:
                place = f'package "{export.package}" ({export.manifest})'
            try:
                for name in read_reference_names(export.manifest):
                    self._reference_plugins.setdefault(name, []).append(place)
            except PluginError as error:
                if export.tag != PYTHON_TAG:  # the others are among the problems
                    self._problems.append(error)

    def describe(self, type_name: str) -> str:
        """Returns a text about one `type:` of a YAML file.

        It contains the known names that are near, and where a C++ plugin of that name is exported.
        """
        name = lookup_name(type_name)
        text = f'no plugin "{name}"'
        near = [
            f'"{known.removeprefix(f"{INCLUDED_PACKAGE}::")}"'
            for known in self._by_similarity([type_name])[:_MOST_SUGGESTIONS]
            if _similarity(known, type_name) >= _LEAST_SIMILARITY
        ]
        if near:
            text += f" (did you mean {' or '.join(near)}?)"
        places = self._reference_plugins.get(name) or self._reference_plugins.get(type_name)
        if places:
            text += f"; a C++ plugin of that name is exported by {' and '.join(places)}"
        return text

    def advise(self, type_names: Collection[str]) -> str:
        """Returns what a user can do about some missing plugins, with the nearest names first."""
        text = (
            f"C++ plugins cannot be loaded, {PORTING_GUIDE} shows how to write one in Python; "
            '"enabled: false" in the entry of a plugin lets the rest load without it; '
            f"known are: {', '.join(self._by_similarity(type_names))}"
        )
        if self._problems:
            text += "; not read: " + "; ".join(problem.message for problem in self._problems)
        return text

    def _by_similarity(self, type_names: Collection[str]) -> list[str]:
        """Lists the known names, the one most similar to any of some names first."""
        return sorted(
            self._known,
            key=lambda name: (-max(_similarity(name, wanted) for wanted in type_names), name),
        )


def _similarity(name: str, wanted: str) -> float:
    """Compares the names of two classes, without their packages and without regard to case."""
    a, b = (re.split(r"::|[/.]", full)[-1].lower() for full in (name, wanted))
    return difflib.SequenceMatcher(None, a, b).ratio()
