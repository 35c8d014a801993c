"""Changes of the appearance of models at run time: colours, layers, visibility."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, TypeVar, cast

from flatland.config.hints import did_you_mean
from flatland.errors import WorldError

if TYPE_CHECKING:
    from flatland.entities.body import Body, Color
    from flatland.entities.model import Model
    from flatland.runtime.model_set import ModelSet
    from flatland.runtime.observer import Observers
    from flatland.runtime.placement import Placement
    from flatland.world import World

R = TypeVar("R")


class Appearance:
    """The part of `World` that changes the appearance of models; a base class of `Contents`."""

    _models: ModelSet
    _observers: Observers
    _placement: Placement

    def set_appearance(
        self,
        model: str,
        body: str = "",
        *,
        color: Sequence[float] | None = None,
        layers: str | Iterable[str] | None = None,
        visible: bool | None = None,
    ) -> None:
        """Changes the colour, layers and visibility of bodies of a model: all, or nothing.

        New layers change what the footprints collide with, and which lasers detect them. Footprints
        that have no layers (`layers: []`) or collide with nothing (`collision: false`) remain so. A
        model that then overlaps walls or other models is logged with a warning, and all bodies
        wake. `visible` affects only markers and drawings. `reset` returns to the appearance in the
        model file. A hook of a plugin may call this: it takes effect after the step.

        Args:
            model: Name of the model.
            body: Name of the body; empty for all bodies of the model.
            color: (r, g, b) or (r, g, b, a), each from 0 to 1; three numbers keep the opacity, None
                keeps the colour.
            layers: Name or names of the layers of all footprints of the body, at least one; the
                single name `all` stands for all layers, None keeps them.
            visible: Whether the body is drawn; None for no change.

        Raises:
            WorldError: The model, the body or a layer does not exist, or the colour is invalid;
                the world is unchanged.
        """
        names = [layers] if isinstance(layers, str) else None if layers is None else list(layers)
        numbers = None if color is None else _plain_numbers(color)
        shown = None if visible is None else bool(visible)
        self._change(
            "set_appearance",
            {"model": model, "body": body, "color": numbers, "layers": names, "visible": shown},
            lambda: self._set_appearance(model, body, numbers, names, shown),
        )

    def _set_appearance(
        self,
        name: str,
        body_name: str,
        color: tuple[float, ...] | str | None,
        layers: list[str] | None,
        visible: bool | None,
    ) -> None:
        model = self._models.find_to("change the appearance of", name)
        try:
            bodies = _find_bodies(model, body_name)
            painted = None if color is None else _checked_color(color)
            bits = None if layers is None else self._layer_bits(layers)
        except WorldError as error:
            text = f'failed to change the appearance of model "{name}", {error.message}'
            raise WorldError(text, hint=error.hint) from None
        for body in bodies:
            if painted is not None:
                body.color = _new_color(body.color, painted)
            if visible is not None:
                body.visible = visible
        if bits is not None:
            self._set_layers(model, bodies, bits)
        self._observers.model_changed(model)

    def _layer_bits(self, names: list[str]) -> int:
        known = cast("World", self).collision_filter
        if not names:
            raise WorldError("layers must contain at least one name")
        unknown = known.unknown(names)
        if unknown:
            similar = did_you_mean(unknown[0], known.names)
            hint = similar or f"layers of the world: {', '.join(known.names) or 'none'}"
            raise WorldError(f"{{{','.join(unknown)}}} layer(s) does not exist", hint=hint)
        return known.category_bits(names)

    def _set_layers(self, model: Model, bodies: Iterable[Body], bits: int) -> None:
        for body in bodies:
            for fixture in body.fixtures:
                category, mask = fixture.category_bits, fixture.mask_bits
                # Wheels and the like, which are only drawn, have no layers; a mask without bits is
                # that of `collision: false`.
                fixture.category_bits = bits if category else 0
                fixture.mask_bits = bits if mask else 0
        world = cast("World", self)
        world.physics.find_new_contacts()
        # A body that rested on the model, or that the model now overlaps, may be asleep.
        for other in world.models:
            for body in other.bodies:
                body.awake = True
        self._placement.warn_if_blocked(model)

    def _change(
        self, kind: str, arguments: Mapping[str, object], action: Callable[[], R]
    ) -> R | None:
        raise NotImplementedError


def appearance_of(model: Model) -> list[tuple[Color, bool]]:
    """Returns what drawings show of the bodies of a model, apart from their footprints."""
    return [(body.color, body.visible) for body in model.bodies]


def _find_bodies(model: Model, name: str) -> list[Body]:
    if not name:
        return model.bodies
    body = model.find_body(name)
    if body is None:
        names = [each.name for each in model.bodies]
        hint = did_you_mean(name, names) or f"bodies of the model: {', '.join(names)}"
        raise WorldError(f'body with name "{name}" does not exist', hint=hint)
    return [body]


def _plain_numbers(color: Sequence[float]) -> tuple[float, ...] | str:
    """Returns a colour as plain numbers if it is one; an invalid one is rejected later."""
    try:
        return tuple(float(number) for number in color)
    except (TypeError, ValueError):
        return repr(color)


def _checked_color(color: tuple[float, ...] | str) -> tuple[float, ...]:
    if isinstance(color, tuple) and len(color) in (3, 4) and all(0 <= c <= 1 for c in color):
        return color
    shown = list(color) if isinstance(color, tuple) else color
    raise WorldError(f"color must be [r, g, b] or [r, g, b, a], each from 0 to 1, got {shown}")


def _new_color(old: Color, new: Sequence[float]) -> Color:
    r, g, b = new[:3]
    return (r, g, b, new[3] if len(new) == 4 else old[3])
