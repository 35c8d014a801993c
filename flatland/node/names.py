"""Conversion of arbitrary names to legal ROS names."""

from __future__ import annotations

import re
from typing import Final

_LEGAL: Final = re.compile(r"[A-Za-z0-9_]+(/[A-Za-z0-9_]+)*")
_ILLEGAL_CHARACTER: Final = re.compile(r"[^A-Za-z0-9_/]")


def legal_name(name: str) -> str:
    """Converts any name to a legal ROS name relative to a namespace.

    Legal names are returned unchanged; in others, each illegal character becomes an underscore.
    """
    # rosgraph also accepts letters outside ASCII, which roscpp rejects.
    if _LEGAL.fullmatch(name):
        return name
    parts = _ILLEGAL_CHARACTER.sub("_", name).split("/")
    return "/".join(filter(None, parts)) or "_"


def sendable_text(text: str) -> str:
    """Replaces characters that cannot be encoded as UTF-8, such as surrogates in a file name."""
    return text.encode("utf-8", "replace").decode()


class UniqueNames:
    """A set of unique names."""

    def __init__(self) -> None:
        """Creates an empty set."""
        self._taken: set[str] = set()

    def claim(self, preferred: str) -> str:
        """Returns an unused name: the preferred one, with a numeric suffix if it is in use."""
        name, number = preferred, 1
        while name in self._taken:
            number += 1
            name = f"{preferred}_{number}"
        self._taken.add(name)
        return name

    def release(self, name: str) -> None:
        """Makes a name returned by `claim` available again."""
        self._taken.discard(name)
