"""The order of a step, and runs of steps in which no code of plugins is called."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, ClassVar

from flatland.physics import END_OF_ORDER, RunEnd, StepRun, to_report

if TYPE_CHECKING:
    from contextlib import ExitStack

    from flatland.physics import RunResult, StepReport, WorkTimes
    from flatland.runtime.body_monitor import BodyMonitor
    from flatland.runtime.change_log import ChangeLog
    from flatland.runtime.contacts import ContactReporter
    from flatland.runtime.faults import Faults
    from flatland.runtime.observer import Observers
    from flatland.world import World


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
        world: World,
        contacts: ContactReporter,
        body_monitor: BodyMonitor,
        observers: Observers,
        faults: Faults,
    ) -> None:
        """Creates the steps of a world.

        Args:
            world: The world.
            contacts: Reports contacts to plugins.
            body_monitor: Handles the bodies that a physics step reports.
            observers: Notified of each step.
            faults: The exceptions of hooks.
        """
        self.change_log: ChangeLog | None = None
        self._world = world
        self._physics = world.physics
        self._plan = world.physics.plan
        self._timekeeper = world.timekeeper
        self._host = world.plugin_host
        self._requests = world.requests
        self._transforms = world.transform_buffer
        self._contacts = contacts
        self._body_monitor = body_monitor
        self._observers = observers
        self._faults = faults

    def step(self, n: int, *, while_paused: bool = False) -> None:
        """Steps n times; see `World.step`."""
        self._requests.refuse_in_plugin("step")
        while n > 0:
            n -= self._step_up_to(n, while_paused)

    def step_up_to(self, n: int) -> int:
        """Steps at most n times: until code has been called or a request has been processed.

        Args:
            n: Maximum number of steps, at least 1.

        Returns:
            The number of steps; 1 for a paused world, 0 if a request came before the first step.

        Raises:
            Exception: As `World.step`.
        """
        self._requests.refuse_in_plugin("step")
        return self._step_up_to(n, while_paused=False)

    def step_paced(self, n: int, pace: Pace) -> int:
        """Steps at most n times: the first time at once, then at the times of a pace.

        Returns after a step in which code has been called, before a request is processed, if a step
        was late, and after 25 ms.

        Args:
            n: Maximum number of steps, at least 1.
            pace: The times; its `times` are set.

        Returns:
            As `step_up_to`.

        Raises:
            Exception: As `World.step`.
        """
        self._requests.refuse_in_plugin("step")
        return self._step_up_to(n, while_paused=False, pace=pace)

    def _step_up_to(self, n: int, while_paused: bool, pace: Pace | None = None) -> int:
        requests, faults = self._requests, self._faults
        made = 1
        with requests.lock:
            self._start()
            if while_paused or not self._world.paused:
                requests.hook_thread = threading.get_ident()
                self._observers.step_started()
                try:
                    made = self._advance(n, pace)
                finally:
                    self._observers.step_finished()
                    requests.hook_thread = None
            if requests.actions:
                requests.process()
        if faults.first is not None:
            faults.raise_first()
        return made

    def begin_batch(self, n: int, locks: ExitStack) -> StepRun | None:
        """Prepares up to n steps in the core; for `flatland.runtime.batch`.

        Args:
            n: Number of steps.
            locks: Holds the lock of the requests until the run ends.

        Returns:
            The run; None if `step` has to perform the steps.

        Raises:
            WorldError: The world is closed, or a plugin calls this.
        """
        self._requests.refuse_in_plugin("step")
        locks.enter_context(self._requests.lock)
        self._start()
        if self._world.paused or self._is_watched:
            return None
        return self._begin_run(n)

    def end_batch(self, run: StepRun, result: RunResult | Exception) -> int:
        """Accounts for the steps of a run, and performs the next one if it calls hooks.

        Args:
            run: What `begin_batch` returned.
            result: How the run ended.

        Returns:
            The number of steps.

        Raises:
            Exception: As `World.step`.
        """
        if isinstance(result, Exception):
            raise result
        requests = self._requests
        requests.hook_thread = threading.get_ident()
        try:
            made = self._end_run(run, result)
        finally:
            requests.hook_thread = None
        if requests.actions:
            requests.process()
        self._faults.raise_first()
        return made

    def _start(self) -> None:
        """Runs the pending actions before a step."""
        self._world.check_open()
        self._plan.clear_interrupt()
        if self._requests.actions:
            self._requests.process()

    def _advance(self, n: int, pace: Pace | None) -> int:
        """Performs up to n steps, at least one unless another thread interrupts.

        Args:
            n: Number of steps.
            pace: When the steps are due; None to perform them as fast as possible.

        Returns:
            The number of steps.

        Raises:
            WorldError: A body is not finite, with the policy `raise`.
        """
        run = self._begin_run(n)
        if run is not None:
            return self._end_run(run, self._perform(run, pace))
        timekeeper = self._timekeeper
        step, rest = divmod(timekeeper.sim_time_ns, timekeeper.step_size_ns)
        self._make_step(step, is_aligned=not rest)
        return 1

    def _perform(self, run: StepRun, pace: Pace | None) -> RunResult:
        """Performs steps in the core."""
        if pace is None:
            return self._plan.run(run)
        if run.n == 1 or self._observers.watch_time or pace.is_interrupted():
            return self._plan.run(run._replace(n=1))
        result, pace.times = self._plan.run_paced(run, pace.due, pace.period)
        return result

    @property
    def _is_watched(self) -> bool:
        """Whether every step has to be reported to observers or to the change log."""
        return self._observers.watch_steps or self.change_log is not None

    def _begin_run(self, n: int) -> StepRun | None:
        """Prepares up to n steps in the core.

        Returns:
            The run; None if hooks are to be called in the first step.
        """
        self._prepare()
        timekeeper = self._timekeeper
        step, rest = divmod(timekeeper.sim_time_ns, timekeeper.step_size_ns)
        if rest or self._physics.pre_solve is not None or self._host.hooks.has_unscheduled:
            return None
        is_watched = self._is_watched
        return StepRun(
            self._physics,
            step,
            1 if is_watched else n,
            timekeeper.step_size,
            self._world.velocity_iterations,
            self._world.position_iterations,
            is_watched,
        )

    def _end_run(self, run: StepRun, result: RunResult) -> int:
        """Accounts for the steps of a run, and performs the next one if it calls hooks.

        Args:
            run: The run.
            result: How it ended.

        Returns:
            The number of steps.

        Raises:
            WorldError: A body is not finite, with the policy `raise`.
        """
        timekeeper = self._timekeeper
        made, end, report = result
        if made:
            timekeeper.sim_time_ns += made * timekeeper.step_size_ns
            self._observers.time_advanced(timekeeper.sim_time_ns)
        if end in (RunEnd.DONE, RunEnd.STOPPED):
            return made
        if end == RunEnd.CALL:
            self._make_step(run.step + made, is_aligned=True)
        elif end == RunEnd.PHYSICS:
            self._finish_step(0, to_report(report))
        else:
            self._host.call_failed(timekeeper)
            self._finish_step(0, self._physics_step())
        return made + 1

    def _prepare(self) -> None:
        """Updates contacts and schedule to the changes since the last step."""
        self._contacts.update()
        schedule = self._host.schedule
        schedule.refresh(self._observers.want_transforms)
        if schedule.targets:
            schedule.push_targets()

    def _make_step(self, step: int, *, is_aligned: bool) -> None:
        """Performs a step in which hooks are called.

        Args:
            step: Number of the step.
            is_aligned: Whether the time is a multiple of the step size; otherwise, timers and
                the clocks of the core differ, and all hooks are called.
        """
        host, timekeeper = self._host, self._timekeeper
        due = 0
        if self._plan.is_used:
            due = self._plan.begin_step(step)
            if not is_aligned:
                due = host.schedule.call_all()
        host.call_step_hooks("before_physics_step", due, timekeeper)
        if self._plan.is_used and self._plan.carry_out(False, END_OF_ORDER, timekeeper.step_size):
            host.call_failed(timekeeper)
        self._finish_step(due, self._physics_step())
        host.schedule.calls_made(due)

    def _physics_step(self) -> StepReport | None:
        world = self._world
        return self._physics.step(
            self._timekeeper.step_size, world.velocity_iterations, world.position_iterations
        )

    def _finish_step(self, due: int, report: StepReport | None) -> None:
        """Performs the part of a step that follows the physics step.

        Args:
            due: The clocks of updates that are due, as bits.
            report: The report of the physics step.
        """
        timekeeper = self._timekeeper
        if report is not None:
            self._body_monitor.examine(report, timekeeper)
        self._contacts.dispatch()
        timekeeper.advance()
        self._observers.time_advanced(timekeeper.sim_time_ns)
        due = self._host.schedule.with_contacts(due)
        self._host.call_step_hooks("after_physics_step", due, timekeeper)
        if self._plan.is_used:
            self._plan.carry_out(True, END_OF_ORDER, timekeeper.step_size)
        self._transforms.flush()
        if self.change_log is not None:
            self.change_log.step_done()
