"""Carries out runs on a Ray cluster.

Each task of Ray is a batch of runs in a process of its own on the machine of the task, with the
same limits as on one machine.
"""

from __future__ import annotations

import dataclasses
import logging
import os
import pickle
import socket
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from flatland.errors import FlatlandError
from flatland.extras import require
from flatland.output_files import write_bytes
from flatland.scenarios.columns import error_row
from flatland.scenarios.episode import Result
from flatland.scenarios.scenario import Run
from flatland.scenarios.suite import Plan
from flatland.scenarios.workers import MAX_ATTEMPTS, run_in_processes
from flatland.scenarios.worlds import world_file

_BATCH: Final = 8  # runs of a task
_CONNECT_TIMEOUT: Final = 10.0  # s
_OBJECT_STORE: Final = 100_000_000  # bytes; results are small
_PACKAGE: Final = "flatland:"
_FOLDER: Final = "folder:"

Recordings = dict[str, bytes]
"""Contents of recordings by their paths in the folder of the results."""


class ClusterError(FlatlandError):
    """A Ray cluster cannot be used."""

    prefix = "Flatland Ray: "


@dataclasses.dataclass(frozen=True, slots=True)
class Cluster:
    """Where runs are carried out.

    Attributes:
        address: Address of a cluster, `auto` for one on this machine; empty to start one.
        working_dir: Folder that is copied to all machines; empty if all files exist on all machines
            at the same paths.
    """

    address: str = ""
    working_dir: str = ""

    def run(
        self, runs: Sequence[Run], plan: Plan, is_stopped: Callable[[], object]
    ) -> Iterator[Result]:
        """Yields the result of each run when its batch is completed.

        Raises:
            ClusterError: The cluster cannot be reached, or its workers cannot carry out any run.
        """
        if not runs:
            return
        with self._connection(plan.workers) as ray:
            yield from self._run(ray, runs, plan, is_stopped)

    def _run(
        self, ray: Any, runs: Sequence[Run], plan: Plan, is_stopped: Callable[[], object]
    ) -> Iterator[Result]:
        remote = ray.remote(num_cpus=1, max_retries=MAX_ATTEMPTS - 1)(task())
        names = _names(self.working_dir)
        waiting = deque(_batches(runs, max(1, int(ray.cluster_resources().get("CPU", 1)))))
        running: dict[Any, list[Run]] = {}
        while (waiting or running) and not is_stopped():
            limit = plan.workers or 2 * max(1, int(ray.cluster_resources().get("CPU", 1)))
            while waiting and len(running) < limit:
                batch = waiting.popleft()
                sent = pickle.dumps(_renamed([batch, plan], names))
                running[remote.remote(sent)] = batch
            for done in ray.wait(list(running), num_returns=1, timeout=0.2)[0]:
                batch = running.pop(done)
                try:
                    results, recordings = ray.get(done)
                except (
                    ray.exceptions.WorkerCrashedError,
                    ray.exceptions.OutOfMemoryError,
                    ray.exceptions.NodeDiedError,
                ) as error:
                    if len(batch) > 1:  # The others are not affected by the one that ends it.
                        waiting.extend([run] for run in batch)
                        continue
                    reason = str(error).strip().splitlines()[0]
                    why = f"{type(error).__name__} in each of {MAX_ATTEMPTS} attempts: {reason}"
                    results, recordings = [Result(error_row(run.key, why)) for run in batch], {}
                except ray.exceptions.RayError as error:
                    raise ClusterError(f"a worker cannot carry out runs: {error}") from error
                _keep(recordings, batch, results, Path(plan.options.out))
                yield from results

    @contextmanager
    def _connection(self, workers: int | None) -> Iterator[Any]:
        """Connects to a cluster, or starts one on this machine, for the duration of a block."""
        ray = require("ray", "`flatland test --ray` needs")
        if self.address:
            _check_reachable(self.address)
            options: dict[str, Any] = {"address": self.address}
        else:
            # Ray would send statistics of its use; the owner of another cluster decides on that.
            os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
            options = {
                "address": "local",  # even if another cluster runs on this machine
                "num_cpus": workers or os.cpu_count(),
                "include_dashboard": False,
                "object_store_memory": _OBJECT_STORE,
            }
        environment = {"working_dir": self.working_dir} if self.working_dir else {}
        try:
            ray.init(
                runtime_env=environment,
                log_to_driver=False,  # Workers log warnings of each world.
                logging_level=logging.ERROR,
                **options,
            )
        except (ConnectionError, RuntimeError, ValueError, OSError) as error:
            raise ClusterError(f"Ray cannot be started or reached: {error}") from error
        try:
            yield ray
        finally:
            ray.shutdown()


