"""A world file that describes the present models of a world."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, Final

import yaml

from flatland.config.documents import is_yaml_text
from flatland.config.inputs import Inputs
from flatland.errors import WorldError
from flatland.loading.model_source import spec_of
from flatland.loading.world_loader import LoadedWorld

_MAX_NAMES: Final = 5  # in a note
_PLAIN_TAGS: Final = frozenset(f"tag:yaml.org,2002:{name}" for name in ("bool", "float", "int"))
_HEADER: Final = """\
# Saved from {name} after {time:.3f} s of simulated time, for the same folder: paths start there.
# The poses of models are those of that time. World files cannot express velocities, joint
# angles and the state of plugins. Expressions and included files are replaced by their values.
"""


class SavedWorld:
    """What a world file can express of a world, copied between two steps.

    Attributes:
        folder: Folder of the world file, from which relative paths start.
        name: Name for the new file, which differs from that of the world file.
    """

    def __init__(self, world: LoadedWorld) -> None:
        """Copies the state of a world; must be called between two steps.

        Args:
            world: The world.

        Raises:
            WorldError: The world was not loaded from a file.
        """
        path = Path(world.source.path)
        if not world.source.path:
            raise WorldError("only a world that was loaded from a file can be saved")
        self.folder = str(path.parent)
        self.name = f"{path.stem}_saved.yaml"
        self._file = path.name
        self._seed, self._time = world.seed, world.timekeeper.sim_time
        self._source = world.source.copy()
        self._maps = [
            (layer.name, layer.map_path, layer.grid is not None) if is_new else None
            for layer in world.layers
            for is_new in [layer.map_version > 0 and not layer.map_topic]
        ]
        specs = {model.name: spec_of(model) for model in world.models}
        self._models = [spec for spec in specs.values() if spec is not None]
        self._omitted = [name for name, spec in specs.items() if spec is None]

    def file(self) -> tuple[str, list[str]]:
        """Returns the text of the file, and notes on what it does not contain, in any thread.

        The layers, properties and world plugins are those of the world file, with the files and
        parameters as they were when the world was loaded.

        Raises:
            FlatlandError: The world file cannot be read.
        """
        source, notes = self._source, []
        inputs = source.inputs
        inputs.log = Inputs(logs=False).log  # The warnings were logged when the world was loaded.
        with inputs.loading():
            inputs.set_seed(self._seed)
            content: dict[str, Any] = source.read(source.path).plain()
        for entry, new in zip(content["layers"], self._maps, strict=False):
            if new is None:
                continue
            name, path, is_grid = new
            if is_grid:
                notes.append(
                    f"Layer {json.dumps(name)} has the map of the world file, because its present "
                    "map was not read from a file"
                )
            else:
                entry["map"] = self._relative(path)
        if self._omitted:
            names = ", ".join(map(json.dumps, self._omitted[:_MAX_NAMES]))
            more = ", ..." if len(self._omitted) > _MAX_NAMES else ""
            notes.append(
                f"Models that were not read from a file are not included: {names}{more}. Plugins, "
                "such as Pedestrians, create theirs again"
            )
        content.pop("models", None)
        plugins = content.pop("plugins", None)
        content["models"] = [
            {
                "name": spec.name,
                "model": self._relative(spec.yaml_path),
                "pose": [float(number) for number in spec.pose],
                **({"namespace": spec.namespace} if spec.namespace else {}),
            }
            for spec in self._models
        ]
        if plugins is not None:
            content["plugins"] = plugins
        header = _HEADER.format(name=json.dumps(self._file), time=self._time)
        header += "".join(f"# {note}.\n" for note in notes)
        text = yaml.dump(
            content,
            Dumper=_Dumper,
            sort_keys=False,
            default_flow_style=None,
            allow_unicode=True,
            width=100,
        )
        return header + text, notes

    def _relative(self, path: str) -> str:
        """Returns a path relative to the folder of the world file if it is below that folder."""
        try:
            relative = str(Path(path).relative_to(self.folder))
        except ValueError:
            return path
        is_plain = not is_yaml_text(relative) and not relative.startswith(("~", "$"))
        return relative if is_plain else os.path.join(self.folder, relative)  # noqa: PTH118


class _Dumper(yaml.SafeDumper):
    """Writes numbers that were read as text without quotes, and repeats what has an alias."""

    def ignore_aliases(self, data: Any) -> bool:  # noqa: ARG002
        return True

    def represent_text(self, text: str) -> yaml.ScalarNode:
        tag: str = self.resolve(yaml.ScalarNode, text, (True, False))  # type: ignore[no-untyped-call]
        return self.represent_scalar(tag if tag in _PLAIN_TAGS else self.DEFAULT_SCALAR_TAG, text)


_Dumper.add_representer(str, _Dumper.represent_text)
