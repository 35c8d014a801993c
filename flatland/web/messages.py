"""Messages of clients: parsing, and complete checks of all fields."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from flatland.geometry import MAX_MAGNITUDE, Pose

MAX_SIZE: Final = 16 * 1024  # bytes of a message
MAX_NAME: Final = 200  # characters of the name of a topic
MAX_PATH: Final = 4096  # characters of the path of a file
MAX_STEPS: Final = 10_000
MAX_SERIES: Final = 64
MAX_TOPICS: Final = 64  # topics of other programs that a client draws
MAX_INSPECTED_TOPICS: Final = 32
MAX_RATE: Final = 1e6  # Hz


class MessageError(Exception):
    """A message is malformed."""


@dataclass(frozen=True, slots=True)
class Message:
    """A message of a client.

    Attributes:
        id: Number that the reply repeats, None if the client has sent none.
        type: Type of the request.
        world: Index of the world.
        fields: The other fields by name, with values of the required types.
    """

    id: int | None
    type: str
    world: int
    fields: Mapping[str, Any]


Check = Callable[[object], Any]


def _text(limit: int) -> Check:
    def check(value: object) -> str:
        if not isinstance(value, str) or not 0 < len(value) <= limit:
            raise ValueError(f"a text of at most {limit} characters")
        if any(ord(c) < 32 or 0xD800 <= ord(c) < 0xE000 for c in value):
            raise ValueError("a text without control characters")
        return value

    return check


def _any_text(value: object) -> str:
    """Returns a text, which a request checks itself."""
    if not isinstance(value, str):
        raise ValueError("a text")
    return value


def _number(low: float, high: float) -> Check:
    def check(value: object) -> float:
        # Compared before the conversion, because the conversion of a large integer raises.
        if (
            isinstance(value, bool)
            or not isinstance(value, int | float)
            or not low <= value <= high
        ):
            raise ValueError(f"a number from {low:g} to {high:g}")
        return float(value)

    return check


def _integer(low: int, high: int) -> Check:
    def check(value: object) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise ValueError(f"an integer from {low} to {high}")
        return value

    return check


def _boolean(value: object) -> bool:
    if not isinstance(value, bool):
        raise ValueError("true or false")
    return value


def _list(item: Check, low: int, high: int) -> Check:
    def check(value: object) -> tuple[Any, ...]:
        if not isinstance(value, list) or not low <= len(value) <= high:
            raise ValueError(f"a list of {low} to {high} items")
        return tuple(item(part) for part in value)

    return check


def _pose(value: object) -> Pose:
    try:
        x, y, theta = _list(_number(-MAX_MAGNITUDE, MAX_MAGNITUDE), 3, 3)(value)
    except ValueError:
        raise ValueError(f"[x, y, theta], each within +-{MAX_MAGNITUDE:g}") from None
    return (x, y, math.remainder(theta, math.tau))


def _optional(check: Check) -> Check:
    return lambda value: None if value is None else check(value)


def _choice(*choices: str) -> Check:
    def check(value: object) -> str:
        if value not in choices:
            raise ValueError(" or ".join(choices))
        return str(value)

    return check


_ID: Final = _integer(0, 2**32 - 1)
_INDEX: Final = _integer(0, 2**16 - 1)
_SPEED: Final = _number(-1e6, 1e6)
_MODEL: Final = ("model", _ID)

# Required and optional fields of each type of message, in addition to `id`, `type` and `world`.
_FIELDS: Final[dict[str, tuple[dict[str, Check], dict[str, Check]]]] = {
    "look": (
        {},
        {
            "worlds": _list(_INDEX, 0, 1024),
            "scans": _boolean,
            "compact_scans": _boolean,
            "frames": _boolean,
            "inspect": _optional(_ID),
            "series": _list(_text(MAX_PATH), 0, MAX_SERIES),
            "topics": _optional(_list(_text(MAX_NAME), 0, MAX_TOPICS)),
            "topic_values": _list(_text(MAX_NAME), 0, MAX_INSPECTED_TOPICS),
            "hidden": _boolean,
            "history": _boolean,
        },
    ),
    "pause": ({}, {}),
    "resume": ({}, {}),
    "step": ({}, {"n": _integer(1, MAX_STEPS)}),
    "set_rate": ({"rate": _number(0, MAX_RATE)}, {}),
    "move": (dict([_MODEL, ("pose", _pose)]), {}),
    "hold": (dict([_MODEL]), {}),
    "release": (dict([_MODEL]), {}),
    "spawn": (
        {"file": _text(MAX_PATH), "name": _any_text, "pose": _pose},
        {"namespace": _any_text},
    ),
    "preview": ({"file": _text(MAX_PATH)}, {}),
    "delete": (dict([_MODEL]), {}),
    "reset": ({}, {}),
    "visit": ({"moment": _ID}, {}),
    "save": ({}, {}),
    "undo": ({}, {}),
    "redo": ({}, {}),
    "drive": (
        dict([_MODEL]),
        {"command": _text(MAX_PATH), "linear": _list(_SPEED, 2, 2), "angular": _SPEED},
    ),
    "files": ({}, {}),
    "describe_series": ({}, {}),
    "publish_pose": (
        {
            "purpose": _choice("goal", "initial_pose"),
            "topic": _text(MAX_NAME),
            "pose": _pose,
        },
        {},
    ),
}
READ_ONLY_TYPES: Final = frozenset({"look", "preview", "files", "describe_series"})


def parse(text: str) -> Message:
    """Returns the message in a text.

    Raises:
        MessageError: The text is not a JSON object, its type is unknown, or a field is missing,
            unknown or invalid.
    """
    try:
        values = json.loads(text, parse_constant=_refuse)
    except (ValueError, RecursionError):
        raise MessageError("not JSON") from None
    if not isinstance(values, dict):
        raise MessageError("not a JSON object")
    kind = values.pop("type", None)
    if not isinstance(kind, str) or kind not in _FIELDS:
        raise MessageError("unknown type")
    required, optional = _FIELDS[kind]
    number = _checked(kind, "id", values.pop("id", None), _optional(_integer(0, 2**53)))
    world = _checked(kind, "world", values.pop("world", 0), _INDEX)
    missing = [name for name in required if name not in values]
    if missing:
        raise MessageError(f"{kind}: {missing[0]} is missing")
    checks = {**required, **optional}
    unknown = [name for name in values if name not in checks]
    if unknown:
        raise MessageError(f"{kind}: unknown field {unknown[0][:40]!r}")
    fields = {name: _checked(kind, name, value, checks[name]) for name, value in values.items()}
    return Message(number, kind, world, fields)


def _checked(kind: str, name: str, value: object, check: Check) -> Any:
    try:
        return check(value)
    except ValueError as error:
        raise MessageError(f"{kind}: {name} must be {error}") from None


def _refuse(constant: str) -> object:
    raise ValueError(constant)
