"""Creation of a world from its file."""

from __future__ import annotations

import functools
import logging
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeVar

import numpy as np

from flatland.config.file_kinds import unreadable_file
from flatland.config.reader import YamlReader, read_yaml
from flatland.entities.layer import Layer
from flatland.errors import Place, UnreadableFileError, WorldError, YamlError
from flatland.geometry import IDENTITY
from flatland.graph_names import check_model_name, resolve_topic
from flatland.loading.materials import read_class, read_color, read_material
from flatland.loading.world_source import WorldSource
from flatland.maps.map_file import LayerMap
from flatland.plugin_api.missing_plugins import (
    MissingPluginsError,
    PluginEntry,
    read_entries,
)
from flatland.plugin_api.noise import checked_seed
from flatland.plugin_api.plugin_world import JobOwner, PluginWorld

if TYPE_CHECKING:
    from flatland.plugin_api.registry import PluginRegistry

_LOG = logging.getLogger("flatland")

TOPIC_SCHEME = "topic://"
"""Begin of the map of a layer that is received from a topic."""
_MIN_KEPT = 0.99  # share of the length of all walls, below which a warning is logged
_MAX_ROUNDING = 0.002  # m, of coordinates: less than the tolerance of collisions, 0.005 m
MAX_MAGNITUDE = 1e9
"""Largest absolute value of a coordinate [m] or an angle [rad] of the physics."""
_PROGRESS_PERIOD: Final = 5.0  # s between two messages about the models that are loaded
LAYER_COLOR = (1.0, 1.0, 1.0, 1.0)
MAX_ITERATIONS = 1000
"""Largest number of velocity or position iterations; more only slow down the simulation."""


class PluginLoader(JobOwner, Protocol):
    """Starts the plugins of a world."""

    registry: PluginRegistry

    def require_plugins(self, entries: Iterable[YamlReader], model: str | None) -> list[YamlReader]:
        """Checks that a plugin class exists for each enabled entry of a `plugins` list."""

    def start_world_plugin(self, entry: YamlReader, world_config: YamlReader) -> None:
        """Starts a world plugin."""


class LoadedWorld(PluginWorld, Protocol):
    """The part of `flatland.World` that its file determines."""

    source: WorldSource
    seed: int
    velocity_iterations: int
    position_iterations: int
    change_count: int

    @property
    def plugin_host(self) -> PluginLoader:
        """Starts the plugins."""

    def add_layer(self, layer: Layer) -> None:
        """Adds a layer whose names are registered."""

    def resolve_path(self, path: str) -> str:
        """Returns the absolute path of a model or map file."""

    def __exit__(self, *error: object) -> None:
        """Closes the world; exceptions of the block take precedence over exceptions of plugins."""


W = TypeVar("W", bound=LoadedWorld)


def load_world(
    make_world: Callable[..., W], source: WorldSource, *, seed: int | None, **options: Any
) -> W:
    """Creates a world from its file.

    If the readers of the source collect errors (`flatland.config.collecting_reader`), the world
    contains the valid parts of the files.

    Args:
        make_world: Class of the world.
        source: The world file.
        seed: Seed of all random numbers, at least 0; None draws a seed and logs it.
        **options: Further arguments of the constructor of the class.

    Raises:
        FlatlandError: A file is invalid; nothing is left behind.
        ValueError: An argument is out of range.
    """
    seed = checked_seed(seed)
    with source.inputs.loading():
        source.inputs.set_seed(seed)
        reader = source.read(source.path)
        reader.require_kind("world")
        velocity_iterations, position_iterations, map_layer = _read_properties(reader)
        world = make_world(
            source=source,
            seed=seed,
            velocity_iterations=velocity_iterations,
            position_iterations=position_iterations,
            **options,
        )
        try:
            _load_contents(world, reader, map_layer)
        except BaseException as error:
            # Not `close`: an exception of a plugin must not replace this one.
            world.__exit__(type(error), error, error.__traceback__)
            raise
    return world


def reload_world(world: LoadedWorld, seed: int) -> None:
    """Loads the layers, models and plugins of a world again, which is empty.

    Files and parameters that were read when the world was loaded are not read again.

    Args:
        world: The world; `load_world` made it.
        seed: Seed of all random numbers.

    Raises:
        FlatlandError: With this seed, an expression results in an invalid value, or a plugin fails;
            the world is incomplete.
    """
    source = world.source
    world.seed = seed
    with source.inputs.loading():
        source.inputs.set_seed(seed)
        reader = source.read(source.path)
        properties = _read_properties(reader)
        world.velocity_iterations, world.position_iterations, map_layer = properties
        _load_contents(world, reader, map_layer)


