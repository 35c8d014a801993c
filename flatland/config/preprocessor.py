"""Expansion of `$eval` and `$include` in a tree of YAML nodes, before values are read."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path

from flatland.config.composer import NOT_YAML_TEXT
from flatland.config.documents import load_documents, parse_documents
from flatland.config.hints import is_yaml_name, similar_file
from flatland.config.inputs import Inputs
from flatland.config.lua import EvalError, evaluate
from flatland.config.node import MAX_NESTING, ListNode, MapNode, Node, NullNode, ScalarNode, Source
from flatland.errors import YamlError

_EVAL = "$eval"
_INCLUDE = "$include"
_INCLUDE_ALL = "$[include]"
_MAX_INCLUDES = 5_000  # of one run; a chain in which each file includes the next one twice explodes
# s of processor time of all expressions of a run together; quick ones do not count.
_TOTAL_TIME_LIMIT = 1.0
_QUICK = 0.01  # s
_MAX_SHOWN = 500  # characters of an expression or a Lua message in an error message

ExpansionErrorHandler = Callable[[YamlError, Node], None]


def preprocess_file(
    path: str, inputs: Inputs, on_error: ExpansionErrorHandler | None = None
) -> Node:
    """Loads a file and preprocesses its first document.

    Args:
        path: The file.
        inputs: Reads the file, the files that it includes, and parameters.
        on_error: Called with the error of each scalar that cannot be expanded, and with the scalar,
            which then stays as it is; None to raise the first error.

    Returns:
        The root; a null node for a file without a document.

    Raises:
        YamlError: The file cannot be read, is not valid YAML, or cannot be preprocessed.
    """
    root = _first(load_documents(path, inputs), Source.of_file(path), inputs)
    return _Preprocessor(inputs, on_error).expand(root, ((_identity(path), path),), 0)


def preprocess_text(text: str, base_dir: str, inputs: Inputs, name: str = "") -> Node:
    """Parses a text and preprocesses its first document.

    Args:
        text: The YAML text.
        base_dir: Folder that relative paths start from.
        inputs: Reads the files that the text includes, and parameters.
        name: Name of the text in error messages, in place of a file.

    Raises:
        YamlError: The text is not valid YAML, or cannot be preprocessed.
    """
    source = Source(name, str(Path.cwd() / base_dir))
    documents = inputs.documents_ahead(text)
    if documents is None:
        documents = parse_documents(text, source, inputs)
    root = _first(documents, source, inputs)
    return _Preprocessor(inputs).expand(root, (), 0)


def included_files(documents: list[Node]) -> Iterator[str]:
    """Returns the absolute paths of the files that a file includes, existing or not.

    Args:
        documents: The documents of the file before preprocessing.
    """
    waiting = list(documents)
    seen: set[int] = set()  # an alias is the node of its anchor
    while waiting:
        node = waiting.pop()
        if id(node) in seen:
            continue
        seen.add(id(node))
        if isinstance(node, ListNode):
            waiting += node.items
        elif isinstance(node, MapNode):
            waiting += node.entries.values()
        elif isinstance(node, ScalarNode):
            for marker in (_INCLUDE, _INCLUDE_ALL):
                if node.text.startswith(marker):
                    yield node.source.resolve(node.text[len(marker) :].strip())


def _identity(path: str) -> str:
    return str(Path(path).resolve())


def _first(documents: list[Node], source: Source, inputs: Inputs) -> Node:
    if not documents:
        return NullNode(source, 1)
    if len(documents) > 1:
        second = source.place(documents[1].line)
        inputs.warn(second, "Only the first of %d YAML documents is used", len(documents))
    return documents[0]


def _shown(text: str) -> str:
    """Returns a text for messages: shortened, and with escapes for characters that do not print."""
    text = text if len(text) <= _MAX_SHOWN else text[:_MAX_SHOWN] + "..."
    return "".join(char if char.isprintable() else repr(char)[1:-1] for char in text)


def _is_other_yaml(file: Path, node: Node) -> bool:
    """Returns whether a file can be included by a node."""
    return is_yaml_name(file) and file.absolute() != Path(node.source.path).absolute()


_Chain = tuple[tuple[str, str], ...]
"""The files from the outermost to the innermost, each as (real path, path for messages)."""


class _Preprocessor:
    """Expands one file with all files that it includes."""

    def __init__(self, inputs: Inputs, on_error: ExpansionErrorHandler | None = None) -> None:
        self._inputs = inputs
        self._on_error = on_error
        self._includes = 0
        self._spent = 0.0  # s of processor time, by expressions that are not quick
        # The result for each node by its id, so that a node with aliases is expanded once. The
        # original node is kept alive because the id of a deleted object can be reused.
        self._done: dict[int, tuple[Node, Node]] = {}

    def expand(self, node: Node, chain: _Chain, depth: int) -> Node:
        """Expands a node, in place if possible, and returns the expanded node."""
        if isinstance(node, NullNode):
            return node
        done = self._done.get(id(node))
        if done is not None:
            return done[1]
        if depth > MAX_NESTING:
            raise self._error(node, f"Nested deeper than {MAX_NESTING} levels")
        result: Node = node
        if isinstance(node, ScalarNode):
            try:
                result = self._expand_scalar(node, chain, depth)
            except YamlError as error:
                self._handle(error, node)
        elif isinstance(node, ListNode):
            node.items = self._expand_items(node.items, chain, depth)
        else:
            for key, value in node.entries.items():
                node.entries[key] = self.expand(value, chain, depth + 1)
        self._done[id(node)] = (node, result)
        return result

    def _expand_items(self, items: list[Node], chain: _Chain, depth: int) -> list[Node]:
        expanded: list[Node] = []
        for item in items:
            if isinstance(item, ScalarNode) and item.text.startswith(_INCLUDE_ALL):
                try:
                    expanded += self._include(item, _INCLUDE_ALL, chain, depth + 1)
                except YamlError as error:
                    self._handle(error, item)
            else:
                expanded.append(self.expand(item, chain, depth + 1))
        return expanded

    def _expand_scalar(self, node: ScalarNode, chain: _Chain, depth: int) -> Node:
        if node.text.startswith(_EVAL):
            return ScalarNode(node.source, node.line, self._evaluate(node))
        if node.text.startswith(_INCLUDE):
            return self._include(node, _INCLUDE, chain, depth)[0]
        if node.text.startswith(_INCLUDE_ALL):
            raise self._error(node, f"{_INCLUDE_ALL} must be an item of a list")
        return node

    def _handle(self, error: YamlError, node: Node) -> None:
        if self._on_error is None:
            raise error
        self._on_error(error, node)

    def _evaluate(self, node: ScalarNode) -> str:
        expression = node.text[len(_EVAL) :].strip(" \t\r\n\f\v")
        start = time.thread_time()
        try:
            result = evaluate(expression, self._inputs.param, self._inputs.next_seed())
            spent = time.thread_time() - start
            if spent > _QUICK:
                self._spent += spent
            if self._spent > _TOTAL_TIME_LIMIT:
                raise EvalError(
                    f"all expressions together exceed the time limit of {_TOTAL_TIME_LIMIT:g} s"
                )
            illegal = NOT_YAML_TEXT.search(result.text)
            if illegal:
                code = f"U+{ord(illegal[0]):04X}"
                raise EvalError(f"the result contains the character {code}", result.printed)
        except EvalError as error:
            self._log_printed(node, error.printed)
            message = f'Failed to evaluate "{_shown(expression)}", {_shown(str(error))}'
            raise self._error(node, message) from error
        self._log_printed(node, result.printed)
        place = node.source.place(node.line)
        for name in result.unset:
            self._inputs.warn(place, "%s is not set", name)
        return result.text

    def _log_printed(self, node: ScalarNode, text: str) -> None:
        if text:
            place = node.source.place(node.line)
            self._inputs.log.info("$eval printed: %s%s", _shown(text.rstrip("\n")), place.suffix)

    def _include(self, node: ScalarNode, marker: str, chain: _Chain, depth: int) -> list[Node]:
        written = node.text[len(marker) :].strip()
        path = node.source.resolve(written)
        try:
            exists = self._inputs.exists(path)
        except PermissionError as error:
            raise self._error(
                node, f'Failed to read file, path="{path}", {error.strerror}'
            ) from error
        if not (written and exists):
            raise self._error(
                node,
                f"File specified in {marker} does not exist, path={path}, include={written}",
                similar_file(path, lambda file: _is_other_yaml(file, node)) if written else "",
            )
        self._includes += 1
        if self._includes > _MAX_INCLUDES:
            raise self._error(node, f"More than {_MAX_INCLUDES} files are included")
        identity = _identity(path)
        if any(identity == other for other, _ in chain):
            files = " -> ".join([*(shown for _, shown in chain), path])
            raise self._error(node, f"File includes itself, {files}")
        try:
            documents = load_documents(path, self._inputs)
        except YamlError as error:
            raise self._error(node, error.message, error.hint) from error
        if marker == _INCLUDE:
            documents = [_first(documents, Source.of_file(path), self._inputs)]
        chain = (*chain, (identity, path))
        return [self.expand(document, chain, depth) for document in documents]

    @staticmethod
    def _error(node: Node, message: str, hint: str = "") -> YamlError:
        place = node.source.place(node.line)
        return YamlError(message + place.suffix, place=place, hint=hint)
