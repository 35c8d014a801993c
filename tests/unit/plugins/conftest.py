"""Worlds with one robot that has the plugins under test."""

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
    """Returns a block of YAML under a key."""
    return f"{key}:\n{indent(dedent(text).strip(), '  ')}\n" if text.strip() else f"{key}: []\n"


class PluginWorld:
    """Loads worlds with one model, `robot`."""

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
            plugins: List of plugins of the model, as YAML.
            bodies: List of bodies; by default one body `base`, a disc with a radius of 0.2 m.
            joints: List of joints, by default empty.
            namespace: Namespace of the model.
            pose: Pose of the model.
            layers: List of layers; by default two layers without walls, `2d` and `3d`.
            world_plugins: List of world plugins.
            options: Arguments of `World.from_yaml`.
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
        """Loads a world whose plugin is invalid and returns the text of the error."""
        with pytest.raises(flatland.PluginError) as caught:
            self(plugins, **options)
        return str(caught.value)


@pytest.fixture
def plugin_world(files: Any) -> PluginWorld:
    """Loads worlds with one robot with given plugins; they are closed after the test."""
    return PluginWorld(files)


@pytest.fixture
def collect() -> Callable[[flatland.World, str], list[Any]]:
    """Returns a function that subscribes to an output and returns the list of its values."""

    def subscribe(world: flatland.World, topic: str) -> list[Any]:
        values: list[Any] = []
        world.ports.find_output(topic).subscribe(values.append)
        return values

    return subscribe
