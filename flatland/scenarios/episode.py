"""Runs a scenario once."""

from __future__ import annotations

import dataclasses
import hashlib
import math
import os
import socket
import time
import traceback
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from flatland.errors import FlatlandError
from flatland.foreign_texts import text_of
from flatland.scenarios.columns import Row, clean_row, empty_row
from flatland.scenarios.connection import StackError
from flatland.scenarios.controllers import find_controller
from flatland.scenarios.events import Events
from flatland.scenarios.interrupts import user_interrupts
from flatland.scenarios.measures import Measures, distance_left, success_weighted_length
from flatland.scenarios.outline import models_of, outline_of
from flatland.scenarios.planner import PlanningError, shortest_length
from flatland.scenarios.stack import GaveUpError, Stack, opened
from flatland.scenarios.stack_options import StackCommand, StackOptions
from flatland.scenarios.stage import Stage, prepare
from flatland.scenarios.worlds import world_file
from flatland.values import Twist
from flatland.world import World

if TYPE_CHECKING:
    from flatland.scenarios.outline import Drawn, Line, Outline
    from flatland.scenarios.scenario import Run, Scenario

_MAX_NAME: Final = 120  # bytes of the name of a recording
_MAX_PATH: Final = 600  # points of the path that are kept


class FailedRunError(Exception):
    """A controller has made a run fail; the text is the reason."""


@dataclass(frozen=True, slots=True)
class Options:
    """How runs are carried out.

    Attributes:
        folder: Folder that relative paths of controllers start from.
        out: Folder of random worlds and recordings.
        record: Which runs are recorded: `failed`, `all` or `none`.
        stack: How ROS nodes are controllers.
    """

    folder: str
    out: str
    record: str = "failed"
    stack: StackOptions = field(default_factory=StackOptions)


@dataclass(slots=True)
class Result:
    """The result of a run.

    Attributes:
        row: Its row of the table.
        path: Poses (time, x, y) of the robot [s, m, m].
        goals: The goals (x, y) [m].
        events: Times and places of the robot at events: (time, x, y, action).
        outline: The walls, None if the world could not be loaded.
        recording: File of the recording, relative to the folder of the results; empty without one.
        jumps: Kidnappings (time, x, y, x, y) of the robot from one place to another [s, m].
        models: The models at the end, for pictures.
        recording_error: Why the recording is incomplete, empty if it is not.
    """

    row: Row
    path: list[tuple[float, float, float]] = field(default_factory=list)
    goals: list[tuple[float, float]] = field(default_factory=list)
    events: list[tuple[float, float, float, str]] = field(default_factory=list)
    outline: Outline | None = None
    recording: str = ""
    jumps: list[tuple[float, float, float, float, float]] = field(default_factory=list)
    models: list[Drawn] = field(default_factory=list)
    recording_error: str = ""

    @property
    def tracks(self) -> list[Line]:
        """The parts of the path (x, y) between the jumps [m]."""
        tracks: list[Line] = [[]]
        jumps = list(self.jumps)
        for time_of, x, y in self.path:
            while jumps and time_of >= jumps[0][0]:
                _, x1, y1, x2, y2 = jumps.pop(0)
                tracks[-1].append((x1, y1))
                tracks.append([(x2, y2)])
            tracks[-1].append((x, y))
        return [track for track in tracks if track]


def run_scenario(
    run: Run, options: Options, begin_command: Callable[[bool], object] = lambda _is_begin: None
) -> Result:
    """Runs a scenario; all that fails in it becomes a row with the error.

    Args:
        run: The scenario with a controller and a seed.
        options: How it is carried out.
        begin_command: Called with True before code of the controller runs, with False after it.
    """
    start = time.perf_counter()
    result = Result(empty_row(run.key))
    with user_interrupts() as is_interrupted:
        try:
            _run(run, options, result, begin_command)
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt) and is_interrupted():
                raise
            reason = describe(error)
            result.row |= {"outcome": "error", "success": False, "passed": False, "error": reason}
            result.row["failures"] = reason
            if isinstance(error, MemoryError):
                raise  # The process is replaced.
    wall_time = time.perf_counter() - start
    worker = f"{socket.gethostname()}:{os.getpid()}"
    result.row = clean_row(result.row | {"wall_time": wall_time, "worker": worker})
    return result


def describe(error: BaseException) -> str:
    """Returns the type, text and innermost line of code of an error."""
    if isinstance(error, FlatlandError):
        return text_of(error, lambda known: known.text_with_hint)
    if isinstance(error, FailedRunError | PlanningError | StackError):
        return str(error)
    text = f"{type(error).__name__}: {text_of(error)}"
    frames = traceback.extract_tb(error.__traceback__)
    if not frames:
        return text
    return f"{text} [{Path(frames[-1].filename).name}:{frames[-1].lineno}]"


