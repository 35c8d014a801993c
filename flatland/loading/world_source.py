"""The files and parameters that a world is made from."""

from __future__ import annotations

import copy
import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from flatland.checks import plain_path, shown
from flatland.config.documents import (
    TEXT_NAME,
    is_yaml_text,
    load_documents,
    parse_documents,
)
from flatland.config.inputs import FileStore, Inputs, Params, SavedInputs, real_folders
from flatland.config.node import Source
from flatland.config.preprocessor import included_files, preprocess_text
from flatland.config.reader import ReadYaml, YamlReader, read_yaml
from flatland.errors import FlatlandError
from flatland.maps.grid_map import grid_map
from flatland.maps.map_file import LayerMap, load_map

if TYPE_CHECKING:
    from flatland.values import OccupancyGrid

SIMPLIFICATIONS: Final = (0, 1, 2)
_MAX_AHEAD: Final = 1000  # files that are read ahead; further ones are read when they are needed

SavedSource = tuple[SavedInputs, str, int]
"""The part of a `WorldSource` that a snapshot contains."""


class WorldSource:
    """The file of a world, and how this file and all other files of the world are read.

    Attributes:
        path: Absolute path of the world file; empty for a world that a program creates.
        params: Source of the values of `param()` in YAML files.
        simplify_map: Simplification of map boundaries, see `World.from_yaml`.
        inputs: Reads all files and parameters, and lists what was read.
        map_layer: Name of the layer that the ROS node publishes as a map; empty for none.
        grids: The last grid of each layer whose map is received from a topic, by the first name of
            the layer.
        commands_received: Number of values that commands received, from plugins, while the world
            file was loaded.
    """

    def __init__(
        self,
        path: str | os.PathLike[str] | None = None,
        *,
        folder: str | os.PathLike[str] = ".",
        params: Params = None,
        simplify_map: int = 0,
        model_path: Iterable[str | os.PathLike[str]] | None = None,
        read: ReadYaml = read_yaml,
    ) -> None:
        """Describes a source; nothing is read.

        Args:
            path: World file; None for a world that a program creates.
            folder: Folder that relative paths of models start from if there is no world file.
            params: Source of the values of `param()` in YAML files.
            simplify_map: See `World.from_yaml`.
            model_path: Folders outside which no model file or map is read after the world was
                loaded; None for no restriction.
            read: Loads a YAML file.

        Raises:
            TypeError: `params` is neither a dictionary nor a function.
            ValueError: `path`, `simplify_map` or `model_path` is invalid.
        """
        if isinstance(simplify_map, bool) or simplify_map not in SIMPLIFICATIONS:
            raise ValueError(f"simplify_map must be 0, 1 or 2, got {shown(simplify_map)}")
        if not (params is None or isinstance(params, Mapping) or callable(params)):
            raise TypeError(f"params must be a dictionary or a function, got {shown(params)}")
        current = Source("", str(Path.cwd()))
        self.path = "" if path is None else current.resolve(plain_path("path", path))
        self.params = params
        self.simplify_map = simplify_map
        self.inputs = Inputs(params, folders=real_folders(model_path))
        self.map_layer = ""
        self.grids: dict[str, OccupancyGrid | None] = {}
        self.commands_received = 0
        home = Path(self.path).parent if self.path else Path(folder).absolute()
        self._files = Source("", str(home))
        self._read = read

    def resolve(self, path: str) -> str:
        """Returns the absolute path of a model or map file; see `World.resolve_path`."""
        return self._files.resolve(path)

    def read(self, path: str) -> YamlReader:
        """Loads and preprocesses a YAML file.

        Args:
            path: Absolute path of the file.

        Raises:
            YamlError: The file cannot be read, is not valid YAML, or cannot be preprocessed.
        """
        return self._read(path, self.inputs)

    def read_text(self, text: str, name: str) -> YamlReader:
        """Parses and preprocesses a YAML text, in which relative paths start from the world file.

        Args:
            text: The text.
            name: Name of the text in error messages.

        Raises:
            YamlError: The text is not valid YAML, or cannot be preprocessed.
        """
        return YamlReader(preprocess_text(text, self.resolve(""), self.inputs, name))

    def read_models_ahead(self, yaml_paths: Iterable[str]) -> FileStore:
        """Reads and parses models that are about to be spawned, in any thread.

        `using` the result, `read` and `read_text` neither wait for a disk nor parse. Errors are
        raised there.

        Args:
            yaml_paths: As in `ModelSpec`.
        """
        store = FileStore()
        inputs = Inputs(folders=self.inputs.folders)
        waiting = []
        for given in yaml_paths:
            if is_yaml_text(given):
                parse = partial(parse_documents, given, Source(TEXT_NAME, self.resolve("")), inputs)
                waiting.append((given, parse))
            else:
                path = self.resolve(given)
                waiting.append((path, partial(load_documents, path, inputs)))
        with inputs.using(store):
            while waiting and len(store.documents) < _MAX_AHEAD:
                name, parse = waiting.pop()
                if name in store.documents:
                    continue
                try:
                    documents = parse()
                except FlatlandError as error:
                    store.documents[name] = error
                else:
                    store.documents[name] = documents
                    waiting += [
                        (path, partial(load_documents, path, inputs))
                        for path in included_files(documents)
                    ]
        return store

    def read_map_ahead(self, path: str) -> FileStore:
        """Reads a map file that is about to become the map of a layer, in any thread.

        `using` the result, `load_map` neither waits for a disk nor decodes an image. Errors are
        raised there.
        """
        made = copy.copy(self)
        made.inputs = Inputs(self.params, folders=self.inputs.folders, logs=False)
        store = FileStore()
        with made.inputs.using(store), suppress(FlatlandError):
            made.load_map(path, "")
        return store

    def convert_grid_ahead(self, grid: OccupancyGrid) -> FileStore:
        """Converts a grid that is about to become the map of a layer, in any thread.

        `using` the result, `grid_map` only returns the geometry.

        Raises:
            MapFileError: The grid is invalid.
        """
        store = FileStore()
        store.parsed[grid] = grid_map(grid, self.simplify_map)
        return store

    def grid_map(self, grid: OccupancyGrid) -> LayerMap:
        """Returns the geometry of a grid; see `flatland.maps.grid_map.grid_map`.

        Raises:
            MapFileError: The grid is invalid.
        """
        return self.inputs.made(grid, lambda: grid_map(grid, self.simplify_map))

    def load_map(self, path: str, layer_name: str) -> LayerMap:
        """Reads a map file and its image or data file; see `flatland.maps.map_file.load_map`.

        Args:
            path: Map file, absolute or relative to the folder of the world file.
            layer_name: First name of the layer, for errors and the log.
        """
        return load_map(
            self.resolve(path),
            layer_name,
            inputs=self.inputs,
            simplify=self.simplify_map,
            read=self._read,
        )

    # -- snapshots and clones --------------------------------------------------------------

    def save(self) -> SavedSource:
        """Returns what loading, spawning and resetting change."""
        return self.inputs.save(), self.map_layer, self.commands_received

    def restore(self, saved: SavedSource) -> None:
        """Restores the result of `save`."""
        inputs, self.map_layer, self.commands_received = saved
        self.inputs.restore(inputs)

    def copy(self) -> WorldSource:
        """Returns the source of a clone of the world."""
        made = object.__new__(WorldSource)
        vars(made).update(vars(self), inputs=self.inputs.copy(), grids=self.grids.copy())
        return made
