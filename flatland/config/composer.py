"""Composition of trees of nodes from the events of the YAML parser.

`yaml.compose_all` is not used: with the C loader it overflows the C stack on deeply nested text, it
rejects the redefinition of an anchor, which YAML allows, and it takes three times as long.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from typing import Any, NoReturn

import yaml

from flatland.config import hints
from flatland.config.inputs import Inputs
from flatland.config.node import MAX_NESTING, ListNode, MapNode, Node, NullNode, ScalarNode, Source
from flatland.errors import YamlError

_Loader: Any = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
_NULLS = frozenset(("", "~", "null", "Null", "NULL"))
_NULL_TAG = "tag:yaml.org,2002:null"
NOT_YAML_TEXT = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""A character that YAML does not allow, unless it is escaped."""
_REPLACEMENT = "\ufffd"
_UNDECODABLE = range(0xDC80, 0xDD00)  # the surrogates for the bytes 0x80 to 0xff
# White space before a comment or the end of a line, preceded by list and map indicators only.
_BLANK = re.compile(r"^(?:[ \t]*+[-?:](?=[ \t]))*+[ \t]++(?=#|\r?$)", re.MULTILINE)


def malformed(source: Source, line: int, column: int, why: str, text: str = "") -> YamlError:
    """Returns the error of a text that is not valid YAML.

    Args:
        source: Origin of the text.
        line: Line number of the problem, from 1.
        column: Column number of the problem, from 1.
        why: Description of the problem.
        text: The text, for the hint.
    """
    return YamlError(
        f'Malformatted file, path="{source.path}", line {line} col {column}, {why}',
        place=source.place(line, column),
        hint=hints.malformed(why, text),
    )


def end_position(text: str) -> tuple[int, int]:
    """Returns line and column of the position behind a text, from 1."""
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    return len(lines), len(lines[-1]) + 1


