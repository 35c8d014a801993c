"""Creation of a world from its file."""

from __future__ import annotations

import functools
import logging
import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from flatland.config.inputs import Inputs, real_folders
from flatland.config.node import Source
from flatland.config.preprocessor import Params
from flatland.config.reader import ReadYaml, YamlReader
from flatland.entities.layer import Layer
from flatland.errors import Place, UnreadableFileError, WorldError, YamlError
from flatland.geometry import IDENTITY
from flatland.graph_names import resolve_topic
from flatland.loading.materials import read_class, read_material
from flatland.maps.grid_map import grid_map
from flatland.maps.map_file import LayerMap, load_map
from flatland.plugin_api.missing_plugins import (
    MissingPluginsError,
    PluginEntry,
    missing_plugins_error,
    read_entries,
)
from flatland.plugin_api.noise import checked_seed

if TYPE_CHECKING:
    from flatland.maps.occupancy_grid import OccupancyGrid
    from flatland.runtime.body_monitor import InvalidBodyPolicy
    from flatland.runtime.faults import FaultPolicy
    from flatland.runtime.observer import WorldObserver
    from flatland.world import World

_LOG = logging.getLogger("flatland")

TOPIC_SCHEME = "topic://"
"""Begin of the map of a layer that is received from a topic."""
LAYER_COLOR = (1.0, 1.0, 1.0, 1.0)
SIMPLIFICATIONS = (0, 1, 2)
MAX_ITERATIONS = 1000
"""Largest number of velocity or position iterations; more only slow down the simulation."""


def load_world(
    world_class: type[World],
    path: str | os.PathLike[str],
    *,
    seed: int | None,
    params: Params,
    simplify_map: int,
    step_size: float,
    observers: Iterable[WorldObserver],
    plugin_timeout: float | None,
    plugin_errors: FaultPolicy,
    on_invalid_body: InvalidBodyPolicy,
    model_path: Iterable[str | os.PathLike[str]] | None = None,
    read: ReadYaml = YamlReader.from_file,
) -> World:
    """Creates a world of the given class from a file; see `World.from_yaml` for the arguments.

    With a function `read` whose readers collect errors (`flatland.config.collecting_reader`), the
    world contains the valid parts of the files.
    """
    if simplify_map not in SIMPLIFICATIONS:
        raise ValueError(f"simplify_map must be 0, 1 or 2, got {simplify_map!r}")
    folders = real_folders(model_path)
    seed = checked_seed(seed)
    inputs = Inputs(seed, simplify_map)
    with inputs.collecting(caching=True):
        world = _create_world(
            world_class,
            path,
            inputs,
            seed=seed,
            params=params,
            step_size=step_size,
            observers=observers,
            plugin_timeout=plugin_timeout,
            plugin_errors=plugin_errors,
            on_invalid_body=on_invalid_body,
            read=read,
        )
    world.model_path = folders  # The models of the world file are not restricted.
    # A recording can start as long as these are unchanged.
    world.change_count = 0
    inputs.commands_received = world.ports.commands_received()
    return world


def _create_world(
    world_class: type[World],
    path: str | os.PathLike[str],
    inputs: Inputs,
    *,
    params: Params,
    read: ReadYaml,
    **options: Any,
) -> World:
    file = Path(Source("", str(Path.cwd())).resolve(os.fspath(path)))
    reader = read(file, params)
    velocity_iterations, position_iterations, map_layer = _read_properties(reader)
    world = world_class(
        params=params,
        velocity_iterations=velocity_iterations,
        position_iterations=position_iterations,
        base_dir=file.parent,
        **options,
    )
    world.path = str(file)
    world.inputs = inputs
    world.read_yaml = read
    try:
        _load_contents(world, reader, map_layer)
    except BaseException as error:
        # Not `close`: an exception of a plugin must not replace this one.
        world.__exit__(type(error), error, error.__traceback__)
        raise
    return world


def reload_world(world: World, seed: int) -> None:
    """Loads the layers, models and plugins of a world again, which is empty.

    Files and parameters that were read when the world was loaded are not read again.

    Args:
        world: The world; `load_world` made it.
        seed: Seed of all random numbers.

    Raises:
        FlatlandError: With this seed, an expression results in an invalid value, or a plugin fails;
            the world is incomplete.
    """
    inputs = Inputs(seed, world.inputs.simplify_map, cache=world.inputs.cache)
    world.seed, world.inputs = seed, inputs
    with inputs.collecting(caching=True):
        reader = world.read_yaml(world.path, world.params)
        properties = _read_properties(reader)
        world.velocity_iterations, world.position_iterations, map_layer = properties
        _load_contents(world, reader, map_layer)
    world.change_count = 0
    inputs.commands_received = world.ports.commands_received()


def _read_properties(reader: YamlReader) -> tuple[int, int, str]:
    """Returns the iterations of velocities and positions, and the layer of the map topic."""
    properties = reader.subnode("properties", "map")
    velocity_iterations = _read_iterations(properties, "velocity_iterations")
    position_iterations = _read_iterations(properties, "position_iterations")
    map_layer: str = properties.get("publish_map", "string", "")
    properties.ensure_accessed_all()
    return velocity_iterations, position_iterations, map_layer


