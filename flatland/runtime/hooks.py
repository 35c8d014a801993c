"""The hooks of all plugins, and the contacts that concern them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Final, NamedTuple

from flatland.plugin_api.plugin import FlatlandPlugin, ModelPlugin
from flatland.plugin_api.schedule import HookBatch, batch_of, not_called
from flatland.runtime.step_schedule import needs_work

if TYPE_CHECKING:
    from flatland.entities.body import Body, Entity
    from flatland.entities.model import Model
    from flatland.runtime.step_schedule import StepSchedule

STEP_HOOKS: Final = ("before_physics_step", "after_physics_step")
CONTACT_HOOKS: Final = ("begin_contact", "end_contact", "post_solve")
_MOST_LISTS: Final = 64  # of calls for different sets of clocks

Hook = Callable[..., None]
HookWrapper = Callable[[FlatlandPlugin, Hook], Hook]
HookList = list[tuple[FlatlandPlugin, Hook]]


class StepCall(NamedTuple):
    """A call of a hook in a step, or of the parts of the hooks of several plugins.

    Attributes:
        plugin: The plugin.
        hook: Its method.
        until: The place of the plugin in the order of hooks if the core has work before the call,
            else 0.
        batch: The parts of the hook if it is called together with others.
        members: The calls that are performed together, including this one; empty for a single
            call.
    """

    plugin: FlatlandPlugin
    hook: Hook
    until: int
    batch: HookBatch | None = None
    members: tuple[StepCall, ...] = ()


def overrides(plugin: FlatlandPlugin, hook: str) -> bool:
    """Returns whether a plugin's class, or the plugin itself, overrides a hook."""
    own = vars(plugin).get(hook)
    if own is not None:
        return own is not not_called
    return getattr(type(plugin), hook) is not getattr(FlatlandPlugin, hook)


