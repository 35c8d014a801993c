"""Carries out runs in processes of this machine, which may hang, end or use too much memory."""

from __future__ import annotations

import contextlib
import logging
import multiprocessing
import os
import resource
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, Final

from flatland.scenarios.columns import error_row
from flatland.scenarios.controllers import is_stack
from flatland.scenarios.episode import Options, Result, recording_path, run_scenario
from flatland.scenarios.programs import MARK, adopt_orphans, end_marked, new_mark
from flatland.scenarios.scenario import Run
from flatland.scenarios.stack_options import StackOptions

MAX_ATTEMPTS: Final = 3
_CONTEXT: Final = multiprocessing.get_context("spawn")  # a fork could inherit a locked lock
_CHECK_PERIOD: Final = 0.05  # s; between two checks of the limits
OUT_OF_MEMORY: Final = "the run needed more memory than its limit"
_LOG: Final = logging.getLogger("flatland.scenarios")


@dataclass(frozen=True, slots=True)
class WorkerLimits:
    """What a run may use.

    Attributes:
        command_time: Wall time of one call of a controller [s].
        run_time: Wall time of a run [s]. For ROS nodes, the time in which they start is not part of
            it, and in real time neither is the simulated time.
        memory: Memory of a worker process in addition to that at its start [bytes].
        shows_output: Whether what a controller prints is shown.
    """

    command_time: float = 10.0
    run_time: float = 300.0
    memory: int = 2 << 30
    shows_output: bool = False


_STARTED: Final = "started"
"""Message of a worker that begins a run, so that its own start is not part of the run."""


def waits_of(run: Run, stack: StackOptions) -> tuple[float, float]:
    """Returns the wall time for which a call and a run may wait in addition to their limits [s].

    Nodes may take some time to start, and with the pace of real time, a simulated second takes a
    second.
    """
    if not is_stack(run.controller):
        return 0.0, 0.0
    if stack.pace == "lockstep":
        return 0.0, stack.start_time
    return run.scenario.robot.period, stack.start_time + run.scenario.limits.time


class _Worker:
    """A process that carries out one run at a time.

    Attributes:
        connection: Receives results, and is at its end when the process has ended.
        run: Index of the run in progress, None while the worker is idle.
    """

    def __init__(self, options: Options, limits: WorkerLimits) -> None:
        self.connection, theirs = _CONTEXT.Pipe()
        self._mark = new_mark()
        self._limits = limits
        self._stack = options.stack
        # Start of the current call of a controller, 0 outside of calls [s].
        self._began = _CONTEXT.Value("d", 0.0, lock=False)
        self._process = _CONTEXT.Process(
            target=_work, args=(theirs, self._began, options, limits, self._mark), daemon=True
        )
        self._process.start()
        self._socket = os.fstat(theirs.fileno()).st_ino  # Forks by the controller inherit it.
        theirs.close()
        self.run: int | None = None
        self._started = 0.0
        self._waits = (0.0, 0.0)  # Wall time of a call and a run that is not the controller's [s].

    def start(self, index: int, run: Run) -> None:
        """Begins a run."""
        self.run = index
        self._started = 0.0
        self._waits = waits_of(run, self._stack)
        with contextlib.suppress(OSError):  # The process has ended, which `receive` reports.
            self.connection.send(run)

    def receive(self) -> Result | None:
        """Returns the result of the run, None for a message without one.

        Raises:
            EOFError: The process has ended.
        """
        try:
            message = self.connection.recv()
        except OSError as error:
            raise EOFError from error
        if message == _STARTED:
            self._started = time.monotonic()
            return None
        self.run = None
        return message  # type: ignore[no-any-return]

    def exceeded(self) -> str:
        """Returns the limit that the run has exceeded, empty for none."""
        if self.run is None or not self._started:
            return ""
        now, began = time.monotonic(), self._began.value
        command_time = self._limits.command_time + self._waits[0]
        run_time = self._limits.run_time + self._waits[1]
        if began and now - began > command_time:
            return f"a call of the controller took more than {command_time:g} s of wall time"
        if now - self._started > run_time:
            return f"the run took more than {run_time:g} s of wall time"
        return ""

    @property
    def has_ended(self) -> bool:
        """Whether the process has ended, and left no message.

        The connection of a process that has ended is not at its end while a child of the process
        has inherited it.
        """
        return self._process.exitcode is not None and not self.connection.poll()

    def end(self) -> str:
        """Ends the process and all that it started, and returns how the process ended."""
        end_marked(self._mark, self._process.pid or 0, self._socket)
        self._process.join()
        self.connection.close()
        code = self._process.exitcode or 0
        return f"signal {-code}" if code < 0 else f"exit code {code}"


