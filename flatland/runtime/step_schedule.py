"""Hooks that are called only when an update is due, and the handling of skipped updates."""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from flatland.errors import PLUGIN_FAULTS
from flatland.physics import TweenController
from flatland.plugin_api.schedule import HookSchedule, is_called_when_due
from flatland.plugin_api.update_timer import UpdateTimer

if TYPE_CHECKING:
    from flatland.physics import StepPlan
    from flatland.plugin_api.plugin import FlatlandPlugin
    from flatland.plugin_api.update_timer import UpdateClock
    from flatland.timekeeper import Timekeeper

FaultHandler = Callable[["FlatlandPlugin", str, BaseException], None]

_AFTER: Final = "after_physics_step"
_MOST_CLOCKS: Final = 60  # of the sets of due clocks, which are integers of 64 bits
_TOUCHING: Final = 1 << _MOST_CLOCKS  # a clock that is due in steps with contacts


@dataclass(slots=True, eq=False)
class ScheduledHook:
    """A hook that is called only when an update is due.

    Attributes:
        plugin: The plugin.
        name: Name of the hook.
        order: Place of the plugin in the order of hooks.
        clock: Number of the clock of the core.
        bits: Clocks in whose steps the hook is called, as bits.
        records: Records of the updates without a call, one for each body whose pose is recorded;
            empty if the skipped updates need no handling.
        is_called: Whether the hook is called when an update is due.
        was_called: Whether it was called at least once, or at least is no longer to be.
    """

    plugin: FlatlandPlugin
    name: str
    order: int
    clock: int
    bits: int
    records: tuple[int, ...] = ()
    is_called: bool = True
    was_called: bool = False

    @property
    def schedule(self) -> HookSchedule:
        """The latest schedule that the plugin has declared."""
        return self.plugin._schedules[self.name]


@dataclass(slots=True)
class _Phase:
    """The hooks and the work of the core before or after the physics step."""

    hooks: dict[FlatlandPlugin, ScheduledHook] = field(default_factory=dict)
    orders: list[int] = field(default_factory=list)  # of the work of the core, ascending


