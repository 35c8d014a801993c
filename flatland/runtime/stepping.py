"""The steps of a world: one loop, which the core performs until code has to be called.

`Stepping.run` describes a run of steps as a generator: it yields what the core is to perform, and
is sent what is to be done outside of the core. `World.step`, paced steps and `step_worlds` differ
only in how they have the core perform a run.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import TYPE_CHECKING, Any, ClassVar, Final, Protocol

from flatland.physics import Run, RunEnd, to_report

if TYPE_CHECKING:
    from flatland.physics import PhysicsWorld, RunResult, WorkTimes
    from flatland.runtime.body_monitor import BodyMonitor
    from flatland.runtime.changes import ChangeLog
    from flatland.runtime.faults import Faults
    from flatland.runtime.observer import Observers
    from flatland.runtime.plugin_host import PluginHost
    from flatland.runtime.requests import Requests
    from flatland.runtime.transforms import TransformBuffer
    from flatland.timekeeper import Timekeeper


# As integers, since comparisons with members of an enumeration take as long as a short step.
_DONE, _BEFORE, _PHYSICS, _AFTER_PHYSICS, _AFTER, _LAST_CALLS = map(int, RunEnd)

MAX_STEPS: Final = 2**62
"""Greatest number of steps of a call, in the range of the integers of the core."""


class SteppedWorld(Protocol):
    """What the steps of a world need of it."""

    physics: PhysicsWorld
    timekeeper: Timekeeper
    requests: Requests
    velocity_iterations: int
    position_iterations: int

    @property
    def paused(self) -> bool:
        """Whether steps have no effect."""

    @property
    def closed(self) -> bool:
        """Whether the world is closed."""

    def check_open(self) -> None:
        """Raises `WorldError` if the world is closed."""


StepRun = Generator[Run, "RunResult", int]
"""Yields steps for the core, is sent their results, and returns the number of complete steps."""


class Pace:
    """The wall times at which steps are due.

    Attributes:
        due: When the next step is due [s], on the clock of `time.perf_counter`.
        period: Wall time between two steps [s].
        is_interrupted: Returns whether the caller has something else to do.
        times: The wall times of the last steps; None if there was only one, without a wait.
    """

    __slots__ = ("due", "is_interrupted", "period", "times")

    def __init__(self, due: float, period: float, is_interrupted: Callable[[], bool]) -> None:
        """Creates a pace; the arguments are the attributes."""
        self.due = due
        self.period = period
        self.is_interrupted = is_interrupted
        self.times: WorkTimes | None = None


class Stepping:
    """Performs the steps of a world.

    Attributes:
        change_log: Notified of each step, None if there is none.
    """

    outside_state: ClassVar[dict[str, Callable[[], object]]] = {"change_log": lambda: None}

    def __init__(
        self,
        world: SteppedWorld,
        host: PluginHost,
        body_monitor: BodyMonitor,
        observers: Observers,
        transforms: TransformBuffer,
        faults: Faults,
    ) -> None:
        """Creates the steps of a world.

        Args:
            world: The world.
            host: Calls the plugins.
            body_monitor: Handles the bodies that a physics step reports.
            observers: Notified of each step.
            transforms: The transforms of each step.
            faults: Takes what plugins raise.
        """
        self.change_log: ChangeLog | None = None
        self._world = world
        self._physics = world.physics
        self._queue = world.physics.jobs
        self._timekeeper = world.timekeeper
        self._requests = world.requests
        self._host = host
        self._body_monitor = body_monitor
        self._observers = observers
        self._transforms = transforms
        self._faults = faults

    def step(self, n: int, *, while_paused: bool = False) -> None:
        """Steps n times; see `World.step`."""
        while n > 0:
            n -= perform(self.run(n, while_paused=while_paused), self._queue.run)

    def step_up_to(self, n: int, pace: Pace | None = None) -> int:
        """Steps at most n times: until a request is to be processed.

        Args:
            n: Maximum number of steps, at least 1.
            pace: The times at which the steps are performed, the first one at once; its `times` are
                set. The steps also end when code has been called, if one was late, and after 25 ms.
                None to perform the steps as fast as possible.

        Returns:
            The number of steps; 1 for a paused world, 0 if a request came before the first step.

        Raises:
            Exception: As `World.step`.
        """
        queue = self._queue
        if pace is None:
            return perform(self.run(n), queue.run)

        def run_paced(*arguments: Any) -> RunResult:
            run = Run(*arguments)
            if run.n == 1:
                return queue.run(*run)
            if self._observers.watch_time or pace.is_interrupted():
                return queue.run(*run._replace(n=1))
            result, pace.times = queue.run_paced(run, pace.due, pace.period)
            return result

        return perform(self.run(n, is_paced=True), run_paced)

    def prepare_unattended(self) -> bool:
        """Prepares runs that the core begins without any code before.

        To be called by a thread that holds the lock of the requests.

        Returns:
            Whether this is possible, as long as nothing interrupts the jobs of the world: nothing
            observes the world, and no request waits.
        """
        requests = self._requests
        if (
            requests.actions
            or requests.in_use
            or self._observers.watch_any
            or self.change_log is not None
            or self._faults.first is not None
            or self._world.paused
            or self._world.closed
        ):
            return False
        with requests.hooks():
            if self._host.prepare_step(transforms_wanted=False):
                # Which is each step from now on; the one that follows is prepared.
                self._host.jobs.keep_repeated()
                return False
        return self._physics.pre_solve is None

    def continue_unattended(self, n: int, result: RunResult | Exception) -> None:
        """Completes steps that the core has begun.

        Args:
            n: Number of steps.
            result: What the core returned or raised.

        Raises:
            Exception: As `World.step`.
        """
        made = perform(self.run(n, begun=result), self._queue.run)
        if made < n:
            self.step(n - made)

    def run(
        self,
        n: int,
        *,
        while_paused: bool = False,
        begun: RunResult | Exception | None = None,
        is_paced: bool = False,
    ) -> StepRun:
        """Performs up to n steps, at least one unless another thread interrupts.

        Ends after an interrupt, for requests, and for faults that are raised. Observers are
        notified of the end and the start of steps after each step in which code was called, and of
        the time whenever code is called and at the end. With an observer that watches single steps,
        and during a recording, they are notified of each step.

        Args:
            n: Maximum number of steps, at least 1.
            while_paused: Whether to step a paused world.
            begun: What the core returned or raised if it has performed the first part of the run;
                else None.
            is_paced: Whether to end after a step in which code was called.

        Returns:
            The run, to be driven by `perform` or `step_worlds`; its result is 1 for a paused world.

        Raises:
            WorldError: The world is closed, a plugin calls this, or a body is not finite.
            Exception: Raised by a plugin, subscriber or observer, with `plugin_errors="raise"`.
        """
        requests = self._requests
        requests.refuse_in_plugin("step")
        with requests.lock:
            self._world.check_open()
            if begun is None:
                self._queue.clear_interrupt()
                if requests.actions:
                    requests.process()
                    self._world.check_open()  # A request may have closed it.
            made = 1
            if begun is not None or while_paused or not self._world.paused:
                with requests.hooks():
                    self._observers.step_started()
                    try:
                        made = yield from self._steps(n, begun, while_paused, is_paced)
                    finally:
                        self._observers.step_finished()
            if requests.actions:
                requests.process()
        if self._faults.first is not None:
            self._faults.raise_first()
        return made

    def _steps(
        self,
        n: int,
        begun: RunResult | Exception | None,
        while_paused: bool,
        is_paced: bool,
    ) -> StepRun:
        world, host, timekeeper = self._world, self._host, self._timekeeper
        is_single = (begun is None and self._prepare()) or n == 1 or self._is_watched
        start, step = self._physics.time_ns, timekeeper.step_size_ns
        run = Run(
            start,
            step,
            1 if is_single else n,
            timekeeper.step_size,
            world.velocity_iterations,
            world.position_iterations,
            False,
            self._physics.pre_solve is not None,
        )
        if isinstance(begun, Exception):
            raise begun
        result = begun or (yield run)
        made = notified = 0  # steps, and those of whose end observers were notified
        has_called = False  # since then
        while True:
            steps, end, calls, failed, report = result
            made += steps
            start += steps * step
            if end != _DONE:
                if has_called and steps:
                    self._set_time(start)
                    self._between_steps()
                    notified = made
                    is_single = self._is_watched
                has_called = True
                is_after = end >= _AFTER
                self._set_time(start + step if is_after else start)
                if failed:
                    host.jobs.failed(failed, is_after=is_after)
                if calls:
                    host.call_updates(calls)
                if end in (_PHYSICS, _AFTER_PHYSICS):
                    self._examine(report, calls_physics=end == _PHYSICS)
                if end != _LAST_CALLS:
                    # The core goes on with the next steps unless something else is to be done.
                    goes_on = (
                        n - made > 1
                        and not is_paced
                        and not is_single
                        and not self._has_to_end(while_paused)
                        and host.is_prepared(self._observers.want_transforms)
                    )
                    rest = n - made if goes_on else 1
                    run = Run(start, step, rest, *run[3:6], True, run.calls_physics)
                    result = yield run
                    continue
                made += 1
                start += step
            elif steps < run.n:
                break  # by an interrupt, or after a long time
            if made == n or is_paced or self._has_to_end(while_paused):
                break
            self._set_time(start)
            self._between_steps()
            notified = made
            has_called = False
            is_single = self._prepare() or self._is_watched
            run = run._replace(
                time=start,
                n=1 if is_single else n - made,
                continues=False,
                calls_physics=self._physics.pre_solve is not None,
            )
            result = yield run
        self._set_time(start)
        self._end_step(has_stepped=made > notified)
        return made

    @property
    def _is_watched(self) -> bool:
        """Whether every step has to be reported to observers or to the change log."""
        return self._observers.watch_steps or self.change_log is not None

    def _has_to_end(self, while_paused: bool) -> bool:
        """Returns whether a run has to end between two steps."""
        world = self._world
        return (
            bool(self._requests.actions)
            or self._faults.first is not None
            or (world.paused and not while_paused)
            or world.closed
        )

    def _prepare(self) -> bool:
        """Prepares the next step; returns whether the one after it must be prepared as well."""
        return self._host.prepare_step(self._observers.want_transforms)

    def _end_step(self, *, has_stepped: bool) -> None:
        self._transforms.flush()
        if self.change_log is not None and has_stepped:
            self.change_log.step_done()

    def _between_steps(self) -> None:
        """Notifies observers of the end of a step and of the start of the next one."""
        self._end_step(has_stepped=True)
        self._observers.step_finished()
        self._observers.step_started()

    def _set_time(self, time_ns: int) -> None:
        if time_ns != self._physics.time_ns:
            self._physics.time_ns = time_ns
            self._observers.time_advanced(time_ns)

    def _examine(self, report: tuple[list[int], list[int]] | None, *, calls_physics: bool) -> None:
        """Handles the report and the contacts of a physics step, which it performs if asked to."""
        world = self._world
        found = to_report(report)
        if calls_physics:
            found = self._physics.step(
                self._timekeeper.step_size, world.velocity_iterations, world.position_iterations
            )
        if found is not None:
            self._body_monitor.examine(found, self._timekeeper)
        self._host.contacts.dispatch()


def perform(run: StepRun, core: Callable[..., RunResult]) -> int:
    """Performs a run of one world.

    Args:
        run: Result of `Stepping.run`.
        core: Has the core perform steps; called with the members of a `Run`.

    Returns:
        The number of steps.

    Raises:
        Exception: As `Stepping.run`.
    """
    try:
        steps = next(run)
        while True:
            try:
                result = core(*steps)
            except BaseException as error:
                steps = run.throw(error)
            else:
                steps = run.send(result)
    except StopIteration as end:
        made: int = end.value
        return made
