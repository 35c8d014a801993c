"""Nodes of a YAML tree with their positions in the source text."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

from flatland.errors import Place

MAX_NESTING = 100
"""Largest number of nested lists and maps, including levels that aliases and includes add."""


@dataclass(frozen=True, slots=True)
class Source:
    """The origin of a text.

    Attributes:
        path: File as given by the user, empty for a text that was not read from a file.
        folder: Absolute folder that relative paths in the text start from.
    """

    path: str
    folder: str

    @classmethod
    def of_file(cls, path: str) -> Source:
        """Returns the source for a file."""
        return cls(path, str(Path.cwd() / Path(path).parent))

    def resolve(self, path: str) -> str:
        """Returns an absolute path: `~` is the home folder, a relative path starts in `folder`.

        Parts `..` are removed, unless a symbolic link before them leads elsewhere.
        """
        try:
            full = self.folder / Path(path).expanduser()
        except RuntimeError:  # `~name` of an unknown user
            full = self.folder / Path(path)
        if ".." in full.parts:
            plain = os.path.normpath(full)
            if os.path.realpath(plain) == os.path.realpath(full):
                return plain
        return str(full)

    def place(self, line: int | None, column: int | None = None) -> Place:
        """Returns a position in the text.

        Args:
            line: Line number, from 1; None for the whole text.
            column: Column number, from 1; None if unknown.
        """
        return Place(self.path, line, column)


@dataclass(slots=True, eq=False)
class NullNode:
    """A missing value: an empty one, or a plain `~` or `null`."""

    source: Source
    line: int


@dataclass(slots=True, eq=False)
class ScalarNode:
    """A single value, kept as text."""

    source: Source
    line: int
    text: str


@dataclass(slots=True, eq=False)
class ListNode:
    """A sequence; the preprocessor may replace its items."""

    source: Source
    line: int
    items: list[Node] = field(default_factory=list)


@dataclass(slots=True, eq=False)
class MapNode:
    """A mapping, in the order of the file; the preprocessor may replace its values."""

    source: Source
    line: int
    entries: dict[str, Node] = field(default_factory=dict)
    key_lines: dict[str, int] = field(default_factory=dict)


Node = NullNode | ScalarNode | ListNode | MapNode