def recording_path(run: Run) -> str:
    """Returns the file of the recording of a run in the folder of the results.

    The name consists of letters, digits and a few signs, and of a hash that distinguishes it.
    """
    name = "".join(c if c.isalnum() or c in "._-=" else "_" for c in run.title)
    name = name.encode()[:_MAX_NAME].decode(errors="ignore")
    digest = hashlib.sha256(run.title.encode()).hexdigest()[:8]
    return f"recordings/{name}-{digest}.flog"


def _run(
    run: Run, options: Options, result: Result, begin_command: Callable[[bool], object]
) -> None:
    scenario, out = run.scenario, Path(options.out)
    found = find_controller(run.controller, options.folder)
    path = world_file(scenario, run.seed, out / "worlds")
    with ExitStack() as closing:
        stack: Stack | None = None
        if isinstance(found, StackCommand):
            stack = closing.enter_context(opened(found, options.stack))
            create: Callable[[Any], Any] = stack.controller
        else:
            create = found
        world = closing.enter_context(
            World.from_yaml(
                path,
                seed=run.seed,
                params=dict(scenario.params),
                observers=[] if stack is None else stack.observers,
            )
        )
        result.outline = outline_of(world)
        recording, recorder = recording_path(run), None
        if options.record != "none":
            (out / recording).parent.mkdir(parents=True, exist_ok=True)
            recorder = world.record(out / recording)
        try:
            stage = prepare(world, run)
            if stack is not None:
                stage = stack.start(run, stage, lambda: prepare(world, run))
            result.outline = outline_of(world)
            result.models = models_of(world, stage.robot.name, ())
            result.goals = list(stage.task.goals)
            driver = _Driver(stage, create, begin_command)
            _drive(scenario, stage, driver, result)
            if stack is not None:
                result.row |= _validity(stack)
        finally:
            if recorder is not None:
                recorder.close()
                if options.record == "all" or not result.row["passed"]:
                    result.recording, result.recording_error = recording, recorder.error
    if options.record == "failed" and result.row["passed"]:
        (out / recording).unlink(missing_ok=True)


def _validity(stack: Stack) -> Row:
    """Returns the columns of a run that did not hold its rate; nothing for others."""
    reason = stack.invalid
    if not reason:
        return {}
    row: Row = dict.fromkeys(("error", "failures"), reason)
    return row | {"outcome": "invalid", "success": False, "passed": False, "spl": None}


class _Driver:
    """Calls the controller and limits its commands.

    Attributes:
        times: Wall time of each call [s].
    """

    def __init__(
        self,
        stage: Stage,
        create: Callable[[Any], Any],
        begin_command: Callable[[bool], object],
    ) -> None:
        self._stage = stage
        self._begin = begin_command
        self.times: list[float] = []
        self._begin(True)
        try:
            # A copy: what a controller does to it has no effect on the run.
            self._controller = create(dataclasses.replace(stage.task))
        finally:
            self._begin(False)

    def command(self, goal: tuple[float, float]) -> None:
        """Sets the command of the next period."""
        stage = self._stage
        scan, pose = stage.laser.read(), stage.robot.pose
        start = time.perf_counter()
        self._begin(True)
        try:
            twist = self._controller.command(scan, pose, goal)
        finally:
            self._begin(False)
        self.times.append(time.perf_counter() - start)
        stage.drive.set(self._checked(twist))

    @property
    def recoveries(self) -> int:
        """Number of recoveries that the controller reports.

        Raises:
            FailedRunError: It is not a number.
        """
        count = getattr(self._controller, "recoveries", 0)
        if isinstance(count, bool) or not isinstance(count, int) or count < 0:
            shown = text_of(count, repr)
            raise FailedRunError(f"recoveries of the controller must be a count, got {shown}")
        return int(count)

    @property
    def measures(self) -> Row:
        """Columns that only nodes have."""
        return self._controller.values if isinstance(self._controller, Stack) else {}

    def _checked(self, twist: object) -> Twist:
        """Returns a command within the limits.

        Raises:
            FailedRunError: It is not a twist of finite numbers.
        """
        if not isinstance(twist, Twist):
            shown = text_of(twist, repr)
            raise FailedRunError(f"the controller must return a flatland.Twist, got {shown}")
        try:
            vx, vy, omega = map(float, (twist.linear_x, twist.linear_y, twist.angular_z))
        except (TypeError, ValueError):
            vx = vy = omega = math.nan
        if not all(map(math.isfinite, (vx, vy, omega))):
            shown = text_of(twist)
            raise FailedRunError(f"the controller returned a command that is not finite, {shown}")
        speed, turn = self._stage.task.max_speed, self._stage.task.max_turn
        return Twist(
            linear_x=min(max(vx, -speed), speed),
            linear_y=min(max(vy, -speed), speed),
            angular_z=min(max(omega, -turn), turn),
        )


