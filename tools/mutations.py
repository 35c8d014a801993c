"""All changes of one place of a source file that `make mutate` can make.

Python sources are changed at the positions of nodes of their syntax tree, C++ sources at tokens.
The text around the place stays as it is, so that the difference of a change is that of its place.
"""

from __future__ import annotations

import ast
import itertools
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

_COMPARISONS: dict[type[ast.cmpop], tuple[str, ...]] = {
    ast.Lt: ("<=", ">"),
    ast.LtE: ("<", ">"),
    ast.Gt: (">=", "<"),
    ast.GtE: (">", "<"),
    ast.Eq: ("!=",),
    ast.NotEq: ("==",),
    ast.Is: ("is not",),
    ast.IsNot: ("is",),
    ast.In: ("not in",),
    ast.NotIn: ("in",),
}
_OPERATORS: dict[type[ast.operator], tuple[str, str]] = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.FloorDiv: ("//", "*"),
    ast.Mod: ("%", "*"),
    ast.Pow: ("**", "*"),
    ast.LShift: ("<<", ">>"),
    ast.RShift: (">>", "<<"),
    ast.BitAnd: ("&", "|"),
    ast.BitOr: ("|", "&"),
}
# Functions whose arguments have no order.
_COMMUTATIVE = {"b2Max", "b2Min", "hypot", "max", "maximum", "min", "minimum"}
_DROPPED = (ast.Assign, ast.AugAssign, ast.Break, ast.Continue, ast.Delete, ast.Expr, ast.Raise)


@dataclass(frozen=True)
class Mutation:
    """The replacement of a part of a text."""

    kind: str
    start: int
    end: int
    replacement: str

    def apply(self, text: str) -> str:
        """Returns the changed text."""
        return text[: self.start] + self.replacement + text[self.end :]


def mutations(path: Path, text: str) -> list[Mutation]:
    """Returns all changes of a source file, by position.

    Args:
        path: The file; its suffix determines the language.
        text: Its content.
    """
    found = _Python(text).visit(ast.parse(text)) if path.suffix == ".py" else _cpp(text)
    return sorted(found, key=lambda mutation: (mutation.start, mutation.end, mutation.replacement))


