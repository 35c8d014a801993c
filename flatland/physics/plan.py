"""Work of the core in each step besides the physics, and the steps that call plugins."""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

from flatland import _core

if TYPE_CHECKING:
    from collections.abc import Sequence

    from flatland.geometry import Pose
    from flatland.physics.world import PhysicsWorld

ClockKind = Literal["periodic", "always", "at_start", "never"]

END_OF_ORDER: Final = 2**63 - 1
"""The order after all plugins."""


class RunEnd(IntEnum):
    """Why a run of steps ended.

    Attributes:
        DONE: All steps were performed.
        CALL: Code is to be called in the next step, which has not begun.
        FAILED: The next step has begun, and a controller has failed before the physics step.
        PHYSICS: The next step has begun, and its physics step was performed, but nothing after it.
        STOPPED: `interrupt` was called, or the run reached its time limit.
    """

    DONE = 0
    CALL = 1
    FAILED = 2
    PHYSICS = 3
    STOPPED = 4


RunResult = tuple[int, int, tuple[list[int], list[int]] | None]
"""Number of complete steps, a `RunEnd`, and the ids of limited and of invalid bodies."""


class StepRun(NamedTuple):
    """Steps to be performed without calling Python code.

    Attributes:
        world: The physics world.
        step: Number of the first step.
        n: Maximum number of steps.
        dt: Duration of a step [s].
        velocity_iterations: Velocity iterations of the Box2D solver.
        position_iterations: Position iterations of the Box2D solver.
        only_physics: Whether to end after the first physics step.
    """

    world: PhysicsWorld
    step: int
    n: int
    dt: float
    velocity_iterations: int
    position_iterations: int
    only_physics: bool


class WorkTimes(NamedTuple):
    """Wall times of the complete steps of a paced run.

    Attributes:
        waited: Of the waits between the steps [s].
        total: Of all steps [s].
        least: Of the shortest step [s].
        most: Of the longest step [s].
    """

    waited: float
    total: float
    least: float
    most: float


def run_worlds(runs: Sequence[StepRun], num_threads: int) -> list[RunResult | Exception]:
    """Performs steps of several worlds in parallel, without the GIL if that takes long.

    Args:
        runs: The steps, each of a different world.
        num_threads: Maximum number of threads; 0 for one per core.

    Returns:
        What `StepPlan.run` returns or raises, for each world.
    """
    return _core.run_worlds([(run.world._core, *run[1:]) for run in runs], num_threads)


class StepPlan:
    """The clocks of updates, and the records of updates for which no code was called.

    Steps are counted from time 0: step k leads from time k dt to (k + 1) dt.

    Attributes:
        is_used: Whether anything was ever added to the plan; otherwise it has no effect.
    """

    __slots__ = ("_core", "is_used")

    def __init__(self, core: _core.World) -> None:
        """Creates the interface to the plan of a world, which is empty."""
        self._core = core
        self.is_used = False

    def add_clock(self, is_after: bool, kind: ClockKind, half_step: int, cycle: int) -> int:
        """Adds a clock for updates.

        Args:
            is_after: Whether updates are due after the physics step, at time (k + 1) dt.
            kind: `periodic`: due at time k dt if (2 k + 1) * half_step modulo cycle is less than
                2 * half_step. `always`: due in each step. `at_start`: due at time 0.
                `never`: not due.
            half_step: See `kind`.
            cycle: See `kind`; more than twice `half_step` and less than 2^63.

        Returns:
            The number of the clock.

        Raises:
            ValueError: An argument is out of range, or there are 62 clocks already.
        """
        self.is_used = True
        return self._core.add_clock(is_after, kind, half_step, cycle)

    def set_calls(self, clock: int, has_calls: bool) -> None:
        """Sets whether code is to be called in steps in which a clock is due."""
        self._core.set_clock_calls(clock, has_calls)

    def add_record(
        self, clock: int, order: int, body_id: int | None, touches_id: int | None
    ) -> int:
        """Adds a record of the updates that were due without a call; disabled at first.

        Args:
            clock: Clock of the updates.
            order: Place of the plugin in the order of hooks.
            body_id: Body whose pose is recorded at each update.
            touches_id: Collector of contacts that is cleared at each update.

        Returns:
            The id of the record.
        """
        return self._core.add_record(clock, order, body_id, touches_id)

    def enable_record(self, record: int, is_enabled: bool) -> None:
        """Sets whether updates are recorded."""
        self._core.enable_record(record, is_enabled)

    def remove_record(self, record: int) -> None:
        """Removes a record."""
        self._core.remove_record(record)

    def take_skipped(self) -> list[tuple[int, int, int, Pose]]:
        """Returns the updates that were recorded since the last call.

        Returns:
            Id of the record, number of updates, step at whose time the last one was due, and pose
            of the body at that time, for each record with updates.
        """
        return self._core.take_skipped()

    def run(self, run: StepRun) -> RunResult:
        """Performs steps without calling Python code; releases the GIL if that takes long.

        Args:
            run: The steps of this world.

        Returns:
            Number of complete steps, a `RunEnd`, and the ids of limited and of invalid bodies in
            the last step if there are any.

        Raises:
            ValueError: A number is out of range.
            StaleHandleError: The world is closed.
            WorldLockedError: The world is in use.
        """
        return self._core.run(*run[1:])

    def run_paced(self, run: StepRun, due: float, period: float) -> tuple[RunResult, WorkTimes]:
        """Performs steps as `run`, the first one at once and then one each period.

        Between two steps it waits without the GIL, and other threads may use the world. Short steps
        in which no code is due, and for which no contacts are wanted, are performed together when
        the last one of them is due. The run ends before a wait after 25 ms, if a step was late, and
        with an interrupt, after the steps that were due before it.

        Args:
            run: The steps of this world, not those that end after the physics step.
            due: When the first step was due [s], on the clock of `time.perf_counter`.
            period: Wall time between two steps [s].

        Returns:
            As `run`, and the wall times of the complete steps.

        Raises:
            ValueError: A number is out of range.
            StaleHandleError: The world is closed.
            WorldLockedError: The world is in use.
        """
        result, *times = self._core.run_paced(*run[1:6], due, period)
        return result, WorkTimes(*times)

    def begin_step(self, step: int) -> int:
        """Begins a step in which code is called.

        Returns:
            The clocks that are due and for which code is to be called, as bits.
        """
        return self._core.begin_step(step)

    def carry_out(self, is_after: bool, until: int, dt: float) -> bool:
        """Carries out the pending work of this step that precedes a plugin.

        Args:
            is_after: Whether the physics step was performed.
            until: Place of the plugin in the order of hooks.
            dt: Duration of the step [s].

        Returns:
            Whether a controller has failed, because its numbers were out of range.
        """
        return self._core.carry_out(is_after, until, dt)

    def has_touches(self) -> bool:
        """Returns whether there are contacts after which runs of steps end."""
        return self._core.has_ending_touches()

    def take_failed(self) -> list[int]:
        """Returns the ids of the controllers that have failed since the last call."""
        return self._core.take_failed_controllers()

    def interrupt(self) -> None:
        """Makes `run` return after the current step; safe from any thread."""
        self._core.interrupt()

    def clear_interrupt(self) -> None:
        """Ends the effect of `interrupt`."""
        self._core.clear_interrupt()