class _Pool:
    """Processes that carry out runs."""

    def __init__(
        self, runs: Sequence[Run], options: Options, limits: WorkerLimits, workers: int
    ) -> None:
        self._runs = runs
        self._options = options
        self._limits = limits
        self._waiting = deque(range(len(runs)))
        self._attempts = [0] * len(runs)
        self._workers = [_Worker(options, limits) for _ in range(min(workers, len(runs)))]

    @property
    def is_busy(self) -> bool:
        """Whether runs are waiting or in progress."""
        return bool(self._waiting) or any(worker.run is not None for worker in self._workers)

    def results(self) -> Iterator[Result]:
        """Starts runs on idle workers, and yields the results of the next few milliseconds."""
        for worker in self._workers:
            if worker.run is None and self._waiting:
                index = self._waiting.popleft()
                self._attempts[index] += 1
                worker.start(index, self._runs[index])
        ready = wait([worker.connection for worker in self._workers], _CHECK_PERIOD)
        for number, worker in enumerate(self._workers):
            if worker.connection in ready:
                result = self._receive(number)
            elif worker.has_ended:
                result = self._replace_ended(number)
            else:
                result = self._check(number)
            if result is not None:
                yield result

    def close(self) -> None:
        """Ends all processes."""
        for worker in self._workers:
            worker.end()

    def _receive(self, number: int) -> Result | None:
        worker = self._workers[number]
        try:
            result = worker.receive()
        except EOFError:
            return self._replace_ended(number)
        if result is not None and (
            result.row["error"] == OUT_OF_MEMORY or is_stack(result.row["controller"])
        ):
            self._replace(number)  # The memory may still be in use; ROS is started once.
        return result

    def _check(self, number: int) -> Result | None:
        worker = self._workers[number]
        reason, index = worker.exceeded(), worker.run
        if not reason or index is None:
            return None
        self._replace(number)
        return self._failed(index, reason)

    def _replace_ended(self, number: int) -> Result | None:
        """Replaces a process that has ended; its run is made again, or has failed."""
        index = self._workers[number].run
        reason = self._replace(number)
        if index is None:
            return None
        if self._attempts[index] < MAX_ATTEMPTS:
            title = self._runs[index].title
            _LOG.warning("a worker process ended (%s); repeating %s", reason, title)
            self._waiting.appendleft(index)
            return None
        why = f"the worker process ended in each of {MAX_ATTEMPTS} attempts ({reason})"
        return self._failed(index, why)

    def _replace(self, number: int) -> str:
        reason = self._workers[number].end()
        self._workers[number] = _Worker(self._options, self._limits)
        return reason

    def _failed(self, index: int, reason: str) -> Result:
        run = self._runs[index]
        recording = recording_path(run)
        exists = Path(self._options.out, recording).is_file()
        return Result(error_row(run.key, reason), recording=recording if exists else "")


def run_in_processes(
    runs: Sequence[Run],
    options: Options,
    limits: WorkerLimits,
    workers: int,
    is_stopped: Callable[[], object] = lambda: False,
) -> Iterator[Result]:
    """Yields the result of each run when it is completed.

    A run whose process ends is made again, up to `MAX_ATTEMPTS` times; one that exceeds a limit is
    not. Results do not depend on the number of processes.

    Args:
        runs: The runs.
        options: How they are carried out.
        limits: What a run may use.
        workers: Number of processes.
        is_stopped: Returns whether to end; runs in progress have no result then.
    """
    if not runs:
        return
    pool = _Pool(runs, options, limits, workers)
    try:
        while pool.is_busy and not is_stopped():
            yield from pool.results()
    finally:
        pool.close()


# -- in the worker process -----------------------------------------------------------------


def _work(
    connection: Connection, began: Any, options: Options, limits: WorkerLimits, mark: str
) -> None:
    """Carries out the runs that are received, until the main process ends."""
    _prepare(limits, mark)
    process = os.getpid()

    def begin_command(is_begin: bool) -> None:
        if os.getpid() != process:
            os._exit(0)  # A fork by the controller, which must not continue the run as well.
        began.value = time.monotonic() if is_begin else 0.0

    while True:
        try:
            run = connection.recv()
        except EOFError:
            return
        connection.send(_STARTED)
        try:
            result = run_scenario(run, options, begin_command)
        except MemoryError:
            began.value = 0.0
            result = Result(error_row(run.key, OUT_OF_MEMORY))
        connection.send(result)


def _prepare(limits: WorkerLimits, mark: str) -> None:
    """Leaves Ctrl-C to the main process, ends together with it, and limits the memory."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.environ[MARK] = mark
    os.setsid()
    adopt_orphans()
    logging.getLogger("flatland").setLevel(logging.ERROR)
    if not limits.shows_output:
        null_device = os.open(os.devnull, os.O_WRONLY)
        for stream in (1, 2):
            os.dup2(null_device, stream)
        os.close(null_device)
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * resource.getpagesize() + limits.memory
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    if hard == resource.RLIM_INFINITY or most < hard:
        resource.setrlimit(resource.RLIMIT_AS, (most, hard))
    parent = multiprocessing.parent_process()
    if parent is not None:

        def end_with_parent() -> None:
            parent.join()
            end_marked(mark, os.getpid())
            os._exit(1)

        threading.Thread(target=end_with_parent, daemon=True).start()
