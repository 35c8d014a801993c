"""Converts the text of a scalar to the type that a parameter asks for."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any, Final, Literal, TypedDict

from flatland.config.node import ListNode, MapNode, Node, ScalarNode

BoolKind = Literal["bool"] | type[bool]
IntKind = Literal["int"] | type[int]
FloatKind = Literal["float"] | type[float]
StringKind = Literal["string"] | type[str]
Kind = BoolKind | IntKind | FloatKind | StringKind | Literal["vector", "pose", "color"]
NodeKind = Literal["any", "map", "list"]
Key = str | int
Color = tuple[float, float, float, float]


class Sizes(TypedDict, total=False):
    """How many items a list may have."""

    min_size: int
    max_size: int | None
    size: int | None


_FLOAT: Final = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_DECIMAL: Final = re.compile(r"[-+]?(0|[1-9][0-9]*)")
_HEXADECIMAL: Final = re.compile(r"([-+]?)0x([0-9a-fA-F]+)")
_OCTAL: Final = re.compile(r"([-+]?)0o?([0-7]+)")
_INT_MIN: Final = -(2**31)  # what the reference, and Box2D behind it, can hold
_INT_MAX: Final = 2**31 - 1


def _spellings(*words: str) -> frozenset[str]:
    return frozenset(
        spelling for word in words for spelling in (word, word.capitalize(), word.upper())
    )


_TRUE: Final = _spellings("true", "yes", "on", "y")
_FALSE: Final = _spellings("false", "no", "off", "n")
_SPECIAL_FLOATS: Final = {
    **dict.fromkeys((".nan", ".NaN", ".NAN", "nan"), math.nan),
    **dict.fromkeys((".inf", ".Inf", ".INF", "+.inf", "+.Inf", "+.INF", "inf"), math.inf),
    **dict.fromkeys(("-.inf", "-.Inf", "-.INF", "-inf"), -math.inf),
}


def to_string(text: str) -> str:
    """Returns the text: any scalar is a string."""
    return text


def to_float(text: str) -> float:
    """Converts a decimal number, `.inf` or `.nan` (also `inf`, `-inf`, `nan`).

    Raises:
        ValueError: It is none, or beyond the range of a float.
    """
    if _FLOAT.fullmatch(text):
        number = float(text)
        if math.isinf(number):
            raise ValueError("out of range")
        return number
    try:
        return _SPECIAL_FLOATS[text]
    except KeyError:
        raise ValueError("not a number") from None


def to_int(text: str) -> int:
    """Converts a decimal (`12`), hexadecimal (`0x1f`) or octal (`0o17`, `017`) integer.

    Raises:
        ValueError: It is none, or does not fit into 32 bits.
    """
    if _DECIMAL.fullmatch(text):
        # Longer than any 32-bit number; int() of a huge text would take long.
        number = int(text) if len(text) < 20 else _INT_MAX + 1
    elif match := _HEXADECIMAL.fullmatch(text):
        number = int(match[1] + match[2], 16)
    elif match := _OCTAL.fullmatch(text):
        number = int(match[1] + match[2], 8)
    else:
        raise ValueError("not an integer")
    if not _INT_MIN <= number <= _INT_MAX:
        raise ValueError("out of range")
    return number


def to_bool(text: str) -> bool:
    """Converts `true/false`, `yes/no`, `on/off`, `y/n` in lower, Capitalised or UPPER case.

    Raises:
        ValueError: It is none of them.
    """
    if text in _TRUE:
        return True
    if text in _FALSE:
        return False
    raise ValueError("not a bool")


def to_vector(node: Node) -> tuple[float, float]:
    """Converts a list of two floats.

    Raises:
        ValueError: It is none.
    """
    if not isinstance(node, ListNode) or len(node.items) != 2:
        raise ValueError("not a list of two")
    x, y = (to_float(item.text if isinstance(item, ScalarNode) else "") for item in node.items)
    return x, y


def to_plain(node: Node, _done: dict[int, object] | None = None) -> object:
    """Converts a tree to dict, list, str and None; what an alias shares stays shared."""
    done = {} if _done is None else _done
    if isinstance(node, ScalarNode):
        return node.text
    if id(node) not in done:
        if isinstance(node, ListNode):
            done[id(node)] = [to_plain(item, done) for item in node.items]
        elif isinstance(node, MapNode):
            done[id(node)] = {key: to_plain(value, done) for key, value in node.entries.items()}
    return done.get(id(node))


def _scalar(convert: Callable[[str], object]) -> Callable[[Node], object]:
    def convert_node(node: Node) -> object:
        if not isinstance(node, ScalarNode):
            raise ValueError("not a scalar")
        return convert(node.text)

    return convert_node


CONVERSIONS: Final[dict[object, tuple[str, Callable[[Node], Any]]]] = {
    **dict.fromkeys(("string", str), ("string", _scalar(to_string))),
    **dict.fromkeys(("float", float), ("float", _scalar(to_float))),
    **dict.fromkeys(("int", int), ("int", _scalar(to_int))),
    **dict.fromkeys(("bool", bool), ("bool", _scalar(to_bool))),
    "vector": ("vector", to_vector),
}
"""The name for messages and the conversion of each kind of a single value."""

TUPLE_SIZES: Final = {"pose": 3, "color": 4}
"""How many floats each kind of fixed size has."""
