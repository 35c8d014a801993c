"""Reads a world file into a world."""

from __future__ import annotations

import logging
import math
import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from flatland.config.node import Source
from flatland.config.reader import YamlReader
from flatland.entities.layer import Layer
from flatland.errors import UnreadableFileError, WorldError, YamlError
from flatland.maps.map_file import load_map
from flatland.plugin_api.missing_plugins import (
    MissingPluginsError,
    PluginEntry,
    missing_plugins_error,
    read_entries,
)
from flatland.world import World

_LOG = logging.getLogger("flatland")

LAYER_COLOR = (1.0, 1.0, 1.0, 1.0)
SIMPLIFICATIONS = (0, 1, 2)


def load_world(
    world_class: type[World],
    path: str | os.PathLike[str],
    *,
    params: Mapping[str, object] | Callable[[str], object] | None,
    simplify_map: int,
    **options: Any,
) -> World:
    """Makes a world from a file; see `World.from_yaml`, where the options are explained."""
    if simplify_map not in SIMPLIFICATIONS:
        raise ValueError(f"simplify_map must be 0, 1 or 2, got {simplify_map!r}")
    file = Path(Source("", str(Path.cwd())).resolve(os.fspath(path)))
    reader = YamlReader.from_file(file, params)
    properties = reader.subnode("properties", "map")
    iterations = [
        _at_least_one(properties, "velocity_iterations"),
        _at_least_one(properties, "position_iterations"),
    ]
    properties.ensure_accessed_all()
    world = world_class(
        params=params,
        velocity_iterations=iterations[0],
        position_iterations=iterations[1],
        base_dir=file.parent,
        **options,
    )
    world.path = str(file)
    try:
        for entry in reader.subnode("layers", "list").items():
            _load_layer(world, entry, simplify_map)
        try:
            _load_models(world, reader)
            # Before any plugin sees the world, so that a typing mistake in the file shows first.
            world_plugins = list(reader.optional_subnode("plugins", "list").items())
            reader.ensure_accessed_all()
            world.plugin_host.require_plugins(world_plugins, None)
        except MissingPluginsError as error:
            # Only of the first model that has any; a user wants to see those of all.
            raise _all_missing_plugins(world, reader) or error from None
        for entry in world_plugins:
            _load_world_plugin(world, entry, reader)
    except BaseException:
        world.close()
        raise
    return world


def _at_least_one(reader: YamlReader, key: str) -> int:
    value: int = reader.get(key, "int", 10)
    if value < 1:
        raise reader.error(f'Invalid "{key}" in {reader.name}, must be at least 1, got {value}')
    return value


def _load_layer(world: World, reader: YamlReader, simplify_map: int) -> None:
    name_node = reader.subnode("name")
    if name_node.is_list:
        names = reader.get_list("name", "string", min_size=1)
    else:
        names = [reader.get("name", "string")]
    map_path: str = reader.get("map", "string", "")
    color = reader.get("color", "color", LAYER_COLOR)
    if not all(math.isfinite(number) for number in color):
        raise reader.subnode("color").error(
            f'Invalid "color" in layer "{names[0]}", must be finite, got {list(color)}'
        )
    properties = reader.optional_subnode("properties", "map")
    reader.ensure_accessed_all()
    try:
        world.collision_filter.register(names)
    except YamlError as error:
        raise reader.error(error.message) from None
    bits = world.collision_filter.category_bits(names)
    if not map_path:
        layer = Layer(world.physics, names, bits, color, properties.plain() or {})
    else:
        try:
            layer_map = load_map(
                world.resolve_path(map_path),
                names[0],
                simplify=simplify_map,
                params=world.params,
            )
        except UnreadableFileError as error:
            raise reader.subnode("map").error(error.message) from error
        try:
            layer = Layer(
                world.physics,
                names,
                bits,
                color,
                properties.plain() or {},
                origin=layer_map.origin,
                edges=layer_map.edges,
                exact_edge_count=layer_map.exact_edge_count,
                unknown_map_keys=layer_map.unknown_keys,
            )
        except ValueError as error:  # finite, but beyond what the physics can hold
            raise YamlError(
                f'Invalid map in layer "{names[0]}", {error} [{layer_map.path}]'
            ) from error
    world.add_layer(layer)


def _load_models(world: World, reader: YamlReader) -> None:
    names: set[str] = set()
    for entry in reader.optional_subnode("models", "list").items():
        name = entry.get("name", "string")
        model_reader = entry.with_location(f'model "{name}"')
        pose = model_reader.get("pose", "pose", (0.0, 0.0, 0.0))
        namespace = model_reader.get("namespace", "string", "")
        path = model_reader.get("model", "string")
        model_reader.ensure_accessed_all()
        if name in names:
            raise model_reader.error(f'Model with name "{name}" already exists')
        names.add(name)
        try:
            world.spawn_model(path, name, namespace, pose)
        except WorldError as error:
            # The request itself is wrong, and it stands in this file.
            raise model_reader.error(error.message) from None
        except UnreadableFileError as error:
            raise model_reader.subnode("model").error(error.message) from error


def _all_missing_plugins(world: World, reader: YamlReader) -> MissingPluginsError | None:
    """Makes one error of all missing plugins of a world, without those in faulty files."""
    lists: dict[str, YamlReader] = {}  # of the files of models, which many models may share
    entries: list[PluginEntry] = []
    for model in reader.optional_subnode("models", "list").items():
        with suppress(YamlError):
            name, path = model.get("name", "string"), model.get("model", "string")
            if path not in lists:
                file = YamlReader.from_file(world.resolve_path(path), world.params)
                lists[path] = file.optional_subnode("plugins", "list")
            entries += read_entries(lists[path].items(), name)
    with suppress(YamlError):
        entries += read_entries(reader.optional_subnode("plugins", "list").items(), None)
    return missing_plugins_error(world.plugin_host.registry, entries)


def _load_world_plugin(world: World, entry: YamlReader, world_config: YamlReader) -> None:
    name = entry.get("name", "string")
    if not entry.get("enabled", "bool", True):
        _LOG.info('world plugin "%s" is disabled', name)
        return
    world.plugin_host.start_world_plugin(entry, world_config)
