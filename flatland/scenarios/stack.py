"""ROS nodes as the controller of a run.

The world is stepped in the process of the run, which is a ROS node with the same topics as the
simulator node. Its master or domain is its own; the nodes of the stack and all their processes end
with it.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

from flatland.scenarios.connection import StackError
from flatland.scenarios.programs import Program
from flatland.scenarios.stack_link import StackLink
from flatland.timekeeper import NANOSECONDS
from flatland.values import Twist

if TYPE_CHECKING:
    from flatland.geometry import Pose, Vector2
    from flatland.runtime.observer import WorldObserver
    from flatland.scenarios.connection import Ros
    from flatland.scenarios.scenario import Run
    from flatland.scenarios.stack_options import StackCommand, StackOptions
    from flatland.scenarios.stage import Stage
    from flatland.scenarios.task import Scan, Task

_WARM_UP: Final = 1.0  # s; the ROS time of the start is a multiple of it
_PATIENCE: Final = 1.0  # wall time that a stack which has sent its last command may need [s]
_WATCHDOG: Final = 1.0  # simulated time without commands after which the robot stops [s]
_SILENCE: Final = 10.0  # simulated time without commands after which the stack has failed [s]
_PERIODS: Final = 2  # without commands before the robot stops, if they are longer than that time
# Sensors without an `update_rate` publish in each step. Several nodes may send one or more commands
# for each message, and those that have waited in a queue arrive together.
_MAX_COMMANDS: Final = 10  # per step
_MANY_COMMANDS: Final = 5  # per step; more may be many more
_LEAST_RATE: Final = 0.95  # simulated time per wall time that counts as real time
_TF_DELAY: Final = 0.5  # simulated time until the transforms of a time have usually arrived [s]
_TF_MARGIN: Final = 1.0  # simulated time before transforms are forgotten, and no longer awaited [s]


class GaveUpError(Exception):
    """The nodes no longer drive the robot; the text is the reason."""


class Stack:
    """A controller that consists of ROS nodes.

    Attributes:
        observers: Observers that the world must be loaded with.
    """

    def __init__(self, ros: Ros, command: StackCommand, options: StackOptions) -> None:
        """Starts no program yet.

        Args:
            ros: The connection to ROS.
            command: The program that starts the nodes.
            options: Topics, frames and the pace.
        """
        self._ros = ros
        self._command = command
        self._options = options
        self._link = StackLink(ros, options)
        self.observers: list[WorldObserver] = [self._link.bridge, self._link]
        self._program: Program | None = None
        self._stage: Stage | None = None
        self._goal: Vector2 | None = None
        self._twist = Twist()
        self._is_silent = self._has_driven = False
        self._last_command = 0.0  # s of simulated time
        self._counts: deque[int] = deque()
        self._began = math.nan  # wall and simulated time of the first command [s]
        self._began_at = 0.0
        self._late = 0
        self._waiting: deque[tuple[int, Pose]] = deque()
        self._errors: list[float] = []

    def controller(self, _task: Task) -> Stack:
        """Returns this object, as the class of a controller does."""
        return self

    def close(self) -> None:
        """Ends all programs and connections."""
        if self._program is not None:
            self._program.end()
        self._link.close()
        self._ros.close()

    def start(self, run: Run, stage: Stage, prepare: Callable[[], Stage]) -> Stage:
        """Starts the nodes, and steps the world in real time until they are ready.

        The world is then reset and prepared again, while the ROS time continues: each run begins in
        the same state.

        Args:
            run: The run.
            stage: The prepared run.
            prepare: Prepares the world again.

        Returns:
            The stage of the run.

        Raises:
            StackError: The program cannot be started or ends, or the nodes are not ready in time.
        """
        link, world = self._link, stage.world
        link.attach(stage)
        link.send_initial_pose(stage.start)
        command = self._command
        try:
            self._program = Program(command.program, self._ros.environment, command.folder)
        except OSError as error:
            raise StackError(f"{command.program[0]}: {error.strerror}") from error
        self._warm_up(stage)
        link.use(None)  # Its robot is about to be deleted.
        link.keep_time()
        with link.transport.closing_last():
            world.reset(seed=run.seed)
            stage = prepare()
        link.use(stage)
        link.take()
        self._stage = stage
        self._last_command = stage.time
        link.send_initial_pose(stage.start)
        # Before the first scan, whose command is awaited at the end of the first period.
        self._send_goal(stage.start, stage.task.goals[0])
        return stage

    def command(self, scan: Scan, pose: Pose, goal: Vector2) -> Twist:  # noqa: ARG002 - by topics
        """Returns the last command of the nodes, and sends them a new goal.

        The first call is after the first step, in which the sensors sent their first messages.

        Raises:
            StackError: The program has ended, or the nodes send too many or no commands.
            GaveUpError: The nodes have ended the goal or send no more commands.
        """
        stage = self._require_stage()
        if math.isnan(self._began):
            self._began, self._began_at = time.monotonic(), stage.time
            return self._twist
        self._sample(pose)
        self._keep_pace(stage)
        self._check_program()
        count, twist = self._link.take()
        # Not before: the awaited command would be that to the old or to the new goal by chance.
        if goal != self._goal:
            self._send_goal(pose, goal)
        self._check_count(count)
        now = stage.time
        if count:
            self._twist, self._last_command, self._has_driven = twist, now, True
        else:
            self._late += 1
        if self._link.given_up:
            raise GaveUpError(self._link.given_up)
        if count > _MANY_COMMANDS * self._steps_per_period and self._options.pace == "lockstep":
            # In real time, so that those which wait to be received are counted as well.
            time.sleep(stage.task.period)
        silent_for = now - self._last_command
        if silent_for > _SILENCE:
            kind = GaveUpError if self._has_driven else StackError
            raise kind(f"the stack sent no command for {_SILENCE:g} s{self._log()}")
        self._is_silent = not count
        patience = max(_WATCHDOG, _PERIODS * stage.task.period)
        return Twist() if silent_for > patience else self._twist

    @property
    def values(self) -> dict[str, Any]:
        """Columns of the row of the run."""
        errors = self._errors
        return {
            "localization_error": sum(errors) / len(errors) if errors else None,
            "max_localization_error": max(errors, default=None),
            "late_commands": self._late,
        }

    @property
    def recoveries(self) -> int:
        """Number of recovery behaviours that the action of the goals has begun."""
        return self._link.recoveries

    @property
    def invalid(self) -> str:
        """Why the results of the run are not valid; empty if they are."""
        if self._options.pace == "lockstep" or math.isnan(self._began):
            return ""
        elapsed = time.monotonic() - self._began
        simulated = self._require_stage().time - self._began_at
        rate = simulated / elapsed if elapsed > 0 else 1.0
        if simulated < _WARM_UP or rate >= _LEAST_RATE:
            return ""
        return f"the simulation did not hold real time: {rate:.2f} s of simulated time per second"

    # -- parts -----------------------------------------------------------------------------

    def _require_stage(self) -> Stage:
        if self._stage is None:
            raise StackError("the stack was not started")
        return self._stage

    def _send_goal(self, pose: Pose, goal: Vector2) -> None:
        """Sends a goal, with the heading from the robot to it."""
        self._goal = goal
        self._link.send_goal((*goal, math.atan2(goal[1] - pose[1], goal[0] - pose[0])))

    def _warm_up(self, stage: Stage) -> None:
        """Steps in real time until the nodes are ready."""
        world = stage.world
        step_size = world.timekeeper.step_size
        steps = max(1, round(_WARM_UP / step_size))
        end = time.monotonic() + self._options.start_time
        was_ready = False
        while True:
            start = time.monotonic()
            for number in range(1, steps + 1):
                world.step()
                time.sleep(max(0.0, start + number * step_size - time.monotonic()))
            self._check_program()
            missing = self._link.missing
            # Nodes that have just started may not have discovered all topics of this one yet.
            if was_ready and not missing:
                return
            was_ready = not missing
            if missing and time.monotonic() > end:
                limit = self._options.start_time
                raise StackError(f"not ready after {limit:g} s: {missing}{self._log()}")

    def _keep_pace(self, stage: Stage) -> None:
        if self._options.pace == "real-time":
            due = self._began + stage.time - self._began_at
            time.sleep(max(0.0, due - time.monotonic()))
            return
        # A stack that no longer sends commands is not waited for: it gets real time.
        self._link.wait(stage.task.period if self._is_silent else _PATIENCE)

    def _check_program(self) -> None:
        code = None if self._program is None else self._program.exit_code
        if code is not None:
            how = f"signal {-code}" if code < 0 else f"exit code {code}"
            raise StackError(f"the program has ended with {how}{self._log()}")

    @property
    def _steps_per_period(self) -> float:
        stage = self._require_stage()
        return stage.task.period / stage.world.timekeeper.step_size

    def _check_count(self, count: int) -> None:
        """Adds the commands of a period to those of the last second."""
        periods = max(1, round(1.0 / self._require_stage().task.period))
        self._counts.append(count)
        if len(self._counts) > periods:
            self._counts.popleft()
        if sum(self._counts) > _MAX_COMMANDS * self._steps_per_period * periods:
            most = _MAX_COMMANDS / self._require_stage().world.timekeeper.step_size
            raise StackError(f"the stack sent more than {most:g} commands per second")

    def _log(self) -> str:
        lines = "" if self._program is None else self._program.last_lines
        return f"; its last output: {lines}" if lines else ""

    def _sample(self, pose: Pose) -> None:
        """Compares the true pose with the localisation, as soon as its transforms have arrived."""
        now = self._require_stage().world.timekeeper.sim_time_ns
        self._waiting.append((now, pose))
        while (age := now - self._waiting[0][0]) > _TF_DELAY * NANOSECONDS:
            stamp, (x, y, _theta) = self._waiting[0]
            found = self._link.position(stamp)
            if found is None and age < (self._link.kept - _TF_MARGIN) * NANOSECONDS:
                return
            self._waiting.popleft()
            if found is not None:
                self._errors.append(math.dist(found, (x, y)))


@contextmanager
def opened(command: StackCommand, options: StackOptions) -> Iterator[Stack]:
    """Connects this process to ROS for one run; a process can be connected only once."""
    ros: Ros
    if command.ros == 1:
        from flatland.scenarios.ros1 import Ros1

        ros = Ros1(options)
    else:
        from flatland.scenarios.ros2 import Ros2

        ros = Ros2(options)
    stack = Stack(ros, command, options)
    try:
        yield stack
    finally:
        stack.close()