def _read_properties(reader: YamlReader) -> tuple[int, int, str]:
    """Returns the iterations of velocities and positions, and the layer of the map topic."""
    properties = reader.subnode("properties", "map")
    velocity_iterations = _read_iterations(properties, "velocity_iterations")
    position_iterations = _read_iterations(properties, "position_iterations")
    map_layer: str = properties.get("publish_map", "string", "")
    properties.ensure_accessed_all()
    return velocity_iterations, position_iterations, map_layer


def _load_contents(world: LoadedWorld, reader: YamlReader, map_layer: str) -> None:
    layers = list(reader.subnode("layers", "list").items())
    for entry in layers:
        with entry.collect_errors():
            _load_layer(world, entry)
    # Otherwise, a name in another file may be that of an invalid layer.
    world.collision_filter.is_complete = all(entry.is_complete for entry in (reader, *layers))
    if map_layer and not any(map_layer in layer.names for layer in world.layers):
        names = ", ".join(layer.name for layer in world.layers) or "none"
        properties = reader.subnode("properties", "map")
        properties.report(
            properties.invalid(
                "publish_map", f"must be the name of a layer ({names}), got {map_layer}"
            )
        )
        map_layer = ""  # only if errors are collected
    world.source.map_layer = map_layer
    try:
        _load_models(world, reader)
        # Unknown keys are reported before world plugins are started.
        world_plugins = list(reader.optional_subnode("plugins", "list").items())
        reader.ensure_accessed_all()
        world_plugins = world.plugin_host.require_plugins(world_plugins, None)
    except MissingPluginsError as error:
        # The error lists the missing plugins of one model; report all that the world misses.
        raise _all_missing_plugins(world, reader) or error from None
    for entry in world_plugins:
        with entry.collect_errors():
            _load_world_plugin(world, entry, reader)
    # Otherwise part of the first step, which would take too long for a loop in real time.
    world.physics.find_new_contacts()
    # A recording can start as long as these are unchanged.
    world.change_count = 0
    world.source.commands_received = world.ports.commands_received()


def _read_iterations(properties: YamlReader, key: str) -> int:
    return properties.get(key, "int", 10, minimum=1, maximum=MAX_ITERATIONS)


def _load_layer(world: LoadedWorld, reader: YamlReader) -> None:
    name_node = reader.subnode("name")
    if name_node.is_list:
        names = reader.get_list("name", "string", min_size=1)
    else:
        names = [reader.get("name", "string")]
    map_path = reader.get("map", "string", "")
    color = read_color(reader, LAYER_COLOR)
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
        grid = world.source.grids.get(names[0])
        if grid is None:
            _LOG.warning(
                'Layer "%s" is empty until a map is received from topic "%s" or given to '
                "set_layer_map",
                names[0],
                map_topic,
            )
        else:
            layer_map = world.source.grid_map(grid)
    elif map_path:
        with reader.collect_errors():
            layer_map = _load_map(world.source, reader, map_path, names[0])
    if not is_registered:  # only if errors are collected
        for name in world.collision_filter.unknown(names):
            with suppress(YamlError):
                world.collision_filter.register([name])
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
    if layer_map is not None and layer_map.path:
        _warn_about_short_edges(world.source, layer, layer_map)
    if layer_map is not None:
        _warn_about_far_walls(world.source, layer, layer_map)
    world.add_layer(layer)


def _warn_about_short_edges(source: WorldSource, layer: Layer, layer_map: LayerMap) -> None:
    """Logs if a considerable part of the walls is missing, because edges are too short."""
    lengths = [
        np.hypot(edges[:, 2] - edges[:, 0], edges[:, 3] - edges[:, 1]).sum()
        for edges in (layer.edges.astype(np.float64), layer_map.edges.astype(np.float64))
    ]
    if lengths[0] < _MIN_KEPT * lengths[1]:
        source.inputs.warn(
            layer_map.scale_place,
            'Layer "%s": %d of %d edges are missing, because they are too short for the physics; '
            "the unit of the map may be wrong",
            layer.name,
            len(layer_map.edges) - len(layer.edges),
            len(layer_map.edges),
        )


