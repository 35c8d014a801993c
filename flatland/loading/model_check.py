"""Loads a model file without a world file, to check it."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from pathlib import Path

from flatland.config.preprocessor import Params
from flatland.config.reader import YamlReader
from flatland.entities.collision_filter import MAX_LAYERS, CollisionFilter
from flatland.errors import YamlError
from flatland.world import World


def is_model_file(path: Path, params: Params) -> bool:
    """Reads a file and returns whether it is a model and not a world.

    Warnings about the file are not logged, as they come when it is loaded.

    Args:
        path: The file.
        params: What `param()` in YAML files answers from.

    Raises:
        YamlError: The file cannot be read, is not YAML, or its preprocessing fails.
    """
    log = logging.getLogger("flatland")
    was_disabled, log.disabled = log.disabled, True
    try:
        reader = YamlReader.from_file(path, params)
    finally:
        log.disabled = was_disabled
    return "bodies" in reader and "layers" not in reader and "properties" not in reader


def load_model_alone(path: Path, params: Params) -> World:
    """Makes a world without layers and spawns one model in it.

    The footprints and plugins of the model may name any layers, up to the number that a world can
    have; these are the names in the world's collision filter.

    Args:
        path: The model file; the model gets the part of its name before the first dot.
        params: What `param()` in YAML files answers from.

    Raises:
        FlatlandError: Something in the file is wrong; nothing is left behind.
    """
    world = World(seed=0, params=params)
    try:
        world.collision_filter = _LayersOnDemand(path)
        world.spawn_model(path, path.name.split(".")[0] or "model")
    except BaseException:
        world.close()
        raise
    return world


class _LayersOnDemand(CollisionFilter):
    """Registers each layer when it is first named, since a model file does not define any."""

    def __init__(self, path: Path) -> None:
        """Starts without layers.

        Args:
            path: The model file, for the error.
        """
        super().__init__()
        self._path = path

    def unknown(self, names: Iterable[str]) -> list[str]:
        """Returns only `all`, which is no layer, where it stands beside other names.

        Raises:
            YamlError: The model names more layers than a world can have.
        """
        names = list(names)
        new = [name for name in dict.fromkeys(super().unknown(names)) if name != "all"]
        named = [*self.names, *new]
        if len(named) > MAX_LAYERS:
            raise YamlError(
                f"Model names {len(named)} layers {{{', '.join(named)}}}, max allowed in a world "
                f"is {MAX_LAYERS} [{self._path}]"
            )
        self.register(new)
        return super().unknown(names)