class HookTable:
    """The overridden hooks of all plugins.

    Hooks are called in the order of loading, those of model plugins before those of world
    plugins. Adding or removing a plugin takes constant time; the order is made when it is next
    needed, so that loading n plugins takes time proportional to n.

    Attributes:
        version: Changes with each plugin that is added or removed.
    """

    def __init__(self, schedule: StepSchedule | None = None) -> None:
        """Creates an empty table.

        Args:
            schedule: Decides which hooks are called only when an update is due; None if none are.
        """
        self._schedule = schedule
        self._calls: dict[tuple[str, int], list[StepCall]] = {}
        self._unscheduled = (-1, False)  # version, and whether a hook is called in every step
        self._calls_version = (-1, -1)  # of this table and of the schedule
        self._order: dict[FlatlandPlugin, int] = {}
        self._count = 0
        self._wrap: HookWrapper | None = None
        self.version = 0
        self._model_hooks: dict[str, dict[FlatlandPlugin, Hook]] = {h: {} for h in STEP_HOOKS}
        self._world_hooks: dict[str, dict[FlatlandPlugin, Hook]] = {h: {} for h in STEP_HOOKS}
        self._ordered: dict[str, HookList] = {}
        self._contact_hooks = {h: _ContactHooks(self._order) for h in (*CONTACT_HOOKS, "pre_solve")}

    def add(self, plugin: FlatlandPlugin) -> None:
        """Adds the hooks that a plugin overrides."""
        self._count += 1
        self.version += 1
        is_of_model = isinstance(plugin, ModelPlugin)
        # World plugins come last.
        self._order[plugin] = self._count if is_of_model else self._count + (1 << 62)
        self._add_hooks(plugin, schedules=True)

    def _add_hooks(self, plugin: FlatlandPlugin, *, schedules: bool) -> None:
        hooks = self._model_hooks if isinstance(plugin, ModelPlugin) else self._world_hooks
        for hook in STEP_HOOKS:
            if overrides(plugin, hook):
                hooks[hook][plugin] = self._method(plugin, hook)
                self._ordered.pop(hook, None)
                if schedules and self._schedule is not None:
                    self._schedule.add(plugin, hook, self._order[plugin])
        if schedules and self._schedule is not None:
            self._schedule.add_controllers(plugin, self._order[plugin])
        for hook, table in self._contact_hooks.items():
            if overrides(plugin, hook):
                table.add(plugin, self._method(plugin, hook))

    def _method(self, plugin: FlatlandPlugin, hook: str) -> Hook:
        method: Hook = getattr(plugin, hook)
        return method if self._wrap is None else self._wrap(plugin, method)

    def wrap(self, wrapper: HookWrapper | None) -> None:
        """Wraps all hooks, also those of plugins added later; None unwraps them."""
        self._wrap = wrapper
        self.version += 1
        for plugin in self._order:
            self._add_hooks(plugin, schedules=False)

    def remove(self, plugin: FlatlandPlugin) -> None:
        """Removes the hooks of a plugin; one without hooks is ignored."""
        self.version += 1
        for hook in STEP_HOOKS:
            for hooks in (self._model_hooks, self._world_hooks):
                if hooks[hook].pop(plugin, None) is not None:
                    self._ordered.pop(hook, None)
        for table in self._contact_hooks.values():
            table.remove(plugin)
        if self._schedule is not None:
            self._schedule.remove(plugin)
        self._order.pop(plugin, None)

    def of_step(self, hook: str) -> HookList:
        """Returns a hook of all plugins in order; the list is not changed afterwards."""
        ordered = self._ordered.get(hook)
        if ordered is None:
            ordered = [*self._model_hooks[hook].items(), *self._world_hooks[hook].items()]
            self._ordered[hook] = ordered
        return ordered

    def calls(self, hook: str, due: int) -> list[StepCall]:
        """Returns the calls of a hook in a step, in order; the list is not changed afterwards.

        Args:
            hook: Name of the hook.
            due: The clocks of updates that are due, as bits.
        """
        schedule = self._schedule
        version = (self.version, 0 if schedule is None else schedule.version)
        if version != self._calls_version:
            self._calls_version = version
            self._calls.clear()
        found = self._calls.get((hook, due))
        if found is None:
            if len(self._calls) >= _MOST_LISTS:
                self._calls.clear()
            found = self._calls[hook, due] = self._in_batches(self._find_calls(hook, due))
        return found

    def _find_calls(self, hook: str, due: int) -> Iterator[StepCall]:
        schedule = self._schedule
        orders = [] if schedule is None else schedule.work_orders(hook)
        done = 0
        for plugin, method in self.of_step(hook):
            scheduled = None if schedule is None else schedule.find(plugin, hook)
            if scheduled is not None and not (scheduled.is_called and due & scheduled.bits):
                continue
            order = self._order[plugin]
            yield StepCall(plugin, method, order if needs_work(orders, done, order) else 0)
            done = order

    def _in_batches(self, calls: Iterator[StepCall]) -> list[StepCall]:
        """Joins successive calls of hooks that allow it."""
        joined: list[StepCall] = []
        for call in calls:
            last = joined[-1] if joined else None
            batch = None if self._wrap is not None else batch_of(call.hook)
            if batch is None or last is None or last.batch != batch or self._moves_body(call):
                joined.append(call._replace(batch=batch))
            else:
                joined[-1] = last._replace(members=(*(last.members or (last,)), call))
        return joined

    def _moves_body(self, call: StepCall) -> bool:
        """Returns whether the core may move bodies, not only set velocities, before a call."""
        return bool(call.until) and self._schedule is not None and self._schedule.moves_bodies

    @property
    def has_unscheduled(self) -> bool:
        """Whether any hook is to be called in every step."""
        if self._unscheduled[0] != self.version:
            found = any(
                self._schedule is None or self._schedule.find(plugin, hook) is None
                for hook in STEP_HOOKS
                for plugin, _ in self.of_step(hook)
            )
            self._unscheduled = (self.version, found)
        return self._unscheduled[1]

    def of_contact(self, hook: str, body_a: Body, body_b: Body) -> HookList:
        """Returns a contact hook of the plugins that a contact concerns, in order."""
        return self._contact_hooks[hook].between(body_a.entity, body_b.entity)

    def of_move(self, model: Model) -> HookList:
        """Returns the hook `model_moved` of the plugins of a model and of its followers.

        Plugins that are disabled or have ended are omitted.
        """
        plugins = (*model.plugins, *model.followers)
        return [(plugin, plugin.model_moved) for plugin in plugins if plugin in self._order]

    def has_any(self, *hooks: str) -> bool:
        """Returns whether any plugin overrides one of some contact hooks."""
        return any(self._contact_hooks[hook] for hook in hooks)

    def concern_all(self, hook: str) -> bool:
        """Returns whether a contact hook of a plugin receives the contacts of all models."""
        return self._contact_hooks[hook].concern_all

    def bodies_concerned(self, hook: str, bodies: Iterable[Body]) -> Iterator[Body]:
        """Returns those of some bodies whose contacts concern a plugin with a contact hook."""
        table = self._contact_hooks[hook]
        return (body for body in bodies if table.concerns(body.entity))


class _ContactHooks:
    """One contact hook: of model plugins by model, and of those that get the contacts of all."""

    def __init__(self, order: dict[FlatlandPlugin, int]) -> None:
        self._order = order
        self._by_entity: dict[Entity, dict[FlatlandPlugin, Hook]] = {}
        self._of_all: dict[FlatlandPlugin, Hook] = {}

    def __bool__(self) -> bool:
        return bool(self._by_entity or self._of_all)

    def add(self, plugin: FlatlandPlugin, hook: Hook) -> None:
        if isinstance(plugin, ModelPlugin) and not plugin.all_contacts:
            self._by_entity.setdefault(plugin.model, {})[plugin] = hook
        else:
            self._of_all[plugin] = hook

    def remove(self, plugin: FlatlandPlugin) -> None:
        self._of_all.pop(plugin, None)
        if isinstance(plugin, ModelPlugin):
            hooks = self._by_entity.get(plugin.model)
            if hooks is not None and hooks.pop(plugin, None) is not None and not hooks:
                del self._by_entity[plugin.model]

    @property
    def concern_all(self) -> bool:
        return bool(self._of_all)

    def concerns(self, entity: Entity) -> bool:
        return bool(self._of_all) or entity in self._by_entity

    def between(self, entity_a: Entity, entity_b: Entity) -> HookList:
        found: HookList = [*self._by_entity.get(entity_a, {}).items()]
        if entity_b is not entity_a:
            found += self._by_entity.get(entity_b, {}).items()
        found += self._of_all.items()
        if len(found) > 1:
            found.sort(key=lambda item: self._order[item[0]])
        return found
