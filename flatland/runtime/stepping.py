"""The order of a step, and runs of steps in which no code of plugins is called."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flatland.physics import END_OF_ORDER, RunEnd, StepReport

if TYPE_CHECKING:
    from flatland.physics import PhysicsWorld
    from flatland.runtime.body_monitor import BodyMonitor
    from flatland.runtime.change_log import ChangeLog
    from flatland.runtime.contacts import ContactReporter
    from flatland.runtime.observer import Observers
    from flatland.runtime.plugin_host import PluginHost
    from flatland.runtime.transforms import TransformBuffer
    from flatland.timekeeper import Timekeeper


class Stepping:
    """Makes the steps of a world; `World.step` adds requests, faults and the pause.

    Attributes:
        velocity_iterations: Velocity iterations of the Box2D solver.
        position_iterations: Position iterations of the Box2D solver.
        change_log: Notified of each step, None if there is none.
    """

    def __init__(
        self,
        physics: PhysicsWorld,
        timekeeper: Timekeeper,
        host: PluginHost,
        contacts: ContactReporter,
        body_monitor: BodyMonitor,
        observers: Observers,
        transforms: TransformBuffer,
        iterations: tuple[int, int],
    ) -> None:
        """Creates the steps of a world from its parts.

        Args:
            physics: The physics world.
            timekeeper: The simulated time.
            host: Calls the hooks of plugins.
            contacts: Reports contacts to plugins.
            body_monitor: Handles the bodies that a physics step reports.
            observers: Notified of each step.
            transforms: The transforms of plugins.
            iterations: Velocity and position iterations of the Box2D solver.
        """
        self.velocity_iterations, self.position_iterations = iterations
        self.change_log: ChangeLog | None = None
        self._physics = physics
        self._plan = physics.plan
        self._timekeeper = timekeeper
        self._host = host
        self._contacts = contacts
        self._body_monitor = body_monitor
        self._observers = observers
        self._transforms = transforms

    def advance(self, n: int) -> int:
        """Makes up to n steps, at least one unless another thread interrupts.

        Returns:
            The number of steps.

        Raises:
            WorldError: A body is not finite, with the policy `raise`.
        """
        self._prepare()
        timekeeper = self._timekeeper
        step, rest = divmod(timekeeper.sim_time_ns, timekeeper.step_size_ns)
        if rest or self._physics.pre_solve is not None or self._host.hooks.has_unscheduled:
            self._make_step(step, is_aligned=not rest)
            return 1
        is_watched = self._observers.watch_steps or self.change_log is not None
        made, end, report = self._plan.run(
            step,
            1 if is_watched else n,
            timekeeper.step_size,
            self.velocity_iterations,
            self.position_iterations,
            is_watched,
        )
        if made:
            timekeeper.sim_time_ns += made * timekeeper.step_size_ns
        if end in (RunEnd.DONE, RunEnd.STOPPED):
            return made
        if end == RunEnd.CALL:
            self._make_step(step + made, is_aligned=True)
        elif end == RunEnd.PHYSICS:
            self._finish_step(0, None if report is None else StepReport(*map(tuple, report)))
        else:
            self._host.call_failed(timekeeper)
            self._finish_step(0, self._physics_step())
        return made + 1

    def _prepare(self) -> None:
        """Adapts to what has changed since the last step."""
        self._contacts.update()
        schedule = self._host.schedule
        schedule.refresh(self._observers.want_transforms)
        if schedule.targets:
            schedule.push_targets()

    def _make_step(self, step: int, *, is_aligned: bool) -> None:
        """Makes a step in which hooks are called.

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
        return self._physics.step(
            self._timekeeper.step_size, self.velocity_iterations, self.position_iterations
        )

    def _finish_step(self, due: int, report: StepReport | None) -> None:
        """Makes the rest of a step after the physics step.

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
        self._host.call_step_hooks("after_physics_step", due, timekeeper)
        if self._plan.is_used:
            self._plan.carry_out(True, END_OF_ORDER, timekeeper.step_size)
        self._transforms.flush()
        if self.change_log is not None:
            self.change_log.step_done()
