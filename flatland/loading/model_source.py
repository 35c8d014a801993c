"""The sources of models: files, or YAML text given instead of a path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from flatland.config.documents import TEXT_NAME, is_yaml_text
from flatland.config.reader import YamlReader

if TYPE_CHECKING:
    from flatland.entities.model import Model
    from flatland.loading.world_source import WorldSource


@dataclass(frozen=True, slots=True)
class ModelSpec:
    """A model to spawn; see `World.spawn_models`.

    Attributes:
        yaml_path: Model file, or YAML text that begins with a line break or with `{`.
        name: Name of the model, unique in the world.
        namespace: Namespace of its topics and frames, may be empty.
        pose: (x, y, theta) of the model in the world frame [m, rad].
    """

    yaml_path: str
    name: str
    namespace: str = ""
    pose: Sequence[float] = (0.0, 0.0, 0.0)


def spec_of(model: Model) -> ModelSpec | None:
    """Returns what spawns a model again where it is, None if it was spawned from a text."""
    if model.path == TEXT_NAME:
        return None
    return ModelSpec(model.path, model.name, model.namespace, model.origin)


class ModelSources:
    """Reads the sources of the models of one request.

    Each source is parsed once, unless its expressions (`$eval`) may differ from model to model.
    """

    def __init__(self, source: WorldSource) -> None:
        """Creates a reader without sources.

        Args:
            source: Source of the world of the models.
        """
        self._source = source
        self._known: dict[str, tuple[str, YamlReader]] = {}

    @property
    def of_world_file(self) -> bool:
        """Whether the models are those of the world file, which is being loaded."""
        return self._source.inputs.is_loading

    def read(self, yaml_path: str) -> tuple[str, YamlReader]:
        """Reads a source.

        Relative paths in a text start from the folder of the world file. The files that a text
        includes are subject to `World.model_path`.

        Args:
            yaml_path: As in `ModelSpec`.

        Returns:
            The absolute path of the file, or `TEXT_NAME`, and a reader of the root.

        Raises:
            YamlError: The source cannot be read, is not valid YAML, or cannot be preprocessed.
        """
        known = self._known.get(yaml_path)
        if known is None:
            known = self._load(yaml_path)
        path, reader = known
        return path, reader.unread()

    def _load(self, yaml_path: str) -> tuple[str, YamlReader]:
        source = self._source
        before = source.inputs.expression_count
        if is_yaml_text(yaml_path):
            loaded = TEXT_NAME, source.read_text(yaml_path, TEXT_NAME)
        else:
            path = source.resolve(yaml_path)
            loaded = path, source.read(path)
        if source.inputs.expression_count == before:
            self._known[yaml_path] = loaded
        return loaded
