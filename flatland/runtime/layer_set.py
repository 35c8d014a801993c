"""The layers of a world, and the replacement of their maps."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TYPE_CHECKING

from flatland.checks import plain_path
from flatland.entities.layer import Layer
from flatland.errors import WorldError
from flatland.maps.map_file import LayerMap
from flatland.suggestions import did_you_mean
from flatland.values import OccupancyGrid

if TYPE_CHECKING:
    from flatland.loading.world_source import WorldSource
    from flatland.physics import PhysicsWorld
    from flatland.runtime.changes import Changes
    from flatland.runtime.contacts import ContactReporter
    from flatland.runtime.observer import Observers
    from flatland.runtime.requests import Requests


class LayerSet:
    """The layers of one world.

    Attributes:
        all: The layers in the order of the file.
    """

    def __init__(
        self,
        source: WorldSource,
        physics: PhysicsWorld,
        contacts: ContactReporter,
        observers: Observers,
        requests: Requests,
        changes: Changes,
        on_new_walls: Callable[[], None],
    ) -> None:
        """Creates an empty set.

        Args:
            source: Finds and reads map files.
            physics: Contains the walls.
            contacts: Reports the contacts of the walls.
            observers: Notified of layers whose edges changed.
            requests: Notified while plugins react to ended contacts.
            changes: Carries out the changes.
            on_new_walls: Called after the map of a layer was replaced.
        """
        self.all: list[Layer] = []
        # Layers that a reset removed. A layer that is loaded again remains the same object.
        self._former: dict[str, Layer] = {}
        self._source = source
        self._physics = physics
        self._contacts = contacts
        self._observers = observers
        self._requests = requests
        self._changes = changes
        self._on_new_walls = on_new_walls

    def __getstate__(self) -> tuple[Layer, ...]:
        """Returns the part of the state of the world that a snapshot saves."""
        return tuple(self.all)

    def __setstate__(self, layers: tuple[Layer, ...]) -> None:
        """Restores a saved state."""
        self.all[:] = layers

    def find(self, name: str) -> Layer:
        """Returns the layer that has a name, possibly among others.

        Raises:
            WorldError: The layer does not exist.
        """
        for layer in self.all:
            if name in layer.names:
                return layer
        hint = did_you_mean(
            name, (each for layer in self.all for each in layer.names), "layers of the world"
        )
        raise WorldError(f'layer with name "{name}" does not exist', hint=hint)

    def add(self, layer: Layer) -> None:
        """Adds a layer whose names are registered."""
        former = self._former.pop(layer.name, None)
        if former is not None:
            former.renew(layer)
            layer = former
        self.all.append(layer)
        self._contacts.add_bodies([layer.body])
        self._observers.layer_changed(layer.name)

    def clear(self) -> None:
        """Removes all layers; layers that are added later with the same names are the same."""
        self._former.update({layer.name: layer for layer in self.all})
        self.all.clear()

    def forget_former(self) -> None:
        """Ends the replacement of new layers by removed ones."""
        self._former.clear()

    def set_map(self, layer: str, source: str | os.PathLike[str] | OccupancyGrid) -> None:
        """Replaces the map of a layer; see `World.set_layer_map`."""
        given = source if isinstance(source, OccupancyGrid) else plain_path("source", source)
        arguments = {"name": layer, "source": given}
        self._changes.make("set_layer_map", arguments, lambda: self._set_map(layer, given))

    def _set_map(self, name: str, source: str | OccupancyGrid) -> None:
        layer = self.find(name)
        new = _make_layer(self._physics, layer, self._load(layer, source))
        new.grid = source if isinstance(source, OccupancyGrid) else None
        new.map_version = layer.map_version + 1
        if layer.map_topic:
            self._source.grids[layer.name] = new.grid
        old = layer.body
        layer.renew(new)
        self._contacts.add_bodies([layer.body])
        old.physics.destroy()
        with self._requests.hooks():
            self._contacts.dispatch()
        self._contacts.remove_bodies([old])
        self._physics.find_new_contacts()
        self._observers.layer_changed(layer.name)
        self._on_new_walls()

    def _load(self, layer: Layer, source: str | OccupancyGrid) -> LayerMap:
        if isinstance(source, OccupancyGrid):
            return self._source.grid_map(source)
        if not source:
            raise WorldError(f'failed to set the map of layer "{layer.name}", the path is empty')
        return self._source.load_map(source, layer.name)


def _make_layer(physics: PhysicsWorld, layer: Layer, layer_map: LayerMap) -> Layer:
    """Returns a layer like another one, with the walls of a map.

    Raises:
        WorldError: The map does not fit the range of the physics; nothing is left behind.
    """
    try:
        new = Layer(
            physics,
            layer.names,
            layer.category_bits,
            layer.color,
            layer.properties,
            material=layer.material,
            class_name=layer.class_name,
            origin=layer_map.origin,
            exact_edge_count=layer_map.exact_edge_count,
            unknown_map_keys=layer_map.unknown_keys,
            map_path=layer_map.path,
            map_topic=layer.map_topic,
        )
    except ValueError as error:
        raise _out_of_range(layer, error) from error
    try:
        if len(layer_map.edges):
            new.add_edges(layer_map.edges)
    except BaseException as error:
        new.body.physics.destroy()
        if isinstance(error, ValueError):
            raise _out_of_range(layer, error) from error
        raise
    return new


def _out_of_range(layer: Layer, error: ValueError) -> WorldError:
    return WorldError(f'failed to set the map of layer "{layer.name}", {error}')
