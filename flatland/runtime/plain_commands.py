"""Commands given as plain values, as in YAML files and on command lines."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from flatland.errors import FlatlandError

if TYPE_CHECKING:
    from flatland.world import World


def set_command(world: World, topic: str, value: Any) -> None:
    """Sets a command.

    Args:
        world: The world.
        topic: Resolved topic.
        value: Value of the type of the topic; for a dataclass such as `Twist` a dictionary with
            the names of its fields, where `{linear: {x: 1}}` is the same as `{linear_x: 1}`.

    Raises:
        FlatlandError: The topic does not exist, or the value has another form.
    """
    command = world.command(topic)
    kind = command.value_type
    if dataclasses.is_dataclass(kind) and isinstance(value, Mapping):
        names = [field.name for field in dataclasses.fields(kind)]
        fields = dict(_flat(value))
        wrong = [name for name in fields if name not in names]
        numbers = [name for name, part in fields.items() if isinstance(part, int | float)]
        if wrong or len(numbers) < len(fields):
            got = ", ".join(wrong) or f"{fields}"
            raise FlatlandError(
                f'command "{topic}": the fields of {kind.__name__} are the numbers '
                f"{', '.join(names)}, got {got}"
            )
        value = kind(**{name: float(part) for name, part in fields.items()})
    elif kind is float and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    try:
        command.set(value)
    except TypeError as error:
        raise FlatlandError(str(error)) from None


def _flat(value: Mapping[Any, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Iterates over nested dictionaries, with the keys joined by underscores."""
    for key, part in value.items():
        if isinstance(part, Mapping):
            yield from _flat(part, f"{prefix}{key}_")
        else:
            yield f"{prefix}{key}", part
