"""Contacts as they are passed to plugins."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flatland.geometry import DoubleArray

if TYPE_CHECKING:
    from collections.abc import Mapping

    from flatland.entities.body import Body, Entity
    from flatland.physics import ContactEvent, ContactInfo, PhysicsFixture, PreSolveContact


@dataclass(frozen=True, slots=True, eq=False)
class Contact:
    """A contact of two fixtures, with its state when the physics engine reported it.

    Attributes:
        contact_id: Id of the contact, the same from `begin_contact` to `end_contact`.
        body_a: First body.
        body_b: Second body.
        fixture_a: Fixture of the first body.
        fixture_b: Fixture of the second body.
        points: Contact points, world frame [m], shape (k, 2), k from 0 to 2; empty for sensors.
        normal: Unit vector from A to B, world frame, shape (2,); zero without points.
        is_sensor: Whether one of the fixtures is a sensor; such a contact has no response.
    """

    contact_id: int
    body_a: Body
    body_b: Body
    fixture_a: PhysicsFixture
    fixture_b: PhysicsFixture
    points: DoubleArray
    normal: DoubleArray
    is_sensor: bool

    @classmethod
    def between(
        cls, bodies: Mapping[int, Body], info: ContactInfo | ContactEvent
    ) -> Contact | None:
        """Returns the contact of a report of the physics engine.

        Args:
            bodies: Bodies of all models and layers by id.
            info: Contact or contact event reported by the physics engine.

        Returns:
            The contact; None if one of the bodies belongs to no model or layer because a plugin
            created it in the physics world.
        """
        body_a, body_b = bodies.get(info.body_a), bodies.get(info.body_b)
        if body_a is None or body_b is None:
            return None
        return cls(
            info.contact_id,
            body_a,
            body_b,
            body_a.fixture(info.fixture_a),
            body_b.fixture(info.fixture_b),
            info.points,
            info.normal,
            info.is_sensor,
        )


@dataclass(frozen=True, slots=True, eq=False)
class ContactImpulse:
    """Impulses that the solver applied at a contact in one step.

    Attributes:
        normal_impulses: Impulse along the normal at each point [N s], shape (k,).
        tangent_impulses: Impulse along the surface at each point [N s], shape (k,).
    """

    normal_impulses: DoubleArray
    tangent_impulses: DoubleArray


class MutableContact:
    """A contact that the solver is about to process.

    Passed to `pre_solve`. `enabled`, `friction`, `restitution` and `tangent_speed` can be accessed
    only during that call.
    """

    __slots__ = ("_raw", "body_a", "body_b", "fixture_a", "fixture_b")

    def __init__(
        self,
        raw: PreSolveContact,
        body_a: Body,
        body_b: Body,
        fixture_a: PhysicsFixture,
        fixture_b: PhysicsFixture,
    ) -> None:
        """Wraps a contact of the physics engine."""
        self._raw = raw
        self.body_a = body_a
        self.body_b = body_b
        self.fixture_a = fixture_a
        self.fixture_b = fixture_b

    @property
    def contact_id(self) -> int:
        """Id of the contact, the same from `begin_contact` to `end_contact`."""
        return self._raw.contact_id

    @property
    def points(self) -> DoubleArray:
        """Contact points, world frame [m], shape (k, 2)."""
        return np.asarray(self._raw.points, dtype=np.float64)

    @property
    def normal(self) -> DoubleArray:
        """Unit vector from A to B, world frame, shape (2,)."""
        return np.asarray(self._raw.normal, dtype=np.float64)

    @property
    def enabled(self) -> bool:
        """Whether the solver separates the fixtures in this step; reset to True in each step."""
        return self._raw.enabled

    @enabled.setter
    def enabled(self, value: bool) -> None:
        self._raw.enabled = value

    @property
    def friction(self) -> float:
        """Friction coefficient of the contact; a new value applies until the contact ends."""
        return self._raw.friction

    @friction.setter
    def friction(self, value: float) -> None:
        self._raw.friction = value

    @property
    def restitution(self) -> float:
        """Restitution coefficient of the contact; a new value applies until the contact ends."""
        return self._raw.restitution

    @restitution.setter
    def restitution(self, value: float) -> None:
        self._raw.restitution = value

    @property
    def tangent_speed(self) -> float:
        """Speed of the surface along the tangent [m/s], as for a conveyor belt."""
        return self._raw.tangent_speed

    @tangent_speed.setter
    def tangent_speed(self, value: float) -> None:
        self._raw.tangent_speed = value


@dataclass(frozen=True, slots=True, eq=False)
class ModelContact:
    """A contact from the perspective of one model.

    Attributes:
        other_entity: Model or layer that the model touches.
        this_body: Body of the model.
        other_body: Body of the other entity.
        this_fixture: Fixture of the model.
        other_fixture: Fixture of the other entity.
        is_a: Whether `this_body` is body A of the contact, from which the normal points away.
    """

    other_entity: Entity
    this_body: Body
    other_body: Body
    this_fixture: PhysicsFixture
    other_fixture: PhysicsFixture
    is_a: bool
