"""The jobs of all plugins: what the core does or has called in each step, in order."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Container, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from threading import get_ident
from typing import TYPE_CHECKING, Any

from flatland.errors import PLUGIN_FAULTS
from flatland.physics import Controller, Crowd
from flatland.plugin_api.plugin import FlatlandPlugin, ModelPlugin
from flatland.plugin_api.updates import STEP_HOOKS, Update

if TYPE_CHECKING:
    from flatland.physics import JobQueue
    from flatland.runtime.faults import Faults
    from flatland.timekeeper import Timekeeper

Call = Callable[..., None]
LaterCall = tuple[FlatlandPlugin, Callable[[], None]]

_AFTER_MODELS = 1 << 62  # added to the orders of world plugins


@dataclass(slots=True, eq=False)
class Job:
    """An update of a plugin in the queue of the core.

    Attributes:
        plugin: The plugin.
        update: What the plugin has declared.
        id: Id of the callback in the queue.
        is_called: Whether the function is called when an update is due.
        was_called: Whether it was called at least once.
    """

    plugin: FlatlandPlugin
    update: Update
    id: int
    is_called: bool = True
    was_called: bool = False


class Jobs:
    """The updates and controllers of plugins, in the order in which the plugins were loaded.

    Those of model plugins precede those of world plugins. The queue of the core (`JobQueue`) has
    one callback for each update, and decides when it is due. This class decides whether its result
    is wanted, and calls the functions. Jobs are added and removed between two steps only.
    """

    def __init__(
        self,
        queue: JobQueue,
        timekeeper: Timekeeper,
        call: Call,
        faults: Faults,
        disabled: Container[FlatlandPlugin],
        in_hook: Callable[[], AbstractContextManager[None]],
    ) -> None:
        """Creates jobs without plugins.

        Args:
            queue: The queue of the core.
            timekeeper: The simulated time.
            call: Calls a function of a plugin and takes what it raises, see `PluginHost.call`.
            faults: The counts of exceptions.
            disabled: The plugins whose functions are not called any more.
            in_hook: Returns a block in which hooks of plugins run.
        """
        self._queue = queue
        self._timekeeper = timekeeper
        self._call = call
        self._faults = faults
        self._disabled = disabled
        self._in_hook = in_hook
        self._order: dict[FlatlandPlugin, int] = {}
        self._count = 0
        self._jobs: dict[int, Job] = {}
        self._controllers: dict[int, FlatlandPlugin] = {}
        # Simulated time of the last failure of controllers, before or after the physics step [ns].
        self._failures: dict[tuple[int, bool], int] = {}
        # By the function `prepare` of updates: the number of the group and of its updates.
        self._groups: dict[Callable[..., object], tuple[int, int]] = {}
        self._last_group = 0
        self._is_stale = False
        self._transforms_wanted = False
        self._later: deque[LaterCall] = deque()
        # Those that were added by a function of `_later`, and the thread that calls these now.
        self._repeated: deque[LaterCall] = deque()
        self._is_repeated_due = True
        self._caller = 0

    # -- plugins ---------------------------------------------------------------------------

    def add(self, plugin: FlatlandPlugin) -> None:
        """Adds the jobs of a plugin, which comes after those of its kind that were added before."""
        self._count += 1
        order = self._count + (0 if isinstance(plugin, ModelPlugin) else _AFTER_MODELS)
        self._order[plugin] = order
        plugin._declare_hooks()
        for number, job in enumerate(plugin._jobs):
            if isinstance(job, Update):
                self._add_update(plugin, job, (order, number))
            else:
                job.set_place(order, number)
                if isinstance(job, Controller):
                    self._controllers[job.id] = plugin
        self._is_stale = True

    def _add_update(self, plugin: FlatlandPlugin, update: Update, place: tuple[int, int]) -> None:
        group, touches = 0, update.touches
        if update.prepare is not None:
            group, users = self._groups.get(update.prepare, (self._last_group + 1, 0))
            self._last_group = max(self._last_group, group)
        callback = self._queue.add_callback(
            place,
            update.timer.clock(self._timekeeper.step_size_ns),
            is_after=update.phase == "after",
            group=group,
            is_counted=update.skipped is not None or touches is not None,
            bodies=update.bodies,
            touches=touches,
            is_at_touches=update.at_touches,
        )
        update.on_change = self.change
        self._jobs[callback] = Job(plugin, update, callback)
        if update.prepare is not None:
            self._groups[update.prepare] = group, users + 1

    def remove(self, plugin: FlatlandPlugin) -> None:
        """Removes the jobs of a plugin, also those that could only partly be added; idempotent."""
        if plugin in self._order:
            self.settle()
            del self._order[plugin]
            for job in [job for job in self._jobs.values() if job.plugin is plugin]:
                del self._jobs[job.id]
                self._queue.remove_callback(job.id)
                if job.update.prepare is not None:
                    self._leave_group(job.update.prepare)
        for declared in plugin._jobs:
            if isinstance(declared, Controller | Crowd):
                self._controllers.pop(declared.id, None)
                for is_after in (False, True):
                    self._failures.pop((declared.id, is_after), None)
                if declared.alive:
                    declared.remove()
        for later in (self._later, self._repeated):
            # Other threads may add more meanwhile.
            for _ in range(len(later)):
                entry = later.popleft()
                if entry[0] is not plugin:
                    later.append(entry)

    def _leave_group(self, prepare: Callable[..., object]) -> None:
        group, users = self._groups.pop(prepare)
        if users > 1:
            self._groups[prepare] = group, users - 1

    def __contains__(self, plugin: FlatlandPlugin) -> bool:
        """Returns whether a plugin was added and not removed."""
        return plugin in self._order

    def order(self, plugin: FlatlandPlugin) -> int:
        """Returns the place of a plugin in the order of hooks."""
        return self._order[plugin]

    # -- which updates are wanted ----------------------------------------------------------

    def change(self) -> None:
        """Makes the next step find out which updates are wanted; safe from any thread."""
        self._is_stale = True
        self._queue.interrupt()

    def omit_first_calls(self, plugins: Container[FlatlandPlugin]) -> None:
        """Treats the first updates of plugins like later ones, which are called only if wanted.

        To be called before the first step, for plugins whose functions do for an update that is
        not wanted what `skipped` does, or nothing.

        Args:
            plugins: The plugins.
        """
        for job in self._jobs.values():
            if job.plugin in plugins:
                job.was_called = True

    def is_current(self, transforms_wanted: bool) -> bool:
        """Returns whether `refresh` has nothing to do for the next step."""
        has_calls = self._later or self._repeated
        return not (self._is_stale or has_calls or transforms_wanted != self._transforms_wanted)

    def refresh(self, transforms_wanted: bool) -> bool:
        """Prepares the next step: passes new commands, and finds out which updates are wanted.

        Args:
            transforms_wanted: Whether an observer wants transforms.

        Returns:
            Whether functions are to be called again before the step after the next one.
        """
        if self._is_stale or transforms_wanted != self._transforms_wanted:
            self._is_stale = False
            self._transforms_wanted = transforms_wanted
            for job in self._jobs.values():
                # The first update is always called.
                is_called = not job.was_called or job.update.is_wanted(transforms_wanted)
                if is_called != job.is_called:
                    if is_called:
                        self.settle()
                    job.is_called = is_called
                    self._queue.set_called(job.id, is_called)
        if not self._later and not self._repeated:
            return False
        if self._is_repeated_due:
            self._later.extend(self._repeated)
            self._repeated.clear()
        self._is_repeated_due = True
        self.call_later()
        return bool(self._repeated)

    def keep_repeated(self) -> None:
        """Has the next `refresh` prepare the same step as the last one."""
        self._is_repeated_due = False

    def settle(self) -> None:
        """Reports updates without a call to the plugins, in order."""
        if not self._jobs:
            return
        skipped = {self._jobs[row[0]]: row for row in self._queue.take_skipped()}
        if not skipped:
            return
        with self._in_hook():
            for job in sorted(skipped, key=lambda job: self._order[job.plugin]):
                callback, *arguments = skipped[job]
                update = job.update
                if update.skipped is not None:
                    hook, source = STEP_HOOKS[update.phase], (callback, "skipped")
                    self._call(job.plugin, hook, source, update.skipped, *arguments)

    # -- calls -----------------------------------------------------------------------------

    def set_later(self, plugin: FlatlandPlugin, function: Callable[[], None]) -> None:
        """Calls a function of a plugin before the next step; safe from any thread.

        If a function that `call_later` calls uses this, that is the step after the one that is
        being prepared.
        """
        if self._caller and self._caller == get_ident():
            self._repeated.append((plugin, function))
            return
        self._later.append((plugin, function))
        self._queue.interrupt()

    def call_later(self) -> None:
        """Calls the functions that were passed to `set_later`, once each."""
        later, call, hook = self._later, self._call, STEP_HOOKS["before"]
        self._caller = get_ident()
        try:
            for _ in range(len(later)):
                plugin, function = later.popleft()
                call(plugin, hook, function, function)
        finally:
            self._caller = 0

    def call(self, callbacks: Sequence[int], *, one_by_one: bool) -> None:
        """Calls the functions of updates that are due.

        Args:
            callbacks: Ids of their callbacks, in order.
            one_by_one: Whether no update is to be prepared together with others.
        """
        timekeeper, call = self._timekeeper, self._call
        if len(callbacks) > 1 and self._groups and not one_by_one:
            self._prepare(callbacks)
        for callback in callbacks:
            job = self._jobs[callback]
            update = job.update
            call(job.plugin, STEP_HOOKS[update.phase], callback, update.function, timekeeper)
            if not job.was_called:
                job.was_called = self._is_stale = True
            if self._later:
                self.call_later()

    def _prepare(self, callbacks: Sequence[int]) -> None:
        """Prepares each group of successive updates.

        Errors are ignored: each of the functions does the work itself, and raises.
        """
        for prepare, plugins in self._groups_of(callbacks):
            try:
                prepare(plugins)
            except PLUGIN_FAULTS:
                continue

    def _groups_of(
        self, callbacks: Sequence[int]
    ) -> Iterator[tuple[Callable[[Sequence[Any]], object], list[FlatlandPlugin]]]:
        jobs = [
            job
            for callback in callbacks
            if (job := self._jobs[callback]).plugin not in self._disabled
        ]
        start = 0
        for end in range(1, len(jobs) + 1):
            prepare = jobs[start].update.prepare
            if end < len(jobs) and jobs[end].update.prepare == prepare:
                continue
            if prepare is not None and end - start > 1:
                yield prepare, [job.plugin for job in jobs[start:end]]
            start = end

    def failed(self, failures: Sequence[tuple[int, str]], *, is_after: bool) -> None:
        """Takes the errors of controllers as faults of their plugins.

        Args:
            failures: Ids of the controllers, and their errors.
            is_after: Whether they failed after the physics step.
        """
        now = self._timekeeper.sim_time_ns
        for controller, text in failures:
            plugin = self._controllers.get(controller)
            if plugin is None:
                continue
            source = (controller, is_after)
            # The core reports no successes: it has succeeded if it did not fail in the last step.
            if self._failures.get(source) != now - self._timekeeper.step_size_ns:
                self._faults.succeeded(plugin, source)
            self._failures[source] = now
            hook = STEP_HOOKS["after" if is_after else "before"]
            self._call(plugin, hook, source, _fail, text)


def _fail(text: str) -> None:
    raise ValueError(text)
