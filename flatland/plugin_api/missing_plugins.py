"""Errors about plugins that are named in files but declared by no manifest."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from flatland.errors import FlatlandError, Place, PluginError
from flatland.plugin_api.fork_plugins import alternative_to
from flatland.plugin_api.manifest import (
    INCLUDED_PACKAGE,
    PORTING_GUIDE,
    listed_manifests,
    lookup_name,
    read_reference_names,
)
from flatland.plugin_api.package_exports import PYTHON_TAG, Export, package_exports

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader

# Plugins for tests of manifests, which are no useful suggestions.
_UNLISTED = {f"{INCLUDED_PACKAGE}::Dummy{kind}Plugin" for kind in ("Model", "World")}
_HINT = f'"enabled: false" skips the plugin; C++ plugins must be ported to Python, {PORTING_GUIDE}'
_MIN_SIMILARITY = 0.7  # of a suggestion to the missing name
_MAX_SUGGESTIONS = 3


class MissingPluginsError(PluginError):
    """Raised if some plugins of a model or world are declared by no manifest."""

    def __init__(self, message: str, missing: Sequence[PluginError]) -> None:
        """Initializes the error.

        Args:
            message: Text about all missing plugins.
            missing: An error for each of them, at least one.
        """
        super().__init__(message, place=missing[0].place)
        self._missing = missing

    def parts(self) -> Sequence[FlatlandError]:
        """Returns an error for each missing plugin."""
        return self._missing


@dataclass(frozen=True, slots=True)
class PluginEntry:
    """An enabled entry of a `plugins` list.

    Attributes:
        name: Name of the plugin.
        type_name: Value of `type:`.
        place: File and line of the entry.
        model: Name of the model, None for a world plugin.
        keys: Keys of the entry.
    """

    name: str
    type_name: str
    place: Place
    model: str | None
    keys: tuple[str, ...] = ()


def read_entries(entries: Iterable[YamlReader], model: str | None) -> list[PluginEntry]:
    """Reads the enabled entries of a `plugins` list.

    Args:
        entries: Entries of the list.
        model: Name of the model, None for world plugins.

    Raises:
        YamlError: An entry has no name or type.
    """
    return [
        PluginEntry(
            entry.get("name", "string"),
            entry.get("type", "string"),
            entry.place,
            model,
            tuple(entry.keys()),
        )
        for entry in entries
        if entry.get("enabled", "bool", True)
    ]


class LookupHints:
    """Error texts about plugins that are declared by no manifest."""

    def __init__(self, known: Collection[str], problems: Iterable[PluginError]) -> None:
        """Reads the names of the exported C++ plugins of the reference.

        Args:
            known: Look-up names of all plugins.
            problems: Errors of the manifests that could not be read.
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
                if export.tag != PYTHON_TAG:  # errors of the others are in `problems`
                    self._problems.append(error)

    def describe(self, type_name: str, keys: Iterable[str] = ()) -> str:
        """Returns a text about one `type:` of a YAML file, of an entry with some keys.

        The text contains similar known names, the packages that export a C++ plugin of that name,
        and what to use instead of a plugin of a known fork of the reference.
        """
        name = lookup_name(type_name)
        text = f'no plugin "{name}"'
        similar = [
            f'"{_short(known)}"'
            for known in self._by_similarity([type_name])[:_MAX_SUGGESTIONS]
            if _similarity(known, type_name) >= _MIN_SIMILARITY
        ]
        if similar:
            text += f" (did you mean {' or '.join(similar)}?)"
        places = self._reference_plugins.get(name) or self._reference_plugins.get(type_name)
        if places:
            text += f"; a C++ plugin of that name is exported by {' and '.join(places)}"
        alternative = alternative_to(type_name, keys)
        if alternative:
            text += f"; forks of the reference have a plugin of that name: {alternative}"
        return text

    def advise(self, type_names: Collection[str]) -> str:
        """Returns instructions about missing plugins, with the known names by similarity."""
        text = (
            f"C++ plugins cannot be loaded, {PORTING_GUIDE} explains how to port them to Python; "
            '"enabled: false" in the entry of a plugin skips it; '
            f"known plugins: {', '.join(map(_short, self._by_similarity(type_names)))}"
        )
        if self._problems:
            errors = "; ".join(problem.message for problem in self._problems)
            text += f"; manifests with errors: {errors}"
        return text

    def error(self, entries: Iterable[PluginEntry]) -> MissingPluginsError:
        """Returns one error about several entries whose plugins are missing.

        The lines of a model file occur once, with the names of all models that are loaded from it.

        Args:
            entries: Entries of any models and of the world, at least one.
        """
        models: dict[tuple[str, str, Place, tuple[str, ...]], list[str | None]] = {}
        for entry in entries:
            key = (entry.name, entry.type_name, entry.place, entry.keys)
            models.setdefault(key, []).append(entry.model)
        missing = []
        for (name, type_name, place, keys), owners in models.items():
            kind = "World" if owners[0] is None else "Model"
            text = f'{kind} Plugin "{name}" type "{type_name}"'
            if owners[0] is not None:
                text += " model " + ", ".join(f'"{owner}"' for owner in owners)
            text += f": {self.describe(type_name, keys)}"
            missing.append(PluginError(text + place.suffix, place=place, hint=_HINT))
        advice = self.advise({type_name for _, type_name, *_ in models})
        if len(missing) == 1:
            return MissingPluginsError(f"{text}; {advice}{place.suffix}", missing)
        texts = [*(error.message for error in missing), advice]
        return MissingPluginsError("\n".join(texts), missing)

    def _by_similarity(self, type_names: Collection[str]) -> list[str]:
        """Returns the known names, the most similar to any of the given names first."""
        return sorted(
            self._known,
            key=lambda name: (-max(_similarity(name, other) for other in type_names), name),
        )


def _short(name: str) -> str:
    """Returns a look-up name as it is usually written in files: included plugins have no prefix."""
    return name.removeprefix(f"{INCLUDED_PACKAGE}::")


def _similarity(name: str, other: str) -> float:
    """Returns the similarity of two class names, ignoring packages and case, in [0, 1]."""
    import difflib  # late, since only mistakes need it

    a, b = (re.split(r"::|[/.]", full)[-1].lower() for full in (name, other))
    return difflib.SequenceMatcher(None, a, b).ratio()
