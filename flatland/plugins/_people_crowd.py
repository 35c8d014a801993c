"""The crowd of the plugin Pedestrians, created from its parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from flatland.config.hints import did_you_mean
from flatland.plugin_api.parameters import at_key, read_choice, read_positive
from flatland.plugins._people_config import (
    MODELS,
    ORCA,
    SOCIAL_FORCE,
    read_numbers,
)
from flatland.plugins._people_places import CLEARANCE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from flatland.config.reader import YamlReader
    from flatland.physics import Crowd
    from flatland.plugins._people_config import Group, Legs


def read_bits(
    config: YamlReader, world: Any, layers: list[str], legs: Legs | None, body_type: str
) -> int:
    """Returns the bits of all layers in which people are.

    Args:
        config: Parameters of the plugin, for errors.
        world: The world of the plugin.
        layers: Layers of the bodies.
        legs: The legs, None for people without legs.
        body_type: Type of the bodies.

    Raises:
        YamlError: A layer does not exist, or the layers do not suit the legs or the bodies.
    """
    known = world.collision_filter
    leg_layers = [] if legs is None else legs.layers
    for key, names in (("layers", layers), ("legs", leg_layers)):
        unknown = known.unknown(names)
        if unknown:
            raise at_key(config, key).error(
                f'Invalid "{key}", {{{",".join(unknown)}}} layer(s) does not exist',
                did_you_mean(unknown[0], known.names, "layers of the world"),
            )
    body_bits: int = known.category_bits(layers) if layers else 0
    leg_bits: int = known.category_bits(leg_layers) if leg_layers else 0
    if body_bits & leg_bits:
        raise at_key(config, "legs").error(
            'Invalid "legs", bodies and legs must not be in the same layer: lasers would '
            "detect the bodies instead of the legs"
        )
    if body_type == "dynamic" and not body_bits:
        raise at_key(config, "body_type").error(
            'Invalid "body_type", dynamic people with legs require "layers", in which their '
            "bodies collide"
        )
    return body_bits | leg_bits


def create_crowd(
    config: YamlReader,
    world: Any,
    groups: Sequence[Group],
    legs: Legs | None,
    *,
    bits: int,
    is_dynamic: bool,
    key: int,
) -> Crowd:
    """Creates a crowd without people.

    Args:
        config: Parameters of the plugin.
        world: The world of the plugin.
        groups: All groups.
        legs: The legs, None for people without legs.
        bits: Bits of the layers in which people are.
        is_dynamic: Whether the bodies are dynamic.
        key: A 64-bit integer from which all random numbers of the crowd derive.

    Raises:
        YamlError: A parameter is invalid.
    """
    model = read_choice(config, "model", MODELS)
    rate = read_positive(config, "update_rate", 20.0)
    numbers = read_numbers(config, "social_force", SOCIAL_FORCE) | read_numbers(
        config, "orca", ORCA
    )
    numbers["sight"] = read_positive(config, "sight", 4.0)
    numbers["fluctuation"] = config.get("fluctuation", "float", 0.1, finite=True, minimum=0)
    numbers["cell"] = read_positive(config, "cell", 0.1)
    numbers["clearance"] = max(group.radius for group in groups) + CLEARANCE
    if legs is not None:
        numbers["leg_radius"] = legs.radius
        numbers["leg_spacing"] = legs.spacing
    crowd: Crowd = world.physics.add_crowd(
        is_orca=model == "orca",
        is_dynamic=is_dynamic,
        bits=bits,
        interval=max(1, round(1.0 / (rate * world.timekeeper.step_size))),
        key=key,
        numbers=numbers,
    )
    return crowd
