"""Runs cells in processes of this machine, without Ray."""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Final

from flatland_sweep.cells import Cell, Row, Settings
from flatland_sweep.columns import row_of
from flatland_sweep.episode import run_cell

MAX_ATTEMPTS: Final = 3
_LOG = logging.getLogger("flatland_sweep")


def run_locally(
    cells: Sequence[Cell], settings: Settings, folder: str, workers: int
) -> Iterator[Row]:
    """Yields the row of each cell when it is completed.

    If a process ends, the pool does not report which of the cells that were running has caused
    this. Therefore, they are repeated one at a time. One that then ends its process in
    `MAX_ATTEMPTS` attempts gets a row with this error.

    Args:
        cells: The cells.
        settings: Settings of all cells.
        folder: Folder that relative paths of worlds and controllers start from.
        workers: Number of processes.
    """
    waiting = deque(cells)
    while waiting:
        interrupted: list[Cell] = []
        yield from _run_in_pool(waiting, settings, folder, workers, interrupted)
        for cell in interrupted:
            yield from _run_alone(cell, settings, folder)


def _run_in_pool(
    waiting: deque[Cell], settings: Settings, folder: str, workers: int, interrupted: list[Cell]
) -> Iterator[Row]:
    """Yields rows until no cell waits or a process ends.

    Args:
        waiting: The cells; those that were started are removed.
        settings: Settings of all cells.
        folder: Folder that relative paths of worlds and controllers start from.
        workers: Number of processes.
        interrupted: Receives the cells that were started but not completed.
    """
    running: dict[Future[Row], Cell] = {}
    pool = _pool(workers)
    try:
        while (waiting or running) and not interrupted:
            try:
                # Each process has a next cell ready.
                while waiting and len(running) < 2 * workers:
                    future = pool.submit(run_cell, waiting[0], settings, folder)
                    running[future] = waiting.popleft()
            except BrokenProcessPool:
                pass  # reported by the futures as well
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                cell = running.pop(future)
                if isinstance(future.exception(), BrokenProcessPool):
                    interrupted.append(cell)
                else:
                    yield future.result()
        for future, cell in running.items():
            # All others have been cancelled or completed by now.
            if isinstance(future.exception(), BrokenProcessPool):
                interrupted.append(cell)
            else:
                yield future.result()
    finally:
        _stop(pool)


def _run_alone(cell: Cell, settings: Settings, folder: str) -> Iterator[Row]:
    """Yields the row of a cell that may end its process."""
    for _ in range(MAX_ATTEMPTS):
        _LOG.warning("a worker process ended; repeating %s", cell)
        pool = _pool(1)
        try:
            yield pool.submit(run_cell, cell, settings, folder).result()
        except BrokenProcessPool:
            continue
        finally:
            _stop(pool)
        return
    yield row_of(
        cell, outcome="error", error=f"the worker process ended in each of {MAX_ATTEMPTS} attempts"
    )


def _pool(workers: int) -> ProcessPoolExecutor:
    # A forked process could inherit a lock that another thread holds.
    context = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(workers, context, initializer=_prepare_worker)


def _stop(pool: ProcessPoolExecutor) -> None:
    processes = list((pool._processes or {}).values())
    pool.shutdown(wait=False, cancel_futures=True)
    # They hold nothing that must be saved; one may be in the middle of a long episode.
    for process in processes:
        process.terminate()
    for process in processes:
        process.join()


def _prepare_worker() -> None:
    """Leaves Ctrl-C to the main process, and ends this one together with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    logging.getLogger("flatland").setLevel(logging.ERROR)
    parent = multiprocessing.parent_process()
    if parent is not None:

        def end_with_parent() -> None:
            parent.join()
            os._exit(1)

        threading.Thread(target=end_with_parent, daemon=True).start()
