"""Handles of fixtures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from flatland.geometry import DoubleArray, Vector2
from flatland.physics.handle import Handle

if TYPE_CHECKING:
    from flatland.physics.body import PhysicsBody

ALL_BITS: Final = 0xFFFF


class PhysicsFixture(Handle):
    """Handle of a fixture; every use raises `StaleHandleError` once its body is destroyed.

    Attributes:
        id: Its number in the world, never used again for another fixture.
        world: The world it is in.
    """

    __slots__ = ()

    @property
    def alive(self) -> bool:
        """Whether the fixture is still there."""
        return self._core.has_fixture(self.id)

    @property
    def body(self) -> PhysicsBody:
        """The body it belongs to."""
        return self.world.body(self._core.fixture_body(self.id))

    @property
    def shape(self) -> str:
        """`circle`, `polygon` or `edge`."""
        return self._core.fixture_shape(self.id)

    @property
    def vertices(self) -> DoubleArray:
        """Corners of a polygon, counter-clockwise, or ends of an edge, body frame [m], (n, 2)."""
        return self._core.fixture_vertices(self.id)

    @property
    def center(self) -> Vector2:
        """Centre of a circle, centroid of a polygon, middle of an edge, body frame [m]."""
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
        """Whether it only detects contacts and is not seen by rays; settable."""
        return self._core.fixture_is_sensor(self.id)

    @is_sensor.setter
    def is_sensor(self, value: bool) -> None:
        self._core.set_fixture_is_sensor(self.id, value)

    @property
    def category_bits(self) -> int:
        """What it is, 16 bits; settable."""
        return self._core.fixture_filter(self.id)[0]

    @category_bits.setter
    def category_bits(self, bits: int) -> None:
        self._core.set_fixture_filter(self.id, bits, self.mask_bits)

    @property
    def mask_bits(self) -> int:
        """What it collides with, 16 bits; settable."""
        return self._core.fixture_filter(self.id)[1]

    @mask_bits.setter
    def mask_bits(self, bits: int) -> None:
        self._core.set_fixture_filter(self.id, self.category_bits, bits)