class _Python:
    """The changes of a Python source."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._lines = [0]
        for line in text.splitlines(keepends=True):
            self._lines.append(self._lines[-1] + len(line))
        self._bytes = [line.encode() for line in text.splitlines(keepends=True)]

    def visit(self, node: ast.AST, within: bool = False) -> Iterator[Mutation]:
        """Yields the changes of a node and of those below it.

        Annotations, decorators and code for type checkers are left out: tests do not run them.

        Args:
            node: The node.
            within: Whether it is part of a function.
        """
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            return
        if isinstance(node, ast.Assert) or _is_type_variable(node):
            return
        if isinstance(node, ast.stmt) and within:
            yield from self._dropped(node)
        if isinstance(node, ast.expr):
            yield from self._expression(node)
        if isinstance(node, ast.If | ast.While | ast.IfExp):
            yield from self._negated(node.test)
        if isinstance(node, ast.AugAssign) and type(node.op) in _OPERATORS:
            old, new = _OPERATORS[type(node.op)]
            yield self._between("operator", node.target, node.value, f"{old}=", f"{new}=")
        within = within or isinstance(node, ast.FunctionDef)
        for name, value in ast.iter_fields(node):
            if name in ("annotation", "returns", "decorator_list", "type_params"):
                continue
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST):
                    yield from self.visit(child, within)

    def _dropped(self, node: ast.stmt) -> Iterator[Mutation]:
        if not isinstance(node, _DROPPED):
            return
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            return  # a docstring
        yield Mutation("statement dropped", *self._span(node), "pass")

    def _expression(self, node: ast.expr) -> Iterator[Mutation]:
        match node:
            case ast.Compare():
                operands = [node.left, *node.comparators]
                for left, operator, right in zip(
                    operands, node.ops, node.comparators, strict=False
                ):
                    for new in _COMPARISONS[type(operator)]:
                        yield self._between("comparison", left, right, None, new)
            case ast.BoolOp():
                old, new = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
                for left, right in itertools.pairwise(node.values):
                    yield self._between("and/or", left, right, old, new)
            case ast.BinOp() if type(node.op) in _OPERATORS:
                old, new = _OPERATORS[type(node.op)]
                yield self._between("operator", node.left, node.right, old, new)
            case ast.UnaryOp(op=ast.Not() | ast.USub()):
                start, _ = self._span(node)
                kind, length = ("not", 4) if isinstance(node.op, ast.Not) else ("sign", 1)
                yield Mutation(kind, start, start + length, "")
            case ast.Constant(value=bool()):
                yield Mutation("constant", *self._span(node), str(not node.value))
            case ast.Constant(value=int()):
                yield Mutation("constant", *self._span(node), str(node.value + 1))
            case ast.Constant(value=float()):
                yield Mutation("constant", *self._span(node), repr(node.value * 2 or 1.0))
            case ast.Call():
                yield from self._call(node)

    def _call(self, node: ast.Call) -> Iterator[Mutation]:
        name = self._text[slice(*self._span(node.func))].rpartition(".")[2]
        positional = [] if name in _COMMUTATIVE else node.args
        if any(isinstance(argument, ast.GeneratorExp) for argument in positional):
            return  # without parentheses of its own
        for first, second in itertools.pairwise(positional):
            spans = (self._span(first), self._span(second))
            texts = [self._text[start:end] for start, end in spans]
            if texts[0] != texts[1] and not isinstance(second, ast.Starred):
                between = self._text[spans[0][1] : spans[1][0]]
                swapped = texts[1] + between + texts[0]
                yield Mutation("arguments swapped", spans[0][0], spans[1][1], swapped)
        for keyword in node.keywords:
            if keyword.arg is not None:
                start, end = self._span(keyword)
                separator = re.compile(r"\s*,\s*").match(self._text, end)
                yield Mutation("keyword dropped", start, separator.end() if separator else end, "")

    def _negated(self, test: ast.expr) -> Iterator[Mutation]:
        if isinstance(test, ast.Name | ast.Attribute | ast.Call):
            start, _ = self._span(test)
            yield Mutation("not", start, start, "not ")

    def _between(
        self, kind: str, left: ast.expr, right: ast.expr, old: str | None, new: str
    ) -> Mutation:
        """Returns the replacement of the operator between two operands."""
        start, end = self._span(left)[1], self._span(right)[0]
        pattern = re.escape(old) if old else r"[<>=!]=?|not\s+in|in|is\s+not|is"
        found = re.compile(pattern).search(self._text, start, end)
        assert found, (kind, self._text[start:end])  # noqa: S101
        return Mutation(kind, found.start(), found.end(), new)

    def _span(self, node: ast.expr | ast.stmt | ast.keyword) -> tuple[int, int]:
        """Returns the offsets of the first character of a node, and of that after its last."""
        assert node.end_lineno is not None  # noqa: S101
        assert node.end_col_offset is not None  # noqa: S101
        start = self._offset(node.lineno, node.col_offset)
        return start, self._offset(node.end_lineno, node.end_col_offset)

    def _offset(self, line: int, column: int) -> int:
        """Returns an offset in the text; columns of syntax trees count bytes."""
        return self._lines[line - 1] + len(self._bytes[line - 1][:column].decode())


def _is_type_variable(node: ast.AST) -> bool:
    return isinstance(node, ast.Call) and ast.unparse(node.func) in ("ParamSpec", "TypeVar")


# Clang-format puts spaces around binary operators, and none around the brackets of templates.
_CPP_TOKENS = {
    "comparison": {
        " < ": (" <= ", " > "),
        " <= ": (" < ", " > "),
        " > ": (" >= ", " < "),
        " >= ": (" > ", " < "),
        " == ": (" != ",),
        " != ": (" == ",),
    },
    "and/or": {" && ": (" || ",), " || ": (" && ",)},
    "operator": {
        " + ": (" - ",),
        " - ": (" + ",),
        " * ": (" / ",),
        " / ": (" * ",),
        " % ": (" * ",),
        " += ": (" -= ",),
        " -= ": (" += ",),
        " *= ": (" /= ",),
        " /= ": (" *= ",),
        " & ": (" | ",),
        " | ": (" & ",),
        " |= ": (" &= ",),
        " &= ": (" |= ",),
        " << ": (" >> ",),
        " >> ": (" << ",),
        "++": ("--",),
        "--": ("++",),
        "std::min(": ("std::max(",),
        "std::max(": ("std::min(",),
    },
    "constant": {"true": ("false",), "false": ("true",)},
}
_CPP_TOKEN = re.compile(
    "|".join(
        rf"\b{old}\b" if old.isalpha() else re.escape(old)
        for table in _CPP_TOKENS.values()
        for old in sorted(table, key=len, reverse=True)
    )
)
_CPP_REPLACED = {
    old: (kind, new) for kind, table in _CPP_TOKENS.items() for old, new in table.items()
}
_CPP_HIDDEN = re.compile(
    r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\])*"|\'(?:\\.|[^\'\\])*\'|^#(?:\\\n|[^\n])*', re.S | re.M
)
_CPP_NUMBER = re.compile(r"(?<![\w.])(\d+)(\.\d*)?(e[+-]?\d+)?([fFuUL]*)(?![\w.])")
# A call or an assignment. Declarations begin with two words.
_CPP_STATEMENT = re.compile(
    r"^ +((?:[\w:]+(?:\[[^\[\]\n]*\]|\([^()\n]*\))*(?:\.|->))*[\w:]+(?:\[[^\[\]\n]*\])*"
    r"(?: [-+*/|&]?= [^;\n]*|\([^;\n]*\));)$",
    re.M,
)
_CPP_JUMP = re.compile(r"\b(?:continue|break);")
_CPP_CONDITION = re.compile(r"\b(?:if|while) \(")
_CPP_CALL = re.compile(r"\b\w+\(")
_CPP_PARAMETER = re.compile(r"(?:const )?[\w:]+(?:<.*>)?(?: ?[&*])? [&*]?\w+(?: = .*)?")


def _cpp(text: str) -> Iterator[Mutation]:
    """Yields the changes of a C++ source that clang-format has formatted."""
    # Of the same length, so that positions stay.
    code = _CPP_HIDDEN.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)
    for match in _CPP_TOKEN.finditer(code):
        kind, replacements = _CPP_REPLACED[match[0]]
        for new in replacements:
            yield Mutation(kind, match.start(), match.end(), new)
    for match in re.finditer(r"(?<=[(\[ ,])!(?=[\w(])", code):
        yield Mutation("not", match.start(), match.end(), "")
    for match in re.finditer(
        r"(?<=[(\[,{=?:] )-(?=[\w(])|(?<=[(\[{])-(?=[\w(])|(?<=return )-", code
    ):
        yield Mutation("sign", match.start(), match.end(), "")
    for match in _CPP_NUMBER.finditer(code):
        if match[2] is None and match[3] is None:
            new = f"{int(match[1]) + 1}{match[4]}"
        else:
            value = float(match[0].rstrip("fFL"))
            new = f"{value * 2 or 1.0!r}{match[4]}"
        yield Mutation("constant", match.start(), match.end(), new)
    for match in _CPP_STATEMENT.finditer(code):
        if not match[1].startswith(("return", "throw", "static_assert", "using", "delete")):
            yield Mutation("statement dropped", match.start(1), match.end(1), ";")
    for match in _CPP_JUMP.finditer(code):
        yield Mutation("statement dropped", match.start(), match.end(), ";")
    for match in _CPP_CONDITION.finditer(code):
        spans = _cpp_arguments(code, match.end())
        if len(spans) == 1 and not re.search(r"[;=<>&|]", code[slice(*spans[0])]):
            start, end = spans[0]
            yield Mutation("not", start, end, f"!({text[start:end]})")
    for match in _CPP_CALL.finditer(code):
        if match[0][:-1] in _COMMUTATIVE:
            continue
        spans = _cpp_arguments(code, match.end())
        for (start, middle), (second, end) in itertools.pairwise(spans):
            texts = text[start:middle], text[second:end]
            if texts[0] != texts[1] and not any(map(_CPP_PARAMETER.fullmatch, texts)):
                swapped = texts[1] + text[middle:second] + texts[0]
                yield Mutation("arguments swapped", start, end, swapped)


def _cpp_arguments(code: str, start: int) -> list[tuple[int, int]]:
    """Returns the spans of the arguments that follow an opening parenthesis."""
    spans: list[tuple[int, int]] = []
    depth = 0
    begin = start
    for position in range(start, len(code)):
        character = code[position]
        if character in "([{":
            depth += 1
        elif character in ")]}" and depth:
            depth -= 1
        elif character == ")" or (character == "," and not depth):
            argument = code[begin:position]
            if argument.strip():
                first = begin + len(argument) - len(argument.lstrip())
                spans.append((first, first + len(argument.strip())))
            begin = position + 1
            if character == ")":
                return spans
        elif character in ";]}":
            break
    return []