class StepSchedule:
    """Decides for each step which hooks are called; the core does the rest.

    Attributes:
        version: Changes when other hooks are to be called.
        targets: Functions of plugins that pass new commands to the core; called before the next
            step, and appended from any thread.
    """

    def __init__(self, plan: StepPlan, timekeeper: Timekeeper, on_fault: FaultHandler) -> None:
        """Creates a schedule without hooks.

        Args:
            plan: The plan of the core.
            timekeeper: The simulated time.
            on_fault: Called as `on_fault(plugin, what, error)` with exceptions of plugins.
        """
        self._on_fault = on_fault
        self._plan = plan
        self._timekeeper = timekeeper
        self._clocks: dict[tuple[bool, UpdateClock], int] = {}
        self._phases = {"before_physics_step": _Phase(), _AFTER: _Phase()}
        self._records: dict[int, ScheduledHook] = {}
        self._is_stale = False
        self._new: list[ScheduledHook] = []  # not called yet
        self._transforms_wanted = False
        self._touching = 0  # hooks that are called in steps with contacts
        self.version = 0
        self.targets: deque[tuple[FlatlandPlugin, Callable[[], None]]] = deque()

    # -- hooks -----------------------------------------------------------------------------

    def add(self, plugin: FlatlandPlugin, hook: str, order: int) -> ScheduledHook | None:
        """Adds a hook of a plugin if it is to be called only when an update is due.

        Returns:
            The scheduled hook; None if the hook is to be called in every step.
        """
        asked: HookSchedule | None = getattr(plugin, "_schedules", {}).get(hook)
        if asked is None or not is_called_when_due(getattr(plugin, hook)):
            return None
        clock = self._clock(asked.timer, hook == _AFTER)
        if clock is None:
            return None
        found = ScheduledHook(plugin, hook, order, clock, 1 << clock)
        if asked.calls_at_touches:
            found.bits |= _TOUCHING
        if asked.skipped is not None or asked.touches is not None:
            touches_id = None if asked.touches is None else asked.touches.id
            body_ids: Sequence[int | None] = [body.id for body in asked.bodies] or [None]
            found.records = tuple(
                self._plan.add_record(clock, order, body_id, touches_id) for body_id in body_ids
            )
            self._records.update(dict.fromkeys(found.records, found))
        self._set_called(found, True)
        phase = self._phases[hook]
        phase.hooks[plugin] = found
        self._new.append(found)
        self._changed(phase)
        return found

    def add_controllers(self, plugin: FlatlandPlugin, order: int) -> None:
        """Schedules the controllers of a plugin in the core."""
        before, after = self._phases["before_physics_step"], self._phases[_AFTER]
        for controller in getattr(plugin, "_controllers", ()):
            controller.schedule(
                order, automatic=plugin in before.hooks, holds=plugin in after.hooks
            )
        self._changed(before)
        self._changed(after)

    def _clock(self, timer: UpdateTimer, is_after: bool) -> int | None:
        kind = type(timer)
        if kind.check_update is not UpdateTimer.check_update and kind.clock is UpdateTimer.clock:
            return None
        clock = timer.clock(self._timekeeper.step_size_ns)
        if clock is None:
            return None
        number = self._clocks.get((is_after, clock))
        if number is None and len(self._clocks) < _MOST_CLOCKS:
            number = self._clocks[is_after, clock] = self._plan.add_clock(is_after, *clock)
        return number

    def remove(self, plugin: FlatlandPlugin) -> None:
        """Removes the hooks and the controllers of a plugin."""
        self.settle()
        for phase in self._phases.values():
            hook = phase.hooks.pop(plugin, None)
            if hook is None:
                continue
            if hook.is_called:
                self._set_called(hook, False)
            for record in hook.records:
                del self._records[record]
                self._plan.remove_record(record)
            self._new = [other for other in self._new if other is not hook]
            self._changed(phase)
        for controller in getattr(plugin, "_controllers", ()):
            if controller.alive:
                controller.remove()
        self._drop_targets(plugin)

    def _drop_targets(self, plugin: FlatlandPlugin) -> None:
        """Drops commands that were set since the last step; other threads may add more."""
        for _ in range(len(self.targets)):
            entry = self.targets.popleft()
            if entry[0] is not plugin:
                self.targets.append(entry)

    def _changed(self, phase: _Phase) -> None:
        phase.orders.clear()
        self._is_stale = True

    def find(self, plugin: FlatlandPlugin, hook: str) -> ScheduledHook | None:
        """Returns the scheduled hook of a plugin, None if it is called in every step."""
        return self._phases[hook].hooks.get(plugin)

    @property
    def moves_bodies(self) -> bool:
        """Whether the core moves bodies before the physics step, besides setting velocities."""
        return any(
            isinstance(controller, TweenController)
            for plugin in self._phases["before_physics_step"].hooks
            for controller in plugin._controllers
        )

    def work_orders(self, hook: str) -> list[int]:
        """Returns the places of the plugins for which the core has work, ascending."""
        phase = self._phases[hook]
        if not phase.orders:
            phase.orders += sorted(self._orders(phase))
        return phase.orders

    def _orders(self, phase: _Phase) -> Iterator[int]:
        for plugin, hook in phase.hooks.items():
            if hook.records or plugin._controllers:
                yield hook.order

    # -- which hooks are called ------------------------------------------------------------

    def change(self) -> None:
        """Schedules a new decision about the hooks; safe from any thread."""
        self._is_stale = True
        self._plan.interrupt()

    def refresh(self, transforms_wanted: bool) -> None:
        """Decides which hooks are called when an update is due; called before each step.

        Args:
            transforms_wanted: Whether an observer wants transforms.
        """
        if transforms_wanted != self._transforms_wanted:
            self._transforms_wanted = transforms_wanted
            self._is_stale = True
        if self._is_stale:
            self._is_stale = False
            self._decide()

    def _decide(self) -> None:
        calls: Counter[int] = Counter()
        for phase in self._phases.values():
            for hook in phase.hooks.values():
                is_called = self._is_wanted(hook)
                if is_called != hook.is_called:
                    self._set_called(hook, is_called)
                calls[hook.clock] += is_called
        for clock in self._clocks.values():
            self._plan.set_calls(clock, calls[clock] > 0)
        self.version += 1

    def _is_wanted(self, hook: ScheduledHook) -> bool:
        asked = hook.schedule
        if not hook.was_called or asked.outputs is None:
            return True
        if asked.transforms and self._transforms_wanted:
            return True
        return any(output.wanted for output in asked.outputs)

    def _set_called(self, hook: ScheduledHook, is_called: bool) -> None:
        if hook.records and is_called and not hook.is_called:
            self.settle()
        for record in hook.records:
            self._plan.enable_record(record, not is_called)
        if hook.bits & _TOUCHING and hook.schedule.touches is not None:
            hook.schedule.touches.end_runs(is_called)
            self._touching += 1 if is_called else -1
        hook.is_called = is_called

    def call_all(self) -> int:
        """Calls all hooks in this step, for a time that is not a multiple of the step size.

        Returns:
            All clocks, as bits.
        """
        self._is_stale = True
        for phase in self._phases.values():
            for hook in phase.hooks.values():
                hook.was_called = False
                if not hook.is_called:
                    self._set_called(hook, True)
                if hook not in self._new:
                    self._new.append(hook)
        self.version += 1
        return (1 << _MOST_CLOCKS) - 1

    def with_contacts(self, due: int) -> int:
        """Returns the clocks that are due after a physics step, including that of contacts."""
        return due | _TOUCHING if self._touching and self._plan.has_touches() else due

    def calls_made(self, due: int) -> None:
        """Records that all hooks of a step were called.

        Args:
            due: The clocks that were due, as bits.
        """
        if not self._new:
            return
        waiting = []
        for hook in self._new:
            if due & hook.bits:
                hook.was_called = True
                self._is_stale = True
            else:
                waiting.append(hook)
        self._new = waiting

    # -- skipped updates --------------------------------------------------------------------

    def settle(self) -> None:
        """Reports skipped updates to the plugins, in the order of the hooks."""
        if not self._records:
            return
        step_size_ns = self._timekeeper.step_size_ns
        taken = {
            record: (count, step, pose) for record, count, step, pose in self._plan.take_skipped()
        }
        hooks = dict.fromkeys(self._records[record] for record in taken)
        for hook in sorted(hooks, key=lambda each: each.order):
            asked = hook.schedule
            if asked.skipped is None:
                continue
            updates = [taken[record] for record in hook.records]
            count, step, _ = updates[0]
            poses = tuple(pose for *_, pose in updates) if asked.bodies else ()
            try:
                asked.skipped(count, step * step_size_ns, poses)
            except PLUGIN_FAULTS as error:
                self._on_fault(hook.plugin, hook.name, error)

    def push_targets(self) -> None:
        """Passes new commands to the core."""
        targets = self.targets
        while targets:
            plugin, target = targets.popleft()
            try:
                target()
            except PLUGIN_FAULTS as error:
                self._on_fault(plugin, "before_physics_step", error)

    def set_later(self, plugin: FlatlandPlugin, target: Callable[[], None]) -> None:
        """Calls a function of a plugin before the next step; safe from any thread."""
        self.targets.append((plugin, target))
        self._plan.interrupt()


def needs_work(orders: list[int], after: int, until: int) -> bool:
    """Returns whether the core has work for a place of at least `after` and less than `until`."""
    index = bisect_left(orders, after)
    return index < len(orders) and orders[index] < until
