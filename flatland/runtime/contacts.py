"""Reports contacts to plugins: recorded after a step, or changed within it by `pre_solve`."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, Final

from flatland.entities.contact import Contact, ContactImpulse, MutableContact
from flatland.plugin_api.plugin import FlatlandPlugin, ModelPlugin, overrides

if TYPE_CHECKING:
    from flatland.entities.body import Body, Entity
    from flatland.physics import (
        ContactEvent,
        OldManifold,
        PhysicsBody,
        PhysicsWorld,
        PreSolveContact,
    )

# In the order of the kinds of events of `PhysicsWorld.record_contacts_of`.
CONTACT_HOOKS: Final = {"begin": "begin_contact", "end": "end_contact", "post_solve": "post_solve"}
_PRE_SOLVE: Final = "pre_solve"

HookList = list[tuple[FlatlandPlugin, Callable[..., None]]]


class ContactHook:
    """A contact hook of all plugins that override it: by model, and of those for all contacts."""

    def __init__(self, name: str) -> None:
        """Creates a hook without plugins.

        Args:
            name: Name of the hook.
        """
        self._name = name
        self._by_entity: dict[Entity, list[FlatlandPlugin]] = {}
        self._of_all: list[FlatlandPlugin] = []

    def __bool__(self) -> bool:
        """Returns whether any plugin overrides the hook."""
        return bool(self._by_entity or self._of_all)

    def add(self, plugin: FlatlandPlugin) -> None:
        """Adds a plugin if it overrides the hook."""
        if not overrides(plugin, self._name):
            return
        if isinstance(plugin, ModelPlugin) and not plugin.all_contacts:
            self._by_entity.setdefault(plugin.model, []).append(plugin)
        else:
            self._of_all.append(plugin)

    def remove(self, plugin: FlatlandPlugin) -> None:
        """Removes a plugin; one that was not added is ignored."""
        if plugin in self._of_all:
            self._of_all.remove(plugin)
        elif isinstance(plugin, ModelPlugin) and plugin in self._by_entity.get(plugin.model, ()):
            plugins = self._by_entity[plugin.model]
            plugins.remove(plugin)
            if not plugins:
                del self._by_entity[plugin.model]

    @property
    def concerns_all(self) -> bool:
        """Whether a plugin receives the contacts of all models."""
        return bool(self._of_all)

    def concerns(self, entity: Entity) -> bool:
        """Returns whether the contacts of a model or layer concern any plugin."""
        return bool(self._of_all) or entity in self._by_entity

    def between(
        self, entity_a: Entity, entity_b: Entity, order: Callable[[FlatlandPlugin], int]
    ) -> HookList:
        """Returns the plugins that a contact concerns with their methods, in order.

        Args:
            entity_a: Model or layer of one side.
            entity_b: Model or layer of the other side.
            order: Returns the place of a plugin in the order of hooks.
        """
        found = [*self._by_entity.get(entity_a, ())]
        if entity_b is not entity_a:
            found += self._by_entity.get(entity_b, ())
        found += self._of_all
        if len(found) > 1:
            found.sort(key=order)
        return [(plugin, getattr(plugin, self._name)) for plugin in found]


class ContactReporter:
    """Records the contacts of a physics world as far as plugins need them.

    Attributes:
        is_stale: Whether bodies or hooks have changed since the last `update`.
    """

    def __init__(
        self,
        physics: PhysicsWorld,
        call: Callable[..., None],
        order: Callable[[FlatlandPlugin], int],
    ) -> None:
        """Creates a reporter without bodies.

        Args:
            physics: The physics world.
            call: Calls a hook of a plugin, as `PluginHost.call`.
            order: Returns the place of a plugin in the order of hooks.
        """
        self._physics = physics
        self._call = call
        self._order = order
        self._hooks = {name: ContactHook(name) for name in (*CONTACT_HOOKS.values(), _PRE_SOLVE)}
        self._bodies: dict[int, Body] = {}
        self._is_recording = False
        self._recorded: set[int] = set()  # ids of the bodies whose contacts are recorded
        self.is_stale = True

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
        self.is_stale = True

    def remove_bodies(self, bodies: Iterable[Body]) -> None:
        """Reports the contacts of some bodies no longer; their ids may be stale."""
        for body in bodies:
            self._bodies.pop(body.id, None)
        self.is_stale = True

    def add_plugin(self, plugin: FlatlandPlugin) -> None:
        """Reports contacts to a plugin that overrides contact hooks."""
        for hook in self._hooks.values():
            hook.add(plugin)
        self.is_stale = True

    def remove_plugin(self, plugin: FlatlandPlugin) -> None:
        """Reports contacts to a plugin no longer."""
        for hook in self._hooks.values():
            hook.remove(plugin)
        self.is_stale = True

    def clear(self) -> None:
        """Forgets all bodies; for the end of the world."""
        self._bodies.clear()

    def find_body(self, physics_body: PhysicsBody) -> Body | None:
        """Returns the body of a model or layer by its physics body, None if it has no owner."""
        return self._bodies.get(physics_body.id)

    def update(self) -> None:
        """Adapts to changes of bodies and hooks; to be called before each step."""
        if not self.is_stale:
            return
        self.is_stale = False
        kinds: dict[int, int] = {}
        kinds_of_all = 0
        for number, name in enumerate(CONTACT_HOOKS.values()):
            hook = self._hooks[name]
            if hook.concerns_all:
                kinds_of_all |= 1 << number
            elif hook:
                for body_id in self._bodies_concerned(hook):
                    kinds[body_id] = kinds.get(body_id, 0) | 1 << number
        self._is_recording = bool(kinds_of_all) or any(
            self._hooks[name] for name in CONTACT_HOOKS.values()
        )
        self._physics.record_contacts_of_all(kinds_of_all)
        for body_id in self._recorded - kinds.keys():
            if self._physics.body(body_id).alive:
                self._physics.record_contacts_of(body_id, 0)
        for body_id, bits in kinds.items():
            if self._physics.body(body_id).alive:
                self._physics.record_contacts_of(body_id, bits)
        self._recorded = set(kinds)
        if self._hooks[_PRE_SOLVE]:
            self._physics.pre_solve = self._pre_solve
            self._physics.pre_solve_bodies = self._bodies_concerned(self._hooks[_PRE_SOLVE])
        else:
            self._physics.pre_solve = None

    def _bodies_concerned(self, hook: ContactHook) -> set[int]:
        return {body.id for body in self._bodies.values() if hook.concerns(body.entity)}

    def dispatch(self) -> None:
        """Passes the contacts recorded since the last call to the plugins that they concern."""
        if self._physics.pre_solve is not None:
            for error in self._physics.take_pre_solve_errors():
                # The host takes what plugins raise; this is a KeyboardInterrupt or the like.
                raise error
        if self._is_recording:
            for event in self._physics.take_contact_events():
                self._dispatch(event)

    def _dispatch(self, event: ContactEvent) -> None:
        body_a, body_b = self._bodies.get(event.body_a), self._bodies.get(event.body_b)
        if body_a is None or body_b is None:
            return  # A plugin created one of them in the physics world itself.
        name = CONTACT_HOOKS[event.kind]
        hooks = self._find(name, body_a, body_b)
        if not hooks:
            return
        arguments: list[Any] = [Contact.between(self._bodies, event)]
        if name == "post_solve":
            arguments.append(ContactImpulse(event.normal_impulses, event.tangent_impulses))
        for plugin, method in hooks:
            self._call(plugin, name, name, method, *arguments)

    def _find(self, name: str, body_a: Body, body_b: Body) -> HookList:
        return self._hooks[name].between(body_a.entity, body_b.entity, self._order)

    def _pre_solve(self, raw: PreSolveContact, old_manifold: OldManifold) -> None:
        body_a, body_b = self._bodies.get(raw.body_a), self._bodies.get(raw.body_b)
        if body_a is None or body_b is None:
            return
        fixtures = (body_a.fixture(raw.fixture_a), body_b.fixture(raw.fixture_b))
        contact = MutableContact(raw, body_a, body_b, *fixtures)
        for plugin, method in self._find(_PRE_SOLVE, body_a, body_b):
            self._call(plugin, _PRE_SOLVE, _PRE_SOLVE, method, contact, old_manifold)
