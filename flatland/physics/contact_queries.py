"""Contacts of the physics world: events, current contacts, and those of some bodies."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, cast

from flatland import _core
from flatland.physics.contact import ContactEvent, ContactInfo, to_events, to_infos
from flatland.physics.touches import Touches

if TYPE_CHECKING:
    from flatland.physics.body import PhysicsBody
    from flatland.physics.world import PhysicsWorld


class ContactQueries:
    """The contacts of a `PhysicsWorld`, which is derived from this class."""

    __slots__ = ()

    _core: _core.World

    @property
    def record_contacts(self) -> bool:
        """Whether steps record contact events; settable."""
        return self._core.record_contacts

    @record_contacts.setter
    def record_contacts(self, record: bool) -> None:
        self._core.record_contacts = record

    def take_contact_events(self) -> list[ContactEvent]:
        """Returns the contact events since the last call, in order.

        Raises:
            StaleHandleError: The world is closed.
            WorldLockedError: The world is stepping.
        """
        columns = self._core.take_contact_rows()
        return [] if columns is None else to_events(columns)

    def record_contacts_of(self, body_id: int, kinds: int) -> None:
        """Records the contact events of one body, besides those of others.

        Args:
            body_id: The body.
            kinds: 1 for `begin`, 2 for `end`, 4 for `post_solve`, or a sum of them; 0 for none.
        """
        self._core.record_body_contacts(body_id, kinds)

    def record_contacts_of_all(self, kinds: int) -> None:
        """Records the contact events of some kinds of all bodies; see `record_contacts_of`."""
        self._core.record_all_contacts(kinds)

    def own_bodies(self, bodies: Iterable[PhysicsBody], are_owned: bool) -> None:
        """Sets whether bodies belong to a model or a layer; others are ignored by `Touches`."""
        self._core.own_bodies([body.id for body in bodies], are_owned)

    def collect_touches(
        self,
        bodies: Iterable[PhysicsBody],
        *,
        exclude: Iterable[PhysicsBody] = (),
        sensors: bool = True,
        own: bool = True,
    ) -> Touches:
        """Collects the contacts of bodies with bodies of models and layers.

        Args:
            bodies: The bodies.
            exclude: Bodies whose contacts are ignored.
            sensors: Whether to collect contacts with sensors, which have no effect on bodies.
            own: Whether to collect contacts between two of the bodies.

        Returns:
            The contacts, also those that exist already.

        Raises:
            StaleHandleError: A body was destroyed.
            WorldLockedError: The world is stepping.
        """
        touches = self._core.add_touches(
            [body.id for body in bodies], [body.id for body in exclude], sensors, own
        )
        return Touches(cast("PhysicsWorld", self), touches)

    def contacts(self) -> list[ContactInfo]:
        """Returns the contacts of all fixtures that currently touch.

        Raises:
            StaleHandleError: The world is closed.
            WorldLockedError: The world is stepping.
        """
        columns = self._core.touching_rows()
        return [] if columns is None else to_infos(columns)
