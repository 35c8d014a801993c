"""Replacement of the map of a layer at run time."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, TypeVar, cast

from flatland.config.inputs import only_files_in
from flatland.entities.layer import Layer
from flatland.errors import WorldError
from flatland.maps.grid_map import grid_map
from flatland.maps.map_file import LayerMap, load_map
from flatland.maps.occupancy_grid import OccupancyGrid

if TYPE_CHECKING:
    from flatland.runtime.contacts import ContactReporter
    from flatland.runtime.observer import Observers
    from flatland.runtime.placement import Placement
    from flatland.world import World

R = TypeVar("R")


class LayerMaps:
    """The part of `World` that replaces maps; a base class of `Contents`."""

    _contacts: ContactReporter
    _observers: Observers
    _placement: Placement

    def set_layer_map(self, layer: str, source: str | os.PathLike[str] | OccupancyGrid) -> None:
        """Replaces the map of a layer and all of its walls, including those that plugins added.

        A model that overlaps the new walls is logged with a warning. Plugins keep no handle of the
        old walls, and bodies wake. `reset` returns to the map of the world file, or, for a layer
        whose map is `topic://…`, to the last grid. A hook of a plugin may call this: it takes
        effect after the step.

        Args:
            layer: A name of the layer.
            source: Map file, absolute or relative to the folder of the world file, subject to
                `model_path`; or a grid, in which cells of at least 65 are occupied, and unknown
                cells are free.

        Raises:
            WorldError: The layer does not exist, or the map does not fit the range of the physics.
            FlatlandError: The map is invalid, or cannot be read. In all cases, the previous map
                remains.
        """
        given = source if isinstance(source, OccupancyGrid) else os.fspath(source)
        self._change(
            "set_layer_map",
            {"name": layer, "source": given},
            lambda: self._replace_map(layer, given),
        )

    def _replace_map(self, name: str, source: str | OccupancyGrid) -> None:
        world = cast("World", self)
        layer = world.layer(name)
        new = _make_layer(world, layer, self._load_layer_map(world, layer, source))
        new.grid = source if isinstance(source, OccupancyGrid) else None
        new.map_version = layer.map_version + 1
        if layer.map_topic:
            world.inputs.cache.grids[layer.name] = new.grid
        old = layer.body
        layer.renew(new)
        self._contacts.add_bodies([layer.body])
        old.physics.destroy()
        with world.requests.hooks():
            self._contacts.dispatch()
        self._contacts.remove_bodies([old])
        world.physics.find_new_contacts()
        self._observers.layer_changed(layer.name)
        for model in world.models:
            for body in model.bodies:
                body.awake = True
            self._placement.warn_if_blocked(model)

    @staticmethod
    def _load_layer_map(world: World, layer: Layer, source: str | OccupancyGrid) -> LayerMap:
        simplify = world.inputs.simplify_map
        if isinstance(source, OccupancyGrid):
            return grid_map(source, simplify)
        if not source:
            raise WorldError(f'failed to set the map of layer "{layer.name}", the path is empty')
        with world.inputs.collecting(), only_files_in(world.model_path):
            return load_map(
                world.resolve_path(source),
                layer.name,
                simplify=simplify,
                params=world.params,
                read=world.read_yaml,
            )

    def _change(
        self, kind: str, arguments: Mapping[str, object], action: Callable[[], R]
    ) -> R | None:
        raise NotImplementedError


def _make_layer(world: World, layer: Layer, layer_map: LayerMap) -> Layer:
    """Returns a layer like another one, with the walls of a map.

    Raises:
        WorldError: The map does not fit the range of the physics; nothing is left behind.
    """
    try:
        new = Layer(
            world.physics,
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
