"""Named rigid bodies and their owners."""

from __future__ import annotations

from flatland.physics import PhysicsBody

Color = tuple[float, float, float, float]


class Entity:
    """Owner of bodies: a model or a layer.

    Attributes:
        name: Name of the model, or first name of the layer.
    """

    name: str


class Body(PhysicsBody):
    """A named rigid body of a model or a layer.

    Attributes:
        name: Name of the body, unique within its entity.
        entity: Model or layer that owns the body.
        color: Color for drawings as (r, g, b, a), each in [0, 1].
        visible: Whether markers and drawings show the body; no effect on collisions and rays.
        class_name: Class of objects that the body belongs to, for labels of sensors.
    """

    __slots__ = ("class_name", "color", "entity", "name", "visible")

    def __init__(
        self,
        physics: PhysicsBody,
        entity: Entity,
        name: str,
        color: Color,
        class_name: str = "",
    ) -> None:
        """Creates a named handle of a body.

        Args:
            physics: Handle of the body.
            entity: Model or layer that owns the body.
            name: Name of the body, unique within the entity.
            color: Color for drawings as (r, g, b, a), each in [0, 1].
            class_name: Class of objects that the body belongs to.
        """
        super().__init__(physics.world, physics.id)
        self.entity = entity
        self.name = name
        self.color = color
        self.visible = True
        self.class_name = class_name

    def __repr__(self) -> str:
        return f"<Body {self.name!r} of {self.entity.name!r}>"

    @property
    def physics(self) -> PhysicsBody:
        """The body itself; kept for plugins that access the physics as `body.physics`."""
        return self
