"""The description of a whole world, for images."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from flatland.errors import WorldError
from flatland.plugins.laser import Laser
from flatland.scene.description import (
    LayerDescription,
    ModelDescription,
    describe_layer,
    describe_model,
)
from flatland.scene.scans import LaserDescription, describe_laser

if TYPE_CHECKING:
    from flatland.world import World


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """What is seen of a world at one time."""

    layers: list[LayerDescription]
    models: list[ModelDescription]
    lasers: list[LaserDescription]


def describe_world(world: World, layers: Iterable[str] | None, scans: bool) -> Scene:
    """Describes what is seen of a world.

    Does not modify the world. Must not be called during a step.

    Args:
        world: The world.
        layers: Names of the layers to include, None for all.
        scans: Whether to include laser scans.

    Raises:
        WorldError: The world is closed, or a layer does not exist.
    """
    if world.closed:
        raise WorldError("the world is closed")
    names = [layer.name for layer in world.layers] if layers is None else layers
    models = world.models
    return Scene(
        layers=[describe_layer(layer) for layer in dict.fromkeys(map(world.layer, names))],
        models=[describe_model(model) for model in models],
        lasers=[
            describe_laser(plugin)
            for model in models
            for plugin in model.plugins
            if scans and isinstance(plugin, Laser)
        ],
    )
