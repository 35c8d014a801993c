"""The bodies of a model file, without a world that contains the model."""

from __future__ import annotations

from collections.abc import Iterable

from flatland.config.inputs import Inputs
from flatland.config.reader import read_yaml
from flatland.entities.collision_filter import ALL_LAYERS, CollisionFilter
from flatland.entities.model import Model
from flatland.geometry import IDENTITY
from flatland.loading.model_loader import ModelLoader
from flatland.physics import PhysicsWorld
from flatland.scene.description import BodyDescription, describe_body
from flatland.world import World


class _AnyLayer(CollisionFilter):
    """Accepts every layer name: the layers of the world are not available here."""

    def unknown(self, _names: Iterable[str]) -> list[str]:
        return []

    def category_bits(self, _names: Iterable[str]) -> int:
        return ALL_LAYERS


def describe_file(path: str, inputs: Inputs, *, name: str = "preview") -> list[BodyDescription]:
    """Describes the bodies of a model file, with the model at the origin.

    Args:
        path: Path of the model file.
        inputs: Reads the file, the files that it includes, and parameters.
        name: Name of the model in error messages.

    Raises:
        YamlError: The file cannot be read, or a body or joint in the file is invalid.
    """
    with World(seed=0) as world:
        physics = PhysicsWorld()
        try:
            model = Model(world, name, "", path)
            reader = read_yaml(path, inputs)
            ModelLoader(physics, _AnyLayer(), model, reader).load_bodies_and_joints(IDENTITY)
            return [describe_body(body) for body in model.bodies]
        finally:
            physics.close()