def _warn_about_far_walls(source: WorldSource, layer: Layer, layer_map: LayerMap) -> None:
    """Logs if coordinates are so large that they are rounded by a length that matters."""
    x, y, _ = layer_map.origin
    farthest = max(abs(x), abs(y), float(np.abs(layer.edges).max(initial=0.0)))
    step = float(np.spacing(np.float32(farthest)))
    if step > _MAX_ROUNDING:
        source.inputs.warn(
            Place(layer_map.path),
            'Layer "%s": coordinates of %.9g m are rounded to multiples of %.3g m, since the '
            "physics computes in single precision, so that walls and robots are displaced",
            layer.name,
            farthest,
            step,
            hint="subtract a common offset, such as that of a UTM zone, from the origins of all "
            "maps and the poses of all models, so that they are near (0, 0)",
        )


def _map_topic(reader: YamlReader, map_path: str) -> str:
    """Returns the topic of a map `topic://NAME`.

    Raises:
        YamlError: The name is invalid, if errors are not collected.
    """
    topic = map_path.removeprefix(TOPIC_SCHEME)
    try:
        return resolve_topic(topic)
    except ValueError as error:
        reader.report(reader.invalid("map", f"{error}, expected {TOPIC_SCHEME}/map"))
        return "/map"  # only if errors are collected


def _register_layer(world: LoadedWorld, reader: YamlReader, names: list[str]) -> None:
    try:
        world.collision_filter.register(names)
    except YamlError as error:
        raise reader.error(error.message) from None


def _load_map(source: WorldSource, reader: YamlReader, map_path: str, layer_name: str) -> LayerMap:
    try:
        return source.load_map(map_path, layer_name)
    except UnreadableFileError as error:
        hint = unreadable_file(source.resolve(map_path), "map")
        raise reader.subnode("map").error(error.message, hint) from error


def _load_models(world: LoadedWorld, reader: YamlReader) -> None:
    names: set[str] = set()
    entries = reader.optional_subnode("models", "list")
    reported = time.monotonic()
    for number, entry in enumerate(entries.items()):
        with entry.collect_errors():
            _load_model(world, entry, names)
        if time.monotonic() - reported > _PROGRESS_PERIOD:
            reported = time.monotonic()
            _LOG.info("loaded %d of %d models", number + 1, len(entries))


def _load_model(world: LoadedWorld, entry: YamlReader, names: set[str]) -> None:
    name = entry.get("name", "string")
    try:
        check_model_name(name, is_of_file=True)
    except ValueError as error:
        raise entry.error(f"failed to spawn model, {error}") from None
    model_reader = entry.with_location(f'model "{name}"')
    pose = model_reader.get("pose", "pose", IDENTITY, finite=True)
    if max(map(abs, pose)) > MAX_MAGNITUDE:
        model_reader.report(
            model_reader.invalid("pose", f"must be within +-{MAX_MAGNITUDE:g}, got {list(pose)}")
        )
        pose = IDENTITY  # only if errors are collected
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
            hint = unreadable_file(world.resolve_path(path), "model")
            raise located.error(error.message, hint) from error


def _all_missing_plugins(world: LoadedWorld, reader: YamlReader) -> MissingPluginsError | None:
    """Returns one error for all missing plugins of a world, except those in invalid files."""
    lists: dict[str, YamlReader] = {}  # plugins by model file, which many models may share
    entries: list[PluginEntry] = []
    for model in reader.optional_subnode("models", "list").items():
        with suppress(YamlError):
            name, path = model.get("name", "string"), model.get("model", "string")
            if path not in lists:
                file = read_yaml(world.resolve_path(path), world.source.inputs)
                lists[path] = file.optional_subnode("plugins", "list")
            entries += read_entries(lists[path].items(), name)
    with suppress(YamlError):
        entries += read_entries(reader.optional_subnode("plugins", "list").items(), None)
    return world.plugin_host.registry.missing_plugins_error(entries)


def _load_world_plugin(world: LoadedWorld, entry: YamlReader, world_config: YamlReader) -> None:
    name = entry.get("name", "string")
    if not entry.get("enabled", "bool", True):
        _LOG.info('world plugin "%s" is disabled', name)
        return
    world.plugin_host.start_world_plugin(entry, world_config)
