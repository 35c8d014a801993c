"""The poses and velocities of all models of a world."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from flatland.geometry import DoubleArray

if TYPE_CHECKING:
    from flatland.entities.model import Model
    from flatland.physics import PhysicsWorld


@dataclass(frozen=True, slots=True, eq=False)
class ModelStates:
    """The states of all models, in the order in which they were spawned.

    Attributes:
        names: Name of each model.
        poses: (x, y, theta) of the first body of each model in the world frame [m, rad],
            shape (n, 3).
        velocities: (vx, vy, omega) of the origins of the same bodies in the world frame
            [m/s, rad/s], shape (n, 3).
    """

    names: tuple[str, ...]
    poses: DoubleArray
    velocities: DoubleArray


def model_states(physics: PhysicsWorld, models: Mapping[str, Model]) -> ModelStates:
    """Returns the states of models.

    Args:
        physics: Contains their bodies.
        models: The models by name.
    """
    motions = physics.motions([model.bodies[0] for model in models.values()])
    return ModelStates(tuple(models), motions[:, :3], motions[:, 3:])