def _check_reachable(address: str) -> None:
    """Checks that a server accepts connections, for which Ray itself waits several minutes."""
    if address == "auto":
        return
    host, colon, port = address.removeprefix("ray://").rpartition(":")
    if not (colon and host and port.isdigit()):
        raise ClusterError(f"the address must be auto or HOST:PORT, got {address!r}")
    try:
        socket.create_connection((host, int(port)), _CONNECT_TIMEOUT).close()
    except (OSError, OverflowError) as error:
        raise ClusterError(f"Ray cannot be reached at {address}: {error}") from error


def _batches(runs: Sequence[Run], cores: int) -> Iterator[list[Run]]:
    """Yields batches that are small enough for all cores to have some."""
    size = max(1, min(_BATCH, len(runs) // (2 * cores)))
    for start in range(0, len(runs), size):
        yield list(runs[start : start + size])


def _keep(
    recordings: Recordings, batch: Sequence[Run], results: Sequence[Result], out: Path
) -> None:
    """Writes the recordings of other machines, and the random worlds that they refer to."""
    for result in results:
        if result.recording not in recordings:
            continue
        path = out / result.recording
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_bytes(path, recordings[result.recording])
        except OSError as error:
            result.recording_error = error.strerror or str(error)
    recorded = {result.row["scenario"] for result in results if result.recording}
    for run in batch:
        if run.scenario.title in recorded:
            world_file(run.scenario, run.seed, out / "worlds")


# -- on the machine of a worker ------------------------------------------------------------


def task() -> Callable[[bytes], Any]:
    """Returns the function that Ray runs; it is sent as code, not by its name.

    The workers of Ray search the current folder first. There, the sources of a clone, which have no
    extension, would hide the installed package.
    """

    def run(sent: bytes) -> Any:
        import sys
        from pathlib import Path

        def extensions(entry: str) -> list[Path]:
            return list(Path(entry, "flatland").glob("_core.*so"))

        if any(map(extensions, sys.path)):
            sys.path[:] = [
                entry
                for entry in sys.path
                if extensions(entry) or not Path(entry, "flatland", "__init__.py").is_file()
            ]
        from flatland.scenarios.cluster import run_batch

        return run_batch(sent)

    return run


def run_batch(sent: bytes) -> tuple[list[Result], Recordings]:
    """Carries out a batch in one process, and returns the results with the recordings."""
    names = {name: path for path, name in _names(str(Path.cwd())).items()}
    batch, plan = _renamed(pickle.loads(sent), names)  # noqa: S301 - from the main program
    results = list(run_in_processes(batch, plan.options, plan.limits, 1))
    out = Path(plan.options.out)
    recordings = {
        result.recording: (out / result.recording).read_bytes()
        for result in results
        if result.recording
    }
    return results, recordings


def _names(working_dir: str) -> dict[str, str]:
    """Returns the names of the folders whose paths differ between machines."""
    names = {str(Path(__file__).parents[1]): _PACKAGE}
    if working_dir:
        names[str(Path(working_dir).absolute())] = _FOLDER
    return names


def _renamed(value: Any, names: Mapping[str, str]) -> Any:
    """Returns a value with other starts of all paths in it.

    Args:
        value: Texts in lists, tuples, dictionaries and dataclasses.
        names: New start of a path by its old one.
    """
    if isinstance(value, str):
        for old, new in names.items():
            if value == old or value.startswith((f"{old}/", f"{old}:")):
                return new + value.removeprefix(old)
        return value
    if isinstance(value, list | tuple):
        return type(value)(_renamed(item, names) for item in value)
    if isinstance(value, dict):
        return {key: _renamed(item, names) for key, item in value.items()}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {
            one.name: _renamed(getattr(value, one.name), names) for one in dataclasses.fields(value)
        }
        return type(value)(**fields)
    return value
