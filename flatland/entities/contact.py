"""Contacts as plugins see them."""

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
    """Two fixtures that touch, at the moment the physics engine reported it.

    Attributes:
        contact_id: Number that belongs to this contact from `begin_contact` to `end_contact`.
        body_a: First body.
        body_b: Second body.
        fixture_a: Fixture of the first body.
        fixture_b: Fixture of the second body.
        points: Contact points, world frame [m], shape (k, 2) with k from 0 to 2; none for sensors.
        normal: Unit normal from A to B, world frame, shape (2,).
        is_sensor: Whether one of the fixtures is a sensor, so that there is no response.
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
        """Finds the bodies that the physics engine speaks of.

        Args:
            bodies: The bodies of the world by the id of their physics body.
            info: What the physics engine reports.

        Returns:
            None when a plugin made one of the bodies in the physics world itself.
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
    """What the solver did to keep two fixtures apart in one step.

    Attributes:
        normal_impulses: Along the normal at each point [N s], shape (k,).
        tangent_impulses: Along the surface at each point [N s], shape (k,).
    """

    normal_impulses: DoubleArray
    tangent_impulses: DoubleArray


class MutableContact:
    """A contact about to be solved; only `pre_solve` gets one, only there it may be changed."""

    __slots__ = ("_raw", "body_a", "body_b", "fixture_a", "fixture_b")

    def __init__(
        self,
        raw: PreSolveContact,
        body_a: Body,
        body_b: Body,
        fixture_a: PhysicsFixture,
        fixture_b: PhysicsFixture,
    ) -> None:
        """Wraps what the physics engine hands over."""
        self._raw = raw
        self.body_a = body_a
        self.body_b = body_b
        self.fixture_a = fixture_a
        self.fixture_b = fixture_b

    @property
    def contact_id(self) -> int:
        """Number that belongs to this contact from `begin_contact` to `end_contact`."""
        return self._raw.contact_id

    @property
    def points(self) -> DoubleArray:
        """Contact points, world frame [m], shape (k, 2)."""
        return np.asarray(self._raw.points, dtype=np.float64)

    @property
    def normal(self) -> DoubleArray:
        """Unit normal from A to B, world frame, shape (2,)."""
        return np.asarray(self._raw.normal, dtype=np.float64)

    @property
    def enabled(self) -> bool:
        """Whether the contact pushes in this step; set False to let the bodies pass."""
        return self._raw.enabled

    @enabled.setter
    def enabled(self, value: bool) -> None:
        self._raw.enabled = value

    @property
    def friction(self) -> float:
        """Mixed friction of the two fixtures; a value set stays while they touch."""
        return self._raw.friction

    @friction.setter
    def friction(self, value: float) -> None:
        self._raw.friction = value

    @property
    def restitution(self) -> float:
        """Mixed restitution of the two fixtures; a value set stays while they touch."""
        return self._raw.restitution

    @restitution.setter
    def restitution(self, value: float) -> None:
        self._raw.restitution = value

    @property
    def tangent_speed(self) -> float:
        """Speed of the surface along the tangent [m/s], as of a conveyor belt."""
        return self._raw.tangent_speed

    @tangent_speed.setter
    def tangent_speed(self, value: float) -> None:
        self._raw.tangent_speed = value


@dataclass(frozen=True, slots=True, eq=False)
class ModelContact:
    """A contact seen from one model.

    Attributes:
        other_entity: The model or layer on the other side.
        this_body: Body of the model.
        other_body: Body of the other side.
        this_fixture: Fixture of the model.
        other_fixture: Fixture of the other side.
        is_a: Whether the model's body is the contact's body A, so that the contact's normal
            points away from it.
    """

    other_entity: Entity
    this_body: Body
    other_body: Body
    this_fixture: PhysicsFixture
    other_fixture: PhysicsFixture
    is_a: bool
