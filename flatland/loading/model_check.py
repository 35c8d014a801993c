"""Checking of a model file without a world file."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from flatland.config.inputs import Inputs, Params
from flatland.config.reader import ReadYaml, read_yaml
from flatland.entities.collision_filter import MAX_LAYERS, CollisionFilter
from flatland.errors import Place, YamlError
from flatland.loading.world_source import WorldSource

if TYPE_CHECKING:
    from flatland.world import World


def is_model_file(path: Path, params: Params) -> bool:
    """Returns whether a file is a model file, by its keys or, if these are unknown, by its name.

    Warnings about the file are not logged, because they are logged when the file is loaded.

    Args:
        path: The file.
        params: Source of the values of `param()` in YAML files.

    Raises:
        YamlError: The file cannot be read, is not valid YAML, or cannot be preprocessed.
    """
    kind = read_yaml(str(path.absolute()), Inputs(params, logs=False)).file_kind
    return kind == "model" or (kind is None and path.name.endswith(".model.yaml"))


def load_model_alone(
    world_class: type[World],
    path: Path,
    params: Params,
    read: ReadYaml = read_yaml,
    seed: int | None = 0,
) -> World:
    """Creates a world that contains one model and no layers.

    The footprints and plugins of the model may refer to any layers, up to the number that a world
    can have. Their names are registered in the collision filter of the world.

    Args:
        world_class: Class of the world.
        path: The model file; the name of the model is the file name up to the first dot.
        params: Source of the values of `param()` in YAML files.
        read: Loads the file.
        seed: Seed of all random numbers, None to draw one.

    Raises:
        FlatlandError: The file is invalid; the world is closed.
    """
    world = world_class(
        seed=seed,
        source=WorldSource(params=params, read=read),
        collision_filter=_LayersOnDemand(path),
    )
    try:
        world.spawn_model(path, path.name.split(".")[0] or "model")
    except BaseException as error:
        # Not `close`: an exception of a plugin must not replace this one.
        world.__exit__(type(error), error, error.__traceback__)
        raise
    return world


class _LayersOnDemand(CollisionFilter):
    """A collision filter that registers a layer when its name is first used."""

    def __init__(self, path: Path) -> None:
        """Creates a filter without layers.

        Args:
            path: The model file, for error messages.
        """
        super().__init__()
        self._path = path

    def unknown(self, names: Iterable[str]) -> list[str]:
        """Registers new names; returns only `all`, which is not a name of a layer.

        Raises:
            YamlError: The model refers to more layers than a world can have.
        """
        names = list(names)
        new = [name for name in dict.fromkeys(super().unknown(names)) if name != "all"]
        named = [*self.names, *new]
        if len(named) > MAX_LAYERS:
            raise YamlError(
                f"Model refers to {len(named)} layers {{{', '.join(named)}}}, max allowed in a "
                f"world is {MAX_LAYERS} [{self._path}]",
                place=Place(str(self._path)),
            )
        self.register(new)
        return super().unknown(names)
