"""Actual rate and jitter of the node with 100 robots, and the time in which clients connect."""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import numpy.typing as npt
import yaml

from flatland.simulation import MAX_LAG

from crowd import MAX_ROBOTS, crowd_file  # isort: skip
from node import SPAWNED
from recorder import MANIFEST, MODEL
from ros_session import RosSession, ros_session
from table import Row

RATE = 200.0  # Hz
DURATION = 60.0  # evaluated wall time [s]
SETTLING_TIME = 2.0  # wall time before the evaluation [s]
BUSY_LOOPS = 2
CONNECTIONS = 10  # per kind; the slowest one counts


def rows(unit: float) -> list[Row]:
    """Measures the node with robots whose lasers are all computed in the same step."""
    del unit  # rates and delays are absolute
    with ros_session() as session:
        idle = _cycle_starts(session)
        busy = [session.start(sys.executable, "-c", "while True: pass") for _ in range(BUSY_LOOPS)]
        loaded = _cycle_starts(session)
        for program in busy:
            session.stop(program)
        connections = _connections(session)
    return [
        *_rate_rows("idle", idle),
        *_rate_rows(f"beside {BUSY_LOOPS} busy loops", loaded),
        *(
            Row(
                f"{kind} at full speed, {MAX_ROBOTS} robots, slowest of {CONNECTIONS}",
                slowest,
                "s",
                0.2,
            )
            for kind, slowest in connections
        ),
    ]


def _rate_rows(where: str, starts: npt.NDArray[np.float64]) -> list[Row]:
    rate = (len(starts) - 1) / (starts[-1] - starts[0])
    delays = 1e3 * _delays(starts)
    name = f"at {RATE:g} Hz, {MAX_ROBOTS} robots, {where}"
    note = f"{rate:.3f} Hz over {DURATION:g} s"
    return [
        Row(f"step rate {name}", rate, "Hz", RATE - 0.05, at_least=True, note=note),
        *(
            Row(f"delay of a cycle {name}, {statistic}", value, "ms")
            for statistic, value in (
                ("median", float(np.median(delays))),
                ("99th percentile", float(np.percentile(delays, 99))),
                ("maximum", float(delays.max())),
            )
        ),
    ]


def _delays(starts: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Returns the delay of each cycle relative to its due time [s].

    As in `Simulation`, due times are periodic, except that lag beyond `MAX_LAG` is not made up for.
    """
    period = 1.0 / RATE
    # Assumes that at least one cycle of the first second started on time.
    first = starts[: int(RATE)]
    due = float(np.min(first - period * np.arange(len(first))))
    delays = np.empty(len(starts))
    for index, start in enumerate(starts):
        due = max(due, start - max(MAX_LAG, period))
        delays[index] = start - due
        due += period
    return delays


@contextmanager
def _recorded_world(file: Path) -> Iterator[tuple[Path, Path]]:
    """Yields the paths of a world file, whose first model is a recorder, and of its manifest."""
    with crowd_file(slice(MAX_ROBOTS), scans=True) as path:
        world = yaml.safe_load(path.read_text())
        world["models"].insert(0, {"name": "recorder", "model": "recorder.model.yaml"})
        path.write_text(yaml.safe_dump(world))
        (path.parent / "recorder.model.yaml").write_text(MODEL.format(file=file))
        manifest = path.parent / "recorder.xml"
        manifest.write_text(MANIFEST.format(folder=Path(__file__).resolve().parent))
        yield path, manifest


def _cycle_starts(session: RosSession) -> npt.NDArray[np.float64]:
    """Runs the node in real time and returns the start times of its cycles [s]."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "starts.npy"
        with _recorded_world(file) as (world, manifest):
            session.environment["FLATLAND_PLUGIN_PATH"] = str(manifest)
            server = session.server(world_path=world, update_rate=RATE, seed=1)
            server.wait_for("loaded")
            time.sleep(SETTLING_TIME + DURATION)
            session.stop(server)
            del session.environment["FLATLAND_PLUGIN_PATH"]
        starts: npt.NDArray[np.float64] = np.load(file)
    return starts[starts > starts[-1] - DURATION]


def _connections(session: RosSession) -> list[tuple[str, float]]:
    """Returns the name of each kind of connection and the time of the slowest one [s]."""
    found = []
    with crowd_file(slice(MAX_ROBOTS), scans=False) as world:
        model = world.with_name("spawned.model.yaml")
        model.write_text(SPAWNED)
        server = session.server(world_path=world, update_rate=0, seed=1)
        script = str(Path(__file__).with_name("connector.py"))
        robots = [f"robot{index}" for index in range(CONNECTIONS)]
        connector = session.start(sys.executable, script, str(model), *robots)
        for keyword, kind in (
            ("publisher", "connection of a publisher"),
            ("subscriber", "connection of a subscriber"),
            ("spawn", "spawn of a model with topics"),
        ):
            match = connector.wait_for(rf"{keyword} (.*)\n")
            found.append((kind, max(map(float, match[1].split()))))
        session.stop(connector)
        session.stop(server)
    return found