def _load_contents(world: World, reader: YamlReader, map_layer: str) -> None:
    for entry in reader.subnode("layers", "list").items():
        with entry.collect_errors():
            _load_layer(world, entry, world.inputs.simplify_map)
    if map_layer and not any(map_layer in layer.names for layer in world.layers):
        names = ", ".join(layer.name for layer in world.layers) or "none"
        properties = reader.subnode("properties", "map")
        properties.report(
            properties.invalid(
                "publish_map", f"must be the name of a layer ({names}), got {map_layer}"
            )
        )
        map_layer = ""  # only if errors are collected
    world.map_layer = map_layer
    try:
        _load_models(world, reader)
        # Unknown keys are reported before world plugins are started.
        world_plugins = list(reader.optional_subnode("plugins", "list").items())
        reader.ensure_accessed_all()
        world_plugins = world.plugin_host.require_plugins(world_plugins, None)
    except MissingPluginsError as error:
        # The error lists the missing plugins of one model; report those of the whole world.
        raise _all_missing_plugins(world, reader) or error from None
    for entry in world_plugins:
        with entry.collect_errors():
            _load_world_plugin(world, entry, reader)


def _read_iterations(properties: YamlReader, key: str) -> int:
    return properties.get(key, "int", 10, minimum=1, maximum=MAX_ITERATIONS)


def _load_layer(world: World, reader: YamlReader, simplify_map: int) -> None:
    name_node = reader.subnode("name")
    if name_node.is_list:
        names = reader.get_list("name", "string", min_size=1)
    else:
        names = [reader.get("name", "string")]
    map_path = reader.get("map", "string", "")
    color = reader.get("color", "color", LAYER_COLOR, finite=True)
    properties = reader.optional_subnode("properties", "map")
    material = read_material(reader)
    class_name = read_class(reader, names[0])
    reader.ensure_accessed_all()
    is_registered = False
    with reader.collect_errors():
        _register_layer(world, reader, names)
        is_registered = True
    layer_map, map_topic, grid = None, "", None
    if map_path.startswith(TOPIC_SCHEME):
        map_topic = _map_topic(reader, map_path)
        grid = cast("OccupancyGrid | None", world.inputs.cache.grids.get(names[0]))
        if grid is None:
            _LOG.warning(
                'Layer "%s" is empty until a map is received from topic "%s" or given to '
                "set_layer_map",
                names[0],
                map_topic,
            )
        else:
            layer_map = grid_map(grid, simplify_map)
    elif map_path:
        with reader.collect_errors():
            layer_map = _load_map(world, reader, map_path, names[0], simplify_map)
    if not is_registered:
        return
    bits = world.collision_filter.category_bits(names)
    make_layer = functools.partial(
        Layer,
        world.physics,
        names,
        bits,
        color,
        properties.plain() or {},
        material=material,
        class_name=class_name,
        map_topic=map_topic,
    )
    if layer_map is None:
        layer = make_layer()
    else:
        try:
            layer = make_layer(
                origin=layer_map.origin,
                edges=layer_map.edges,
                exact_edge_count=layer_map.exact_edge_count,
                unknown_map_keys=layer_map.unknown_keys,
                map_path=layer_map.path,
            )
            layer.grid = grid
        except ValueError as error:  # finite, but outside the range of the physics
            raise YamlError(
                f'Invalid map in layer "{names[0]}", {error} [{layer_map.path}]',
                place=Place(layer_map.path),
            ) from error
    world.add_layer(layer)


def _map_topic(reader: YamlReader, map_path: str) -> str:
    """Returns the topic of a map `topic://NAME`.

    Raises:
        YamlError: It is not a legal name, if errors are not collected.
    """
    topic = map_path.removeprefix(TOPIC_SCHEME)
    try:
        return resolve_topic(topic)
    except ValueError as error:
        reader.report(reader.invalid("map", f"{error}, expected {TOPIC_SCHEME}/map"))
        return "/map"  # only if errors are collected


def _register_layer(world: World, reader: YamlReader, names: list[str]) -> None:
    try:
        world.collision_filter.register(names)
    except YamlError as error:
        raise reader.error(error.message) from None


def _load_map(
    world: World, reader: YamlReader, map_path: str, layer_name: str, simplify_map: int
) -> LayerMap:
    try:
        return load_map(
            world.resolve_path(map_path),
            layer_name,
            simplify=simplify_map,
            params=world.params,
            read=world.read_yaml,
        )
    except UnreadableFileError as error:
        raise reader.subnode("map").error(error.message, error.hint) from error


def _load_models(world: World, reader: YamlReader) -> None:
    names: set[str] = set()
    for entry in reader.optional_subnode("models", "list").items():
        with entry.collect_errors():
            _load_model(world, entry, names)


def _load_model(world: World, entry: YamlReader, names: set[str]) -> None:
    name = entry.get("name", "string")
    model_reader = entry.with_location(f'model "{name}"')
    pose = model_reader.get("pose", "pose", IDENTITY, finite=True)
    namespace = model_reader.get("namespace", "string", "")
    path = model_reader.get("model", "string")
    model_reader.ensure_accessed_all()
    if name in names:
        raise model_reader.error(f'Model with name "{name}" already exists')
    names.add(name)
    with model_reader.collect_errors_of_model(name):
        try:
            try:
                world.spawn_model(path, name, namespace, pose)
            except WorldError as error:
                # The entry of the world file is invalid, not the model file.
                model_reader.report(model_reader.error(error.message))
                with suppress(WorldError):  # only if errors are collected
                    world.spawn_model(path, name, "", pose)
        except UnreadableFileError as error:
            located = model_reader.subnode("model")
            raise located.error(error.message, error.hint) from error


def _all_missing_plugins(world: World, reader: YamlReader) -> MissingPluginsError | None:
    """Returns one error for all missing plugins of a world, except those in invalid files."""
    lists: dict[str, YamlReader] = {}  # plugins by model file, which many models may share
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
