"""Entries that several parts of a scenario file have."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from flatland.config import hints
from flatland.config.file_kinds import missing_file
from flatland.config.reader import YamlReader


def existing_file(reader: YamlReader, key: str, kind: Literal["world", "model"]) -> str:
    """Returns the absolute path of a file that an entry names.

    Args:
        reader: The map.
        key: The entry.
        kind: `world` or `model`.

    Raises:
        YamlError: The entry is missing, or the file does not exist.
    """
    path = reader.resolve_path(reader.get(key, "string"))
    if reader.is_complete and not Path(path).is_file():
        entry = reader.subnode(key)
        hint = missing_file(path, kind)
        reader.report(entry.error(f"The {kind} file does not exist, path={path}", hint))
    return path


def choice(reader: YamlReader, key: str, choices: Sequence[str]) -> str:
    """Returns an entry that is one of some words.

    Raises:
        YamlError: It is missing or another word.
    """
    word = reader.get(key, "string")
    if word not in choices and reader.is_complete:
        entry = reader.subnode(key)
        reader.report(
            entry.error(
                f'"{key}" must be one of {", ".join(choices)}, got "{word}"',
                hints.choice(word, choices),
            )
        )
    return word
