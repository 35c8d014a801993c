"""Rigid bodies, and what owns them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from flatland.geometry import Pose, Vector2, finite_pose

if TYPE_CHECKING:
    from flatland.physics import PhysicsBody, PhysicsFixture

Color = tuple[float, float, float, float]


class Entity:
    """What a body belongs to: a model or a layer.

    Attributes:
        name: Of the model, or the first name of the layer.
    """

    name: str


class Body:
    """A named Box2D body of a model or a layer."""

    __slots__ = ("color", "entity", "name", "physics")

    def __init__(self, physics: PhysicsBody, entity: Entity, name: str, color: Color) -> None:
        """Names a physics body.

        Args:
            physics: The body in the physics world.
            entity: Model or layer that owns it.
            name: Unique within the entity.
            color: (r, g, b, a), each 0 to 1, for pictures.
        """
        self.physics = physics
        self.entity = entity
        self.name = name
        self.color = color

    def __repr__(self) -> str:
        """Names the body and its owner."""
        return f"<Body {self.name!r} of {self.entity.name!r}>"

    @property
    def pose(self) -> Pose:
        """(x, y, theta) of the body's origin in the world frame [m, rad]."""
        return self.physics.pose

    @property
    def velocity(self) -> Pose:
        """(vx, vy, omega) of the body's origin in the world frame [m/s, rad/s]."""
        return self.physics.velocity

    def set_pose(self, x: float, y: float, theta: float) -> None:
        """Puts the body's origin at a pose in the world frame.

        Raises:
            ValueError: A number is NaN or infinite.
            WorldLockedError: Called from `pre_solve`.
        """
        self.physics.set_pose(*finite_pose((x, y, theta)))

    def set_velocity(self, vx: float, vy: float, omega: float) -> None:
        """Makes the body's origin move at (vx, vy) in the world frame and the body turn at omega.

        Raises:
            ValueError: A number is NaN or infinite.
        """
        self.physics.set_velocity(vx, vy, omega)

    def apply_force(self, force: Sequence[float], point: Sequence[float]) -> None:
        """Applies a force [N] at a point [m] for the next step, both in the world frame."""
        self.physics.apply_force((force[0], force[1]), (point[0], point[1]))

    def apply_torque(self, torque: float) -> None:
        """Applies a torque about z [N m] for the next step."""
        self.physics.apply_torque(torque)

    @property
    def type(self) -> str:
        """`static`, `kinematic` or `dynamic`."""
        return self.physics.type

    @property
    def awake(self) -> bool:
        """Whether the body is simulated; Box2D lets resting bodies sleep."""
        return self.physics.awake

    @awake.setter
    def awake(self, value: bool) -> None:
        self.physics.awake = value

    @property
    def mass(self) -> float:
        """Mass [kg]; 1 for a dynamic body whose footprints have none, 0 if it is not dynamic."""
        return self.physics.mass

    @property
    def local_center(self) -> Vector2:
        """Centre of mass in the body frame [m]."""
        return self.physics.local_center

    @property
    def linear_damping(self) -> float:
        """Box2D's linear damping [1/s]."""
        return self.physics.linear_damping

    @property
    def angular_damping(self) -> float:
        """Box2D's angular damping [1/s]."""
        return self.physics.angular_damping

    @property
    def fixtures(self) -> list[PhysicsFixture]:
        """The fixtures in the order in which they were made."""
        return self.physics.fixtures
