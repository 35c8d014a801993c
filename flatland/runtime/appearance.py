"""The appearance of models: colours, layers, visibility."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from flatland import checks
from flatland.config.hints import did_you_mean
from flatland.errors import WorldError

if TYPE_CHECKING:
    from flatland.entities.body import Body, Color
    from flatland.entities.collision_filter import CollisionFilter
    from flatland.entities.model import Model


def appearance_of(model: Model) -> list[tuple[Color, bool]]:
    """Returns what drawings show of the bodies of a model, apart from their footprints."""
    return [(body.color, body.visible) for body in model.bodies]


def find_bodies(model: Model, name: str) -> list[Body]:
    """Returns the body of a name, all bodies for an empty name.

    Raises:
        WorldError: The body does not exist.
    """
    if not name:
        return model.bodies
    body = model.find_body(name)
    if body is None:
        names = [each.name for each in model.bodies]
        hint = did_you_mean(name, names, "bodies of the model")
        raise WorldError(f'body with name "{name}" does not exist', hint=hint)
    return [body]


def plain_numbers(color: Sequence[float]) -> tuple[float, ...] | str:
    """Returns a colour as plain numbers if it is one; an invalid one is rejected later."""
    numbers = checks.plain_numbers(color, (3, 4))
    return checks.shown(color) if numbers is None else numbers


def checked_color(color: tuple[float, ...] | str) -> tuple[float, ...]:
    """Returns a colour if it is valid.

    Raises:
        WorldError: The colour is invalid.
    """
    if isinstance(color, tuple) and len(color) in (3, 4) and all(0 <= c <= 1 for c in color):
        return color
    shown = list(color) if isinstance(color, tuple) else color
    raise WorldError(f"color must be [r, g, b] or [r, g, b, a], each from 0 to 1, got {shown}")


def new_color(old: Color, new: Sequence[float]) -> Color:
    """Returns a new colour, with the opacity of the old one if it has three numbers."""
    r, g, b = new[:3]
    return (r, g, b, new[3] if len(new) == 4 else old[3])


def layer_bits(known: CollisionFilter, names: list[str]) -> int:
    """Returns the category bits of names of layers.

    Raises:
        WorldError: The list is empty, or a layer does not exist.
    """
    if not names:
        raise WorldError("layers must contain at least one name")
    unknown = known.unknown(names)
    if unknown:
        hint = did_you_mean(unknown[0], known.names, "layers of the world")
        raise WorldError(f"{{{','.join(unknown)}}} layer(s) does not exist", hint=hint)
    return known.category_bits(names)


def set_layers(bodies: Iterable[Body], bits: int) -> None:
    """Changes the layers of the footprints of bodies.

    Footprints that are only drawn, such as wheels, remain without layers, and footprints with
    `collision: false` keep their mask without bits.
    """
    for body in bodies:
        for fixture in body.fixtures:
            category, mask = fixture.category_bits, fixture.mask_bits
            fixture.category_bits = bits if category else 0
            fixture.mask_bits = bits if mask else 0