class Composer:
    """Builds the tree of each document of a text, without recursion."""

    def __init__(self, text: str, source: Source, inputs: Inputs) -> None:
        """Prepares the composition of a text.

        Args:
            text: YAML text. Characters that YAML does not allow, and the surrogates that represent
                undecodable bytes, are accepted in comments only.
            source: Origin of the text.
            inputs: Logs warnings.
        """
        self._text = text
        self._source = source
        self._inputs = inputs
        self._invalid_indices = [match.start() for match in NOT_YAML_TEXT.finditer(text)]
        self._roots: list[Node] = []
        self._anchors: dict[str, Node] = {}
        self._open: list[ListNode | MapNode] = []
        # The pending key of each open node; None for a list, and in a map before a key.
        self._keys: list[str | None] = []
        # Number of levels in each list and map by the id of the node, including levels of aliases.
        self._heights: dict[int, int] = {}

    def compose(self) -> list[Node]:
        """Returns the root of each document.

        Raises:
            YamlError: The text is not valid YAML.
        """
        text = self._text
        if self._invalid_indices:
            text = NOT_YAML_TEXT.sub(_REPLACEMENT, text)
        try:
            # Not `yaml.parse`, which adds a call to each event.
            loader = _Loader(_without_stray_tabs(text))
            try:
                while loader.check_event():
                    self._handle(loader.get_event())
            finally:
                loader.dispose()
        except yaml.MarkedYAMLError as error:
            mark = error.problem_mark or error.context_mark
            line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
            why = error.problem or error.context or "invalid YAML"
            raise malformed(self._source, line, column, why, self._text) from error
        except yaml.YAMLError as error:
            raise malformed(self._source, 1, 1, str(error)) from error
        return self._roots

    def _handle(self, event: yaml.Event) -> None:
        if isinstance(event, yaml.DocumentStartEvent):
            self._anchors.clear()
        elif isinstance(event, yaml.AliasEvent):
            node = self._add(self._resolve_alias(event), event)
            height = self._heights.get(id(node), 0)
            self._grow_parent(height)
            if len(self._open) + height > MAX_NESTING:
                self._fail_at(event, f"nested deeper than {MAX_NESTING} levels")
        elif isinstance(event, yaml.ScalarEvent):
            self._set_anchor(event, self._add(self._scalar(event), event))
        elif isinstance(event, yaml.SequenceStartEvent):
            self._begin(ListNode(self._source, _start(event)[0]), event)
        elif isinstance(event, yaml.MappingStartEvent):
            self._begin(MapNode(self._source, _start(event)[0]), event)
        elif isinstance(event, yaml.CollectionEndEvent):
            self._keys.pop()
            self._grow_parent(self._heights[id(self._open.pop())])

    def _begin(self, node: ListNode | MapNode, event: yaml.CollectionStartEvent) -> None:
        self._set_anchor(event, self._add(node, event))
        if len(self._open) >= MAX_NESTING:
            self._fail_at(event, f"nested deeper than {MAX_NESTING} levels")
        self._open.append(node)
        self._keys.append(None)
        self._heights[id(node)] = 1

    def _grow_parent(self, height: int) -> None:
        """Updates the height of the innermost open node for a child of the given height."""
        if self._open:
            parent = id(self._open[-1])
            self._heights[parent] = max(self._heights[parent], height + 1)

    def _set_anchor(self, event: yaml.NodeEvent, node: Node) -> None:
        if event.anchor is not None:
            self._anchors[event.anchor] = node

    def _resolve_alias(self, event: yaml.AliasEvent) -> Node:
        node = self._anchors.get(event.anchor or "")
        if node is None:
            self._fail_at(event, f'undefined alias "{event.anchor}"')
        if any(node is open_node for open_node in self._open):
            self._fail_at(event, f'alias "{event.anchor}" refers to a node that contains it')
        return node

    def _scalar(self, event: yaml.ScalarEvent) -> Node:
        if self._invalid_indices and _REPLACEMENT in event.value:
            self._check_characters(event)
        line = _start(event)[0]
        plain = not event.style and event.tag in (None, _NULL_TAG)
        if plain and event.value in _NULLS and not self._expects_key():
            return NullNode(self._source, line)
        return ScalarNode(self._source, line, event.value)

    def _check_characters(self, event: yaml.ScalarEvent) -> None:
        """Rejects a scalar that contains a character allowed in comments only."""
        marks = (event.start_mark, event.end_mark)
        start, end = (mark.index if mark is not None else 0 for mark in marks)
        first = bisect_left(self._invalid_indices, start)
        if first == len(self._invalid_indices) or self._invalid_indices[first] >= end:
            return
        index = self._invalid_indices[first]
        code = ord(self._text[index])
        if code in _UNDECODABLE:
            why = f"byte 0x{code & 0xFF:02x} is not valid UTF-8"
        else:
            why = f"character U+{code:04X} is not allowed"
        raise malformed(self._source, *end_position(self._text[:index]), why)

    def _expects_key(self) -> bool:
        return bool(self._open) and isinstance(self._open[-1], MapNode) and self._keys[-1] is None

    def _add(self, node: Node, event: yaml.Event) -> Node:
        """Adds a node to the innermost open node, as an item, a key or a value, or as a root."""
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
        line = _start(event)[0]
        first = parent.key_lines.setdefault(key, line)
        if key in parent.entries:
            text = 'Duplicate key "%s" ignored, the value in line %d is used'
            is_item = len(self._open) > 1 and isinstance(self._open[-2], ListNode)
            hint = hints.duplicate_key(key) if is_item and line > first else ""
            self._inputs.warn(self._source.place(line), text, key, first, hint=hint)
        return key

    def _fail_at(self, event: yaml.Event, why: str) -> NoReturn:
        raise malformed(self._source, *_start(event), why)


def _start(event: yaml.Event) -> tuple[int, int]:
    """Returns line and column of the start of an event, from 1."""
    mark = event.start_mark
    return (mark.line + 1, mark.column + 1) if mark is not None else (1, 1)


def _without_stray_tabs(text: str) -> str:
    """Replaces tabs in blank lines and before comments by spaces if the parser rejects the text.

    libyaml rejects such a tab where a key or an item may begin; yaml-cpp skips it. Each tab
    becomes one space, so that lines and columns stay the same. In a text that was rejected, this
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