def _drive(scenario: Scenario, stage: Stage, driver: _Driver, result: Result) -> None:
    """Steps the world until the run ends, and completes the result."""
    world, limits, goals = stage.world, scenario.limits, stage.task.goals
    step_size = world.timekeeper.step_size
    last = max(1, round(limits.time / step_size))
    steps_per_period = max(1, round(stage.task.period / step_size))
    events, measures = Events(scenario, stage), Measures(stage)
    reached, outcome, steps, reason = 0, "", 0, None
    jumped_after: list[int] = []  # number of goals that were reached before each jump
    start = time.perf_counter()
    try:
        while not outcome:
            events.update(reached)
            if events.kidnapped:
                measures.moved()
                jumped_after.append(reached)
            x, y, _theta = stage.robot.pose
            result.events += [(stage.time, x, y, action) for action in events.done]
            if steps % steps_per_period == 0:
                measures.sample()
                # Before the first step, there is no scan.
                if steps:
                    driver.command(goals[reached])
            world.step()
            steps += 1
            pose = measures.step()
            if steps == 1:
                driver.command(goals[reached])
            while (
                reached < len(goals) and distance_left(pose, goals[reached]) <= scenario.tolerance
            ):
                reached += 1
            outcome = _outcome(scenario, measures, reached, len(goals))
            if not outcome and steps >= last:
                outcome = "timeout"
    except GaveUpError as error:
        outcome, reason = "gave_up", str(error)
    finally:
        wall_time = time.perf_counter() - start
        measures.sample()
        result.path = _thinned(measures.path)
        result.jumps = [
            (round(t, 3), round(x1, 3), round(y1, 3), round(x2, 3), round(y2, 3))
            for t, x1, y1, x2, y2 in measures.jumps
        ]
        result.models = models_of(world, stage.robot.name, measures.touched)
        result.row |= measures.values()
        result.row |= {
            "outcome": outcome,
            "success": outcome == "reached",
            "error": reason,
            "goals": reached,
            "time": stage.time,
            "start_x": stage.start[0],
            "start_y": stage.start[1],
            "goal_x": goals[-1][0],
            "goal_y": goals[-1][1],
            "final_distance": distance_left(stage.robot.pose, goals[min(reached, len(goals) - 1)]),
            "steps": steps,
            "state_hash": world.state_hash(),
            "command_time": 1e3 * sum(driver.times) / len(driver.times) if driver.times else None,
            "max_command_time": 1e3 * max(driver.times) if driver.times else None,
            "real_time_factor": stage.time / wall_time if wall_time > 0 else None,
            **driver.measures,
        }
    result.row["recoveries"] = driver.recoveries
    result.row |= _efficiency(scenario, stage, result, measures, jumped_after)
    people = frozenset(measures.people)
    failures = [condition.failure(result.row, people) for condition in scenario.require]
    result.row["passed"] = not any(failures)
    if any(failures):
        result.row["failures"] = "; ".join(filter(None, [*failures, reason]))


def _outcome(scenario: Scenario, measures: Measures, reached: int, goals: int) -> str:
    limits = scenario.limits
    if limits.collisions is not None and measures.collisions > limits.collisions:
        return "collision"
    if reached == goals:
        return "reached"
    return "stuck" if limits.stuck is not None and measures.stuck_for >= limits.stuck else ""


def _efficiency(
    scenario: Scenario,
    stage: Stage,
    result: Result,
    measures: Measures,
    jumped_after: Sequence[int],
) -> Row:
    """Returns the columns about the shortest path; it is only computed for successes.

    Both the shortest path and that of the robot lead from the start to the edge of the last goal,
    where the success is declared. A run with jumps has a shortest path to each place from which the
    robot was taken, and one from each place to which it was brought.

    Args:
        scenario: The scenario.
        stage: The world and the goals.
        result: The result, with the outcome.
        measures: The measures of the run.
        jumped_after: Number of goals that were reached before each jump.
    """
    if not result.row["success"]:
        return {"spl": 0.0}
    tolerance = scenario.tolerance
    goals = [(goal, tolerance) for goal in stage.task.goals]
    here, first, shortest = stage.start[:2], 0, 0.0
    try:
        for (_, x1, y1, x2, y2), reached in zip(measures.jumps, jumped_after, strict=True):
            shortest += shortest_length(stage.task, here, [*goals[first:reached], ((x1, y1), 0.0)])
            here, first = (x2, y2), reached
        shortest += shortest_length(stage.task, here, goals[first:])
    except PlanningError:  # between walls that the robot passes with less room than the grid
        return {"spl": None}
    length = measures.length_to(goals[-1][0], tolerance)
    return {
        "shortest_path": shortest,
        "spl": success_weighted_length(True, shortest, length),
    }


def _thinned(path: list[tuple[float, float, float]]) -> list[tuple[float, float, float]]:
    """Returns at most `_MAX_PATH` points of a path, with the last one, rounded to 1 mm."""
    stride = max(1, math.ceil(len(path) / _MAX_PATH))
    kept = [*path[::stride], path[-1]] if path else []
    return [(round(t, 3), round(x, 3), round(y, 3)) for t, x, y in kept]
