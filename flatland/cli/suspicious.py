"""Warnings about a world that can be loaded, but probably does not do what is intended."""

from __future__ import annotations

import logging
from typing import Final

import numpy as np

from flatland.config.collecting_reader import ErrorCollector
from flatland.config.inputs import Inputs, Params
from flatland.config.reader import read_yaml
from flatland.entities.model import Model
from flatland.errors import Place
from flatland.geometry import Bounds, DoubleArray, bounds_of, transform_points
from flatland.maps.occupancy_grid import ImageGrid
from flatland.plugin_api.plugin import FlatlandPlugin, describe
from flatland.plugins._range_sensor import RangeSensor
from flatland.scene.description import describe_body
from flatland.values import Collisions
from flatland.world import World

_LOG = logging.getLogger("flatland")

# Values that name the models they belong to, so that several plugins may share a topic.
_SHARED_VALUES: Final = (Collisions,)
_MAX_NAMES: Final = 3  # of publishers in a warning
_CIRCLE_POINTS: Final = 16


def warn_about_world(world: World, params: Params) -> None:
    """Logs a warning for each conflict of topics and frames, and for each model outside of walls.

    Frames with two parents are logged when the world is loaded.

    Args:
        world: A world that has not been stepped.
        params: Source of the values of `param()` in YAML files.
    """
    _warn_about_topics(world)
    _warn_about_frames(world)
    _warn_about_models_outside(world, params)
    _warn_about_published_maps(world, params)


# -- maps ----------------------------------------------------------------------------------


def _warn_about_published_maps(world: World, params: Params) -> None:
    """Logs a warning for each key of a map file that is used only if the map is published."""
    inputs = Inputs(params, logs=False)
    for layer in world.layers:
        if not _is_image(layer.map_path, inputs):
            continue
        collector = ErrorCollector()
        reader = collector.read(layer.map_path, inputs)
        ImageGrid(reader.with_location(f'layer "{layer.name}"'))
        for error in collector.errors:
            place = error.place or Place(layer.map_path)
            text = error.message.removesuffix(place.suffix)
            hint = error.hint or "the walls do not depend on it"
            extra = {"place": place, "hint": hint}
            _LOG.warning("%s, so that the map cannot be published", text, extra=extra)


# -- topics and frames ---------------------------------------------------------------------


def _warn_about_topics(world: World) -> None:
    """Logs a warning for each topic that several plugins publish."""
    plugins = [plugin for model in world.models for plugin in model.plugins]
    for topic, output in sorted(world.ports.outputs.items()):
        if len(output.owners) > 1 and not issubclass(output.value_type, _SHARED_VALUES):
            senders = [each for each in (*plugins, *world.plugins) if output in each._outputs]
            _warn_about_topic(topic, senders)


def _warn_about_topic(topic: str, senders: list[FlatlandPlugin]) -> None:
    names = [describe(plugin) + plugin._place.suffix for plugin in senders]
    if len(names) > _MAX_NAMES:
        names[_MAX_NAMES - 1 :] = [f"{len(names) - _MAX_NAMES + 1} others"]
    shown = ", ".join(names[:-1]) + f" and {names[-1]}"
    frames = {getattr(plugin, "frame_id", None) for plugin in senders}
    if len(frames) == 1 and None not in frames:
        shown += f', with the frame "{frames.pop()}"'
    models = {getattr(getattr(plugin, "model", None), "name", "") for plugin in senders}
    remedy = "give each plugin a topic of its own"
    if len(models) > 1:
        remedy = 'give each model a "namespace" of its own, or each plugin a topic'
    _LOG.warning(
        'topic "%s" is published by %s; %s',
        topic,
        shown,
        remedy,
        extra={"place": senders[-1]._place},
    )


def _warn_about_frames(world: World) -> None:
    """Logs a warning for each pair of range finders that use one frame for different poses."""
    first: dict[str, RangeSensor] = {}
    for model in world.models:
        for plugin in model.plugins:
            if not isinstance(plugin, RangeSensor):
                continue
            other = first.setdefault(plugin.frame_id, plugin)
            is_same = (plugin.body, plugin.origin) == (other.body, other.origin)
            # If both send their transforms, this is one of the conflicts of these.
            if is_same or (plugin.sends_transform and other.sends_transform):
                continue
            _LOG.warning(
                'frame "%s" has two poses, of %s%s and of %s%s; give each sensor a "frame"',
                plugin.frame_id,
                describe(other),
                other._place.suffix,
                describe(plugin),
                plugin._place.suffix,
                extra={"place": plugin._place},
            )


# -- walls ---------------------------------------------------------------------------------


def _warn_about_models_outside(world: World, params: Params) -> None:
    """Logs a warning for each model that is outside of the bounds of all walls.

    Static bodies are walls. What is outside of an image is occupied. Line segments may be obstacles
    in an open world: a model is then outside if its distance exceeds the extent of the walls.
    """
    walls = [layer.world_edges.reshape(-1, 2) for layer in world.layers]
    if any(layer.map_topic for layer in world.layers):
        return
    if any(map(len, walls)):
        walls += [_points(model, is_static=True) for model in world.models]
    bounds = bounds_of(np.concatenate([*walls, np.empty((0, 2))]))
    if bounds is None:
        return
    x_min, y_min, x_max, y_max = bounds
    inputs = Inputs(params, logs=False)
    has_image = any(_is_image(layer.map_path, inputs) for layer in world.layers)
    margin = 0.0 if has_image else max(x_max - x_min, y_max - y_min)
    limits = (x_min - margin, y_min - margin, x_max + margin, y_max + margin)
    places = _places(world, inputs)
    for model in world.models:
        points = _points(model, is_static=False)
        extent = bounds_of(points)
        if extent is not None and _are_apart(extent, limits):
            _LOG.warning(
                'model "%s" at (%.6g, %.6g) is outside of all walls, which extend from '
                "(%.6g, %.6g) to (%.6g, %.6g)",
                model.name,
                *model.pose[:2],
                *bounds,
                extra={"place": places.get(model.name)},
            )


def _points(model: Model, is_static: bool) -> DoubleArray:
    """Returns the outlines of the static or of the other bodies of a model, shape (n, 2)."""
    bodies = [describe_body(body) for body in model.bodies if (body.type == "static") == is_static]
    outlines = [
        transform_points(body.pose, shape.outline(_CIRCLE_POINTS))
        for body in bodies
        for shape in body.shapes
    ]
    return np.concatenate([*outlines, np.empty((0, 2))])


def _are_apart(a: Bounds, b: Bounds) -> bool:
    return a[2] < b[0] or a[0] > b[2] or a[3] < b[1] or a[1] > b[3]


def _is_image(map_path: str, inputs: Inputs) -> bool:
    """Returns whether a map file has an image; the path is empty for a layer without a map."""
    return bool(map_path) and "image" in read_yaml(map_path, inputs)


def _places(world: World, inputs: Inputs) -> dict[str, Place]:
    """Returns the places of the entries of the models in the world file by name."""
    models = read_yaml(world.source.path, inputs).optional_subnode("models", "list")
    return {entry.get("name", "string"): entry.place for entry in models.items()}
