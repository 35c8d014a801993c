"""The bodies of a model file, without a world that contains the model."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

from flatland.config.reader import YamlReader
from flatland.entities.body import Body
from flatland.entities.collision_filter import ALL_LAYERS, CollisionFilter
from flatland.entities.model import Model
from flatland.geometry import IDENTITY
from flatland.loading.model_loader import ModelLoader
from flatland.physics import PhysicsWorld
from flatland.world import World


class _AnyLayer(CollisionFilter):
    """Accepts every layer name: the layers of the world are not available here."""

    def unknown(self, _names: Iterable[str]) -> list[str]:
        return []

    def category_bits(self, _names: Iterable[str]) -> int:
        return ALL_LAYERS


@contextmanager
def bodies_of_file(
    path: str, params: Callable[[str], object] | None = None, *, name: str = "preview"
) -> Iterator[list[Body]]:
    """Yields the bodies of a model file, with the model at the origin; they end with the block.

    Args:
        path: Path of the model file.
        params: Returns the value of `param(name)` in the file.
        name: Name of the model in error messages.

    Raises:
        YamlError: The file cannot be read, or a body or joint in it is invalid.
    """
    with World(seed=0) as world:
        physics = PhysicsWorld()
        try:
            model = Model(world, name, "", path)
            reader = YamlReader.from_file(path, params)
            ModelLoader(physics, _AnyLayer(), model, reader).load_bodies_and_joints(IDENTITY)
            yield model.bodies
        finally:
            physics.close()
