"""Conversion of YAML nodes to the kinds of values that parameters have, and range checks."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from typing import Any, Final, Literal, TypedDict

from flatland.config.node import ListNode, MapNode, Node, ScalarNode

BoolKind = Literal["bool"] | type[bool]
IntKind = Literal["int"] | type[int]
FloatKind = Literal["float", "angle"] | type[float]
StringKind = Literal["string"] | type[str]
Kind = BoolKind | IntKind | FloatKind | StringKind | Literal["vector", "pose", "color"]
NodeKind = Literal["any", "map", "list"]
Key = str | int
Color = tuple[float, float, float, float]


class Limits(TypedDict, total=False):
    """Requirements of a number, or of each number of a vector, pose, colour or list.

    Attributes:
        finite: Whether infinity and NaN are rejected.
        minimum: Smallest allowed number; NaN is rejected. None for no limit.
        maximum: Largest allowed number; NaN is rejected. None for no limit.
    """

    finite: bool
    minimum: float | None
    maximum: float | None


class ListSizes(TypedDict, total=False):
    """Requirements of the size of a list.

    Attributes:
        min_size: Smallest number of items.
        max_size: Largest number of items, None for no limit.
        size: Exact number of items, None for any.
    """

    min_size: int
    max_size: int | None
    size: int | None


class ListLimits(Limits, ListSizes, total=False):
    """Requirements of a list of numbers."""


_FLOAT: Final = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_DECIMAL: Final = re.compile(r"[-+]?(0|[1-9][0-9]*)")
_HEXADECIMAL: Final = re.compile(r"([-+]?)0x([0-9a-fA-F]+)")
_OCTAL: Final = re.compile(r"([-+]?)0o?([0-7]+)")
_INT_MIN: Final = -(2**31)  # the range of an int in the reference
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
    """Returns the text unchanged."""
    return text


def to_float(text: str) -> float:
    """Converts a decimal number, `.inf` or `.nan` (also `inf`, `-inf`, `nan`).

    Raises:
        ValueError: The text is not a number, or outside the range of a float.
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
        ValueError: The text is not an integer, or outside the 32-bit range.
    """
    if _DECIMAL.fullmatch(text):
        # A longer text is out of range in any case, and int() of a huge text is slow.
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
        ValueError: The text is not one of these words.
    """
    if text in _TRUE:
        return True
    if text in _FALSE:
        return False
    raise ValueError("not a bool")


def to_vector(node: Node) -> tuple[float, float]:
    """Converts a list of two floats.

    Raises:
        ValueError: The node is not a list of two floats.
    """
    if not isinstance(node, ListNode) or len(node.items) != 2:
        raise ValueError("not a list of two")
    x, y = (to_float(item.text if isinstance(item, ScalarNode) else "") for item in node.items)
    return x, y


def _numbers(value: Any) -> Iterator[float]:
    if isinstance(value, (tuple, list)):
        for item in value:
            yield from _numbers(item)
    else:
        yield value


def unmet_limit(
    value: Any, finite: bool = False, minimum: float | None = None, maximum: float | None = None
) -> str:
    """Checks a value against `Limits`.

    Args:
        value: A number, or a tuple or list of such values; each number is checked.
        finite: See `Limits`.
        minimum: See `Limits`.
        maximum: See `Limits`.

    Returns:
        The violated requirement in words, such as `must be finite and at least 1`; empty for a
        valid value.
    """
    if all(
        (not finite or math.isfinite(number))
        and (minimum is None or number >= minimum)
        and (maximum is None or number <= maximum)
        for number in _numbers(value)
    ):
        return ""
    if minimum is not None and maximum is not None:
        limit = f"from {minimum:.12g} to {maximum:.12g}"
    elif minimum == 0:
        if not finite:
            return "must not be negative or NaN"
        limit = "not negative"
    elif minimum is not None:
        limit = f"at least {minimum:.12g}"
    else:
        limit = "" if maximum is None else f"at most {maximum:.12g}"
    return "must be " + " and ".join(filter(None, ("finite" if finite else "", limit)))


def to_plain(node: Node, _done: dict[int, object] | None = None) -> object:
    """Converts a tree to dict, list, str and None; an alias becomes the object of its anchor."""
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
    **dict.fromkeys(("float", float, "angle"), ("float", _scalar(to_float))),
    **dict.fromkeys(("int", int), ("int", _scalar(to_int))),
    **dict.fromkeys(("bool", bool), ("bool", _scalar(to_bool))),
    "vector": ("vector", to_vector),
}
"""Name in error messages and conversion function by kind, for kinds that one node converts to."""

TUPLE_SIZES: Final = {"pose": 3, "color": 4}
"""Number of floats of each kind that is a list of fixed size."""
