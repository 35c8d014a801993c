"""Reports contacts to plugins: recorded after a step, or changed within it by `pre_solve`."""

from __future__ import annotations

from collections.abc import Iterable, Set
from typing import TYPE_CHECKING

from flatland.entities.contact import Contact

if TYPE_CHECKING:
    from flatland.entities.body import Body
    from flatland.physics import OldManifold, PhysicsBody, PhysicsWorld, PreSolveContact
    from flatland.runtime.plugin_host import PluginHost


class ContactReporter:
    """Records the contacts of a physics world as far as plugins need them."""

    def __init__(self, physics: PhysicsWorld, host: PluginHost) -> None:
        """Creates a reporter without bodies.

        Args:
            physics: The physics world.
            host: Calls the hooks of plugins.
        """
        self._physics = physics
        self._host = host
        self._hooks = host.hooks
        self._bodies: dict[int, Body] = {}
        self._is_recording = False
        self._recorded: Set[int] = frozenset()  # ids of the bodies whose contacts are recorded
        self._hooks_version = -1  # of the hooks that recording is adapted to

    @property
    def touching(self) -> list[Contact]:
        """All pairs of fixtures that touch now."""
        found = (Contact.between(self._bodies, info) for info in self._physics.contacts())
        return [contact for contact in found if contact is not None]

    def add_bodies(self, bodies: Iterable[Body]) -> None:
        """Reports the contacts of some bodies."""
        bodies = list(bodies)
        self._physics.own_bodies(bodies, True)
        self._bodies.update((body.id, body) for body in bodies)
        self._hooks_version = -1

    def remove_bodies(self, bodies: Iterable[Body]) -> None:
        """Reports the contacts of some bodies no longer; their ids may be stale."""
        for body in bodies:
            self._bodies.pop(body.id, None)
        self._hooks_version = -1

    def clear(self) -> None:
        """Forgets all bodies; for the end of the world."""
        self._bodies.clear()

    def find_body(self, physics_body: PhysicsBody) -> Body | None:
        """Returns the body of a model or layer by its physics body, None if it has no owner."""
        return self._bodies.get(physics_body.id)

    def update(self) -> None:
        """Adapts to changes of bodies and hooks; to be called before each step."""
        if self._hooks_version == self._hooks.version:
            return
        self._hooks_version = self._hooks.version
        self._is_recording = self._host.wants_contacts
        kinds, kinds_of_all = self._host.contact_kinds(self._bodies.values())
        self._physics.record_contacts_of_all(kinds_of_all)
        for body_id in self._recorded - kinds.keys():
            if self._physics.body(body_id).alive:
                self._physics.record_contacts_of(body_id, 0)
        for body_id, bits in kinds.items():
            if self._physics.body(body_id).alive:
                self._physics.record_contacts_of(body_id, bits)
        self._recorded = kinds.keys()
        if self._host.wants_pre_solve:
            self._physics.pre_solve = self._pre_solve
            self._physics.pre_solve_bodies = self._host.pre_solve_bodies(self._bodies)
        else:
            self._physics.pre_solve = None

    def dispatch(self) -> None:
        """Passes the contacts recorded since the last call to the plugins."""
        if self._physics.pre_solve is not None:
            for error in self._physics.take_pre_solve_errors():
                # The host takes what plugins raise; this is a KeyboardInterrupt or the like.
                raise error
        if self._is_recording:
            self._host.dispatch_contacts(self._physics.take_contact_events(), self._bodies)

    def _pre_solve(self, contact: PreSolveContact, old_manifold: OldManifold) -> None:
        self._host.pre_solve(contact, old_manifold, self._bodies)
