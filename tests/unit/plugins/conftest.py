"""Worlds with one robot that carries the plugins under test."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from textwrap import dedent, indent
from typing import Any

import pytest

import flatland

BASE = """
- name: base
  footprints: [{type: circle, radius: 0.2, density: 1}]
"""
LAYERS = "[{name: 2d}, {name: 3d}]"


def section(key: str, text: str) -> str:
    """Puts a block of YAML under a key."""
    return f"{key}:\n{indent(dedent(text).strip(), '  ')}\n" if text.strip() else f"{key}: []\n"


class PluginWorld:
    """Loads a world that holds one model, `robot`."""

    def __init__(self, files: Any) -> None:
        self.files = files
        self.folder: Path = files.folder

    def __call__(
        self,
        plugins: str = "",
        *,
        bodies: str = BASE,
        joints: str = "",
        namespace: str = "",
        pose: Sequence[float] = (0.0, 0.0, 0.0),
        layers: str = LAYERS,
        world_plugins: str = "",
        **options: Any,
    ) -> flatland.World:
        """Writes the files and loads them.

        Args:
            plugins: The model's list of plugins, as YAML; of its bodies and joints likewise.
            bodies: One body `base`, a disc of 0.2 m, when left out.
            joints: None when left out.
            namespace: Of the model.
            pose: Of the model.
            layers: Two layers without walls, `2d` and `3d`, when left out.
            world_plugins: The world's list of plugins.
            options: For `World.from_yaml`.
        """
        self.files.write(
            "robot.model.yaml",
            section("bodies", bodies) + section("joints", joints) + section("plugins", plugins),
        )
        model = f"{{name: robot, namespace: '{namespace}', pose: {list(pose)}, "
        world: flatland.World = self.files.load(
            f"properties: {{}}\nlayers: {layers}\n"
            f"models: [{model}model: robot.model.yaml}}]\n" + section("plugins", world_plugins),
            **options,
        )
        return world

    def error(self, plugins: str, **options: Any) -> str:
        """Loads what must not load because of its plugin, and returns the error's text."""
        with pytest.raises(flatland.PluginError) as caught:
            self(plugins, **options)
        return str(caught.value)


@pytest.fixture
def plugin_world(files: Any) -> PluginWorld:
    """Loads worlds with one robot that carries given plugins; they are closed after the test."""
    return PluginWorld(files)


@pytest.fixture
def collect() -> Callable[[flatland.World, str], list[Any]]:
    """Subscribes to an output and returns the list that its values go to."""

    def subscribe(world: flatland.World, topic: str) -> list[Any]:
        values: list[Any] = []
        world.ports.find_output(topic).subscribe(values.append)
        return values

    return subscribe
