"""Loads YAML files to trees of nodes that know where they stand.

Scalars stay text; what type they have is decided when a parameter is read. Anchors and aliases
share one node. A merge key (`<<`) is a key like any other, as in yaml-cpp, so that no map has
entries that are not written in it.
"""

from __future__ import annotations

import logging
import re
from bisect import bisect_left
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn

import yaml

from flatland.errors import UnreadableFileError, YamlError
from flatland.regular_file import open_regular

_LOG = logging.getLogger("flatland")
MAX_NESTING = 100
_MAX_FILE_BYTES = 64 * 1024 * 1024

_Loader: type = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
_NULLS = frozenset(("", "~", "null", "Null", "NULL"))
_NULL_TAG = "tag:yaml.org,2002:null"
_NOT_YAML_TEXT = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_REPLACEMENT = "\ufffd"
_UNDECODABLE = range(0xDC80, 0xDD00)  # the surrogates for the bytes 0x80 to 0xff
# White space before a comment or the end of a line, preceded by list and map indicators only.
_BLANK = re.compile(r"^(?:[ \t]*+[-?:](?=[ \t]))*+[ \t]++(?=#|\r?$)", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Source:
    """Where a text comes from.

    Attributes:
        path: File as the user named it, empty for a text that is in no file.
        folder: Absolute folder that relative paths in the text start from.
    """

    path: str
    folder: str

    @classmethod
    def of_file(cls, path: str) -> Source:
        """Returns the source for a file."""
        return cls(path, str(Path.cwd() / Path(path).parent))

    def resolve(self, path: str) -> str:
        """Makes a path absolute: `~` is the home folder, a relative one starts in `folder`."""
        try:
            return str(self.folder / Path(path).expanduser())
        except RuntimeError:  # `~name` of nobody
            return str(self.folder / Path(path))

    def place(self, line: int | None) -> str:
        """Returns what error texts end with, such as ` [model.yaml:12]`."""
        if line is None:
            return f" [{self.path}]" if self.path else ""
        return f" [{self.path}:{line}]" if self.path else f" [line {line}]"


@dataclass(slots=True, eq=False)
class NullNode:
    """No value: nothing, or a plain `~` or `null`."""

    source: Source
    line: int


@dataclass(slots=True, eq=False)
class ScalarNode:
    """A text."""

    source: Source
    line: int
    text: str


@dataclass(slots=True, eq=False)
class ListNode:
    """A sequence; its items may be replaced by the preprocessor."""

    source: Source
    line: int
    items: list[Node] = field(default_factory=list)


@dataclass(slots=True, eq=False)
class MapNode:
    """A mapping, in the order of the file; its values may be replaced by the preprocessor."""

    source: Source
    line: int
    entries: dict[str, Node] = field(default_factory=dict)
    key_lines: dict[str, int] = field(default_factory=dict)


Node = NullNode | ScalarNode | ListNode | MapNode


def load_documents(path: str) -> list[Node]:
    """Loads all documents of a file.

    Args:
        path: The file, UTF-8 or with the byte order mark of UTF-16.

    Returns:
        The root of each document, none for a file that holds only comments.

    Raises:
        YamlError: There is no such file, it cannot be read, or it is not YAML.
    """
    source = Source.of_file(path)
    return parse_documents(_decode(_read(path), source), source)


def parse_documents(text: str, source: Source) -> list[Node]:
    """Parses all documents of a text.

    Characters that YAML does not allow, and the surrogates that stand for undecodable bytes, are
    accepted in comments only. Of a key that occurs several times in a map the first value counts.

    Raises:
        YamlError: The text is not YAML.
    """
    return _Composer(text.removeprefix("\ufeff"), source).documents()


def _read(path: str) -> bytes:
    try:
        with open_regular(path) as file:
            content = file.read(_MAX_FILE_BYTES + 1)
    except (FileNotFoundError, NotADirectoryError):
        raise UnreadableFileError(f'File does not exist, path="{path}"') from None
    except OSError as error:
        raise UnreadableFileError(
            f'Failed to read file, path="{path}", {error.strerror}'
        ) from error
    if len(content) > _MAX_FILE_BYTES:
        raise UnreadableFileError(f'Failed to read file, path="{path}", it has more than 64 MiB')
    return content


def _decode(content: bytes, source: Source) -> str:
    if content[:2] not in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-8", "surrogateescape")
    try:
        return content.decode("utf-16")
    except UnicodeDecodeError as error:
        line, column = _line_and_column(content[: error.start].decode("utf-16", "replace"))
        _fail(source, line, column, f"byte 0x{content[error.start]:02x} is not UTF-16 text")


def _without_stray_tabs(text: str) -> str:
    """Replaces tabs in blank lines and before comments by spaces if the parser rejects the text.

    libyaml rejects such a tab where a key or an item may begin; yaml-cpp skips it. Each tab
    becomes one space, so lines and columns stay the same. In a text that was rejected, this
    includes lines of literal blocks that are blank or start with `#`.
    """
    blanked = _BLANK.sub(lambda match: match[0].replace("\t", " "), text)
    if blanked == text:
        return text
    try:
        for _ in yaml.parse(text, Loader=_Loader):
            pass
    except yaml.YAMLError:
        return blanked
    return text


def _line_and_column(before: str) -> tuple[int, int]:
    lines = before.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    return len(lines), len(lines[-1]) + 1


def _fail(source: Source, line: int, column: int, why: str) -> NoReturn:
    raise YamlError(f'Malformatted file, path="{source.path}", line {line} col {column}, {why}')


class _Composer:
    """Builds trees from the parser's events, without recursion, so that no file is too deep."""

    def __init__(self, text: str, source: Source) -> None:
        self._text = text
        self._source = source
        self._bad = [match.start() for match in _NOT_YAML_TEXT.finditer(text)]
        self._roots: list[Node] = []
        self._anchors: dict[str, Node] = {}
        self._open: list[ListNode | MapNode] = []
        self._keys: list[str | None] = []  # of each open node; None: a map's key is due
        self._heights: dict[int, int] = {}  # levels in each list and map, aliases counted

    def documents(self) -> list[Node]:
        text = _NOT_YAML_TEXT.sub(_REPLACEMENT, self._text) if self._bad else self._text
        try:
            for event in yaml.parse(_without_stray_tabs(text), Loader=_Loader):
                self._take(event)
        except yaml.MarkedYAMLError as error:
            mark = error.problem_mark or error.context_mark
            line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
            _fail(self._source, line, column, error.problem or error.context or "not YAML")
        except yaml.YAMLError as error:
            _fail(self._source, 1, 1, str(error))
        return self._roots

    def _take(self, event: yaml.Event) -> None:
        if isinstance(event, yaml.DocumentStartEvent):
            self._anchors.clear()
        elif isinstance(event, yaml.AliasEvent):
            node = self._add(self._aliased(event), event)
            self._heighten(self._heights.get(id(node), 0))
            if len(self._open) + self._heights.get(id(node), 0) > MAX_NESTING:
                self._fail_at(event, f"nested deeper than {MAX_NESTING} levels")
        elif isinstance(event, yaml.ScalarEvent):
            self._name(event, self._add(self._scalar(event), event))
        elif isinstance(event, yaml.SequenceStartEvent):
            self._begin(ListNode(self._source, _position(event)[0]), event)
        elif isinstance(event, yaml.MappingStartEvent):
            self._begin(MapNode(self._source, _position(event)[0]), event)
        elif isinstance(event, yaml.CollectionEndEvent):
            self._keys.pop()
            node = self._open.pop()
            self._heighten(self._heights[id(node)])

    def _begin(self, node: ListNode | MapNode, event: yaml.CollectionStartEvent) -> None:
        self._name(event, self._add(node, event))
        if len(self._open) >= MAX_NESTING:
            self._fail_at(event, f"nested deeper than {MAX_NESTING} levels")
        self._open.append(node)
        self._keys.append(None)
        self._heights[id(node)] = 1

    def _heighten(self, height: int) -> None:
        """Lets the innermost open node know how high one that it holds is."""
        if self._open:
            parent = id(self._open[-1])
            self._heights[parent] = max(self._heights[parent], height + 1)

    def _name(self, event: yaml.NodeEvent, node: Node) -> None:
        if event.anchor is not None:
            self._anchors[event.anchor] = node

    def _aliased(self, event: yaml.AliasEvent) -> Node:
        node = self._anchors.get(event.anchor or "")
        if node is None:
            self._fail_at(event, f'no anchor "{event.anchor}" before its alias')
        if any(node is open_node for open_node in self._open):
            self._fail_at(event, f'alias "{event.anchor}" stands inside its own anchor')
        return node

    def _scalar(self, event: yaml.ScalarEvent) -> Node:
        if self._bad and _REPLACEMENT in event.value:
            self._check_characters(event)
        line = _position(event)[0]
        plain = not event.style and event.tag in (None, _NULL_TAG)
        if plain and event.value in _NULLS and not self._key_is_due():
            return NullNode(self._source, line)
        return ScalarNode(self._source, line, event.value)

    def _check_characters(self, event: yaml.ScalarEvent) -> None:
        """Refuses a scalar with a character that only comments may contain."""
        marks = (event.start_mark, event.end_mark)
        start, end = (mark.index if mark is not None else 0 for mark in marks)
        first = bisect_left(self._bad, start)
        if first == len(self._bad) or self._bad[first] >= end:
            return
        index = self._bad[first]
        code = ord(self._text[index])
        if code in _UNDECODABLE:
            why = f"byte 0x{code & 0xFF:02x} is not UTF-8 text"
        else:
            why = f"character U+{code:04X} is not allowed"
        _fail(self._source, *_line_and_column(self._text[:index]), why)

    def _key_is_due(self) -> bool:
        return bool(self._open) and isinstance(self._open[-1], MapNode) and self._keys[-1] is None

    def _add(self, node: Node, event: yaml.Event) -> Node:
        """Puts a node where it stands: a root, an item, a key or the value of one."""
        parent = self._open[-1] if self._open else None
        if parent is None:
            self._roots.append(node)
        elif isinstance(parent, ListNode):
            parent.items.append(node)
        elif self._keys[-1] is not None:
            parent.entries.setdefault(self._keys[-1], node)
            self._keys[-1] = None
        else:
            self._keys[-1] = self._new_key(parent, node, event)
        return node

    def _new_key(self, parent: MapNode, node: Node, event: yaml.Event) -> str:
        if not isinstance(node, ScalarNode):
            self._fail_at(event, "a key must be a scalar")
        key = node.text
        line = _position(event)[0]
        first = parent.key_lines.setdefault(key, line)
        if key in parent.entries:
            _LOG.warning(
                'Duplicate key "%s" is ignored, its first value in line %d counts%s',
                key,
                first,
                self._source.place(line),
            )
        return key

    def _fail_at(self, event: yaml.Event, why: str) -> NoReturn:
        _fail(self._source, *_position(event), why)


def _position(event: yaml.Event) -> tuple[int, int]:
    """Returns line and column of an event, from 1."""
    mark = event.start_mark
    return (mark.line + 1, mark.column + 1) if mark is not None else (1, 1)
