"""Runs cells on a Ray cluster."""

from __future__ import annotations

import logging
import os
import socket
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import ray

from flatland_sweep.cells import Cell, Row, Settings, SweepError
from flatland_sweep.columns import row_of
from flatland_sweep.episode import run_cell

MAX_ATTEMPTS: Final = 4
_CONNECT_TIMEOUT: Final = 10.0  # s
_OBJECT_STORE: Final = 100_000_000  # bytes; rows are small


@contextmanager
def connection(address: str | None, workers: int | None, working_dir: str | None) -> Iterator[None]:
    """Connects to a cluster, or starts one on this machine, for the duration of a block.

    Args:
        address: Address of a cluster, `auto` for one on this machine; None to start one.
        workers: Number of worker processes of a new cluster; None for one per core.
        working_dir: Folder that is copied to all machines and becomes the current folder of the
            workers; None if all files exist on all machines.

    Raises:
        SweepError: The cluster cannot be reached.
    """
    if address is not None:
        _check_reachable(address)
    package = str(Path(__file__).resolve().parent)
    environment: dict[str, Any] = {"py_modules": [package]}
    if working_dir is not None:
        environment["working_dir"] = working_dir
    options: dict[str, Any] = {}
    if address is None:
        # Ray would send statistics of its use; the owner of another cluster decides on that.
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        options = {
            "address": "local",  # even if another cluster runs on this machine
            "num_cpus": workers or os.cpu_count(),
            "include_dashboard": False,
            "object_store_memory": _OBJECT_STORE,
        }
    else:
        options = {"address": address}
    try:
        ray.init(
            runtime_env=environment,
            log_to_driver=False,  # Workers log warnings of each world.
            logging_level=logging.ERROR,
            **options,
        )
    except (ConnectionError, RuntimeError, ValueError, OSError) as error:
        raise SweepError(f"Ray cannot be started or reached: {error}") from error
    try:
        yield
    finally:
        ray.shutdown()


def _check_reachable(address: str) -> None:
    """Checks that a server accepts connections, for which Ray itself waits several minutes."""
    if address == "auto":
        return
    host, colon, port = address.removeprefix("ray://").rpartition(":")
    if not (colon and host and port.isdigit()):
        raise SweepError(f"--address must be auto or HOST:PORT, got {address!r}")
    try:
        socket.create_connection((host, int(port)), _CONNECT_TIMEOUT).close()
    except (OSError, OverflowError) as error:
        raise SweepError(f"Ray cannot be reached at {address}: {error}") from error


def run_on_cluster(
    cells: Sequence[Cell], settings: Settings, folder: str, workers: int | None
) -> Iterator[Row]:
    """Yields the row of each cell when it is completed.

    Ray repeats a cell whose process or machine fails; after `MAX_ATTEMPTS` attempts, the cell gets
    a row with this error.

    Args:
        cells: The cells.
        settings: Settings of all cells.
        folder: Folder that relative paths of worlds and controllers start from; empty for the
            current folder of the workers.
        workers: Maximum number of cells that run at the same time; None for all cores.

    Raises:
        SweepError: The workers cannot run any cell.
    """
    remote = ray.remote(num_cpus=1, max_retries=MAX_ATTEMPTS - 1)(run_cell)
    settings_ref = ray.put(settings)
    waiting = deque(cells)
    running: dict[Any, Cell] = {}
    while waiting or running:
        limit = workers or 2 * max(1, int(ray.cluster_resources().get("CPU", 1)))
        while waiting and len(running) < limit:
            cell = waiting.popleft()
            running[remote.remote(cell, settings_ref, folder)] = cell
        for done in ray.wait(list(running), num_returns=1)[0]:
            cell = running.pop(done)
            try:
                row = ray.get(done)
            except (
                ray.exceptions.WorkerCrashedError,
                ray.exceptions.OutOfMemoryError,
                ray.exceptions.NodeDiedError,
            ) as error:
                reason = str(error).strip().splitlines()[0]
                row = row_of(
                    cell,
                    outcome="error",
                    error=f"{type(error).__name__} in each of {MAX_ATTEMPTS} attempts: {reason}",
                )
            except ray.exceptions.RayError as error:
                raise SweepError(f"a worker cannot run cells: {error}") from error
            yield row
