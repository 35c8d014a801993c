"""Handles of fixtures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from flatland.geometry import DoubleArray, Vector2
from flatland.physics.handle import Handle
from flatland.physics.material import Material

if TYPE_CHECKING:
    from flatland.physics.body import PhysicsBody

ALL_BITS: Final = 0xFFFF


class PhysicsFixture(Handle):
    """Handle of a fixture.

    All members except `alive` raise `StaleHandleError` once the body of the fixture is destroyed.

    Attributes:
        id: Id of the fixture, never reused in its world.
        world: Physics world that contains the fixture.
    """

    __slots__ = ()

    @property
    def alive(self) -> bool:
        """Whether the fixture exists."""
        return self._core.has_fixture(self.id)

    @property
    def body(self) -> PhysicsBody:
        """Body of the fixture."""
        return self.world.body(self._core.fixture_body(self.id))

    @property
    def shape(self) -> str:
        """Type of the shape, `circle`, `polygon` or `edge`."""
        return self._core.fixture_shape(self.id)

    @property
    def vertices(self) -> DoubleArray:
        """Vertices of the shape in the body frame [m], shape (n, 2).

        The counter-clockwise corners of a polygon, the end points of an edge; empty for a circle.
        """
        return self._core.fixture_vertices(self.id)

    @property
    def center(self) -> Vector2:
        """Center of a circle, centroid of a polygon or midpoint of an edge, body frame [m]."""
        return self._core.fixture_center(self.id)

    @property
    def radius(self) -> float:
        """Radius of a circle [m], 0 for other shapes."""
        return self._core.fixture_radius(self.id)

    @property
    def density(self) -> float:
        """Density [kg/m^2]."""
        return self._core.fixture_density(self.id)

    @property
    def friction(self) -> float:
        """Friction coefficient."""
        return self._core.fixture_friction(self.id)

    @property
    def restitution(self) -> float:
        """Restitution coefficient."""
        return self._core.fixture_restitution(self.id)

    @property
    def is_sensor(self) -> bool:
        """Whether the fixture is a sensor, which detects contacts but stops no ray; settable."""
        return self._core.fixture_is_sensor(self.id)

    @is_sensor.setter
    def is_sensor(self, value: bool) -> None:
        self._core.set_fixture_is_sensor(self.id, value)

    @property
    def category_bits(self) -> int:
        """Categories of the fixture, 16 bits; settable."""
        return self._core.fixture_filter(self.id)[0]

    @category_bits.setter
    def category_bits(self, bits: int) -> None:
        self._core.set_fixture_filter(self.id, bits, self.mask_bits)

    @property
    def mask_bits(self) -> int:
        """Categories that the fixture collides with, 16 bits; settable."""
        return self._core.fixture_filter(self.id)[1]

    @mask_bits.setter
    def mask_bits(self, bits: int) -> None:
        self._core.set_fixture_filter(self.id, self.category_bits, bits)

    @property
    def material(self) -> Material | None:
        """Material of the surface, None for a plain one; can be set, not removed.

        Raises:
            ValueError: A number is not from 0 to 1, or `transmission` + `specular` is above 1.
        """
        material = self._core.fixture_material(self.id)
        return None if material is None else Material(*material)

    @material.setter
    def material(self, material: Material) -> None:
        self._core.set_fixture_material(self.id, *material)
