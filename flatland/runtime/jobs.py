"""The jobs of all plugins: what the core does or has called in each step, in order."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Container, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from flatland.errors import PLUGIN_FAULTS
from flatland.physics import Controller, Crowd
from flatland.plugin_api.plugin import FlatlandPlugin, ModelPlugin
from flatland.plugin_api.updates import STEP_HOOKS, Update

if TYPE_CHECKING:
    from flatland.physics import JobQueue
    from flatland.timekeeper import Timekeeper

Call = Callable[[FlatlandPlugin, str, Callable[..., object], Any], None]
FaultHandler = Callable[[FlatlandPlugin, str, BaseException], None]

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
    is wanted, and calls the functions.
    """

    def __init__(self, queue: JobQueue, timekeeper: Timekeeper, on_fault: FaultHandler) -> None:
        """Creates jobs without plugins.

        Args:
            queue: The queue of the core.
            timekeeper: The simulated time.
            on_fault: Called as `on_fault(plugin, hook, error)` with exceptions of plugins.
        """
        self._queue = queue
        self._timekeeper = timekeeper
        self._on_fault = on_fault
        self._order: dict[FlatlandPlugin, int] = {}
        self._count = 0
        self._jobs: dict[int, Job] = {}
        self._controllers: dict[int, FlatlandPlugin] = {}
        self._groups: dict[Callable[..., object], int] = {}
        self._is_stale = False
        self._transforms_wanted = False
        self._later: deque[tuple[FlatlandPlugin, Callable[[], None]]] = deque()

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
        group = 0
        if update.prepare is not None:
            group = self._groups.setdefault(update.prepare, len(self._groups) + 1)
        touches = update.touches
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

    def remove(self, plugin: FlatlandPlugin) -> None:
        """Removes the jobs of a plugin; one without jobs is ignored."""
        if plugin not in self._order:
            return
        self.settle()
        del self._order[plugin]
        for job in [job for job in self._jobs.values() if job.plugin is plugin]:
            del self._jobs[job.id]
            self._queue.remove_callback(job.id)
        for declared in plugin._jobs:
            if isinstance(declared, Controller | Crowd):
                self._controllers.pop(declared.id, None)
                if declared.alive:
                    declared.remove()
        # Other threads may add more meanwhile.
        for _ in range(len(self._later)):
            entry = self._later.popleft()
            if entry[0] is not plugin:
                self._later.append(entry)

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

    @property
    def is_pending(self) -> bool:
        """Whether `refresh` has something to do for the next step."""
        return self._is_stale or bool(self._later)

    def refresh(self, transforms_wanted: bool) -> None:
        """Prepares the next step: passes new commands, and finds out which updates are wanted.

        Args:
            transforms_wanted: Whether an observer wants transforms.
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
        self.call_later()

    def settle(self) -> None:
        """Reports updates without a call to the plugins, in order."""
        if not self._jobs:
            return
        skipped = {self._jobs[row[0]]: row for row in self._queue.take_skipped()}
        for job in sorted(skipped, key=lambda job: self._order[job.plugin]):
            _, count, stamp, poses = skipped[job]
            if job.update.skipped is not None:
                try:
                    job.update.skipped(count, stamp, poses)
                except PLUGIN_FAULTS as error:
                    self._on_fault(job.plugin, STEP_HOOKS[job.update.phase], error)

    # -- calls -----------------------------------------------------------------------------

    def set_later(self, plugin: FlatlandPlugin, function: Callable[[], None]) -> None:
        """Calls a function of a plugin before the next step; safe from any thread."""
        self._later.append((plugin, function))
        self._queue.interrupt()

    def call_later(self) -> None:
        """Calls the functions that were passed to `set_later`."""
        later = self._later
        while later:
            plugin, function = later.popleft()
            try:
                function()
            except PLUGIN_FAULTS as error:
                self._on_fault(plugin, STEP_HOOKS["before"], error)

    def call(self, callbacks: Sequence[int], call: Call, *, one_by_one: bool) -> None:
        """Calls the functions of updates that are due.

        Args:
            callbacks: Ids of their callbacks, in order.
            call: Calls a function of a plugin and takes what it raises, as
                `call(plugin, hook, function, timekeeper)`.
            one_by_one: Whether no update is to be prepared together with others.
        """
        timekeeper = self._timekeeper
        if len(callbacks) > 1 and self._groups and not one_by_one:
            self._prepare(callbacks)
        for callback in callbacks:
            job = self._jobs.get(callback)
            if job is None:
                continue  # Its plugin was disabled during this step.
            update = job.update
            call(job.plugin, STEP_HOOKS[update.phase], update.function, timekeeper)
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
        jobs = [self._jobs[callback] for callback in callbacks]
        start = 0
        for end in range(1, len(jobs) + 1):
            prepare = jobs[start].update.prepare
            if end < len(jobs) and jobs[end].update.prepare is prepare:
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
        for controller, text in failures:
            plugin = self._controllers.get(controller)
            if plugin is not None:
                hook = STEP_HOOKS["after" if is_after else "before"]
                try:
                    raise ValueError(text)
                except ValueError as error:
                    self._on_fault(plugin, hook, error)
