"""The rate that the node holds with a hundred robots, its jitter, and how fast others connect."""

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

from crowd import MOST, crowd_file  # isort: skip
from node import SPAWNED
from recorder import MANIFEST, MODEL
from ros_session import RosSession, ros_session
from table import Row

RATE = 200.0  # Hz
DURATION = 60.0  # s of wall time
SETTLING = 2.0  # s of wall time that are left out
BUSY_LOOPS = 2
CONNECTIONS = 10  # of each kind, the slowest of which counts


def rows(unit: float) -> list[Row]:
    """Measures the node with a hundred robots whose lasers all fire in the same step."""
    del unit  # Rates and lateness are those of a clock.
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
            Row(f"{what} at full speed, 100 robots, slowest of {CONNECTIONS}", slowest, "s", 0.2)
            for what, slowest in connections
        ),
    ]


def _rate_rows(where: str, starts: npt.NDArray[np.float64]) -> list[Row]:
    rate = (len(starts) - 1) / (starts[-1] - starts[0])
    late = 1e3 * _lateness(starts)
    name = f"at {RATE:g} Hz, 100 robots, {where}"
    note = f"{rate:.3f} Hz over {DURATION:g} s"
    return [
        Row(f"steps a second {name}", rate, "Hz", RATE - 0.05, at_least=True, note=note),
        *(
            Row(f"lateness of a cycle {name}, {which}", figure, "ms")
            for which, figure in (
                ("p50", float(np.percentile(late, 50))),
                ("p99", float(np.percentile(late, 99))),
                ("max", float(late.max())),
            )
        ),
    ]


def _lateness(starts: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Returns by how much each cycle started after its due time [s].

    The due times are those of `Simulation`: regular, but for lag beyond `MAX_LAG`.
    """
    period = 1.0 / RATE
    # Some cycle of the first second started in time.
    first = starts[: int(RATE)]
    due = float(np.min(first - period * np.arange(len(first))))
    late = np.empty(len(starts))
    for index, start in enumerate(starts):
        due = max(due, start - max(MAX_LAG, period))
        late[index] = start - due
        due += period
    return late


@contextmanager
def _recorded_world(file: Path) -> Iterator[tuple[Path, Path]]:
    """A world file of a hundred robots with a recorder in front, and the recorder's manifest."""
    with crowd_file(slice(MOST), scans=True) as path:
        world = yaml.safe_load(path.read_text())
        world["models"].insert(0, {"name": "recorder", "model": "recorder.model.yaml"})
        path.write_text(yaml.safe_dump(world))
        (path.parent / "recorder.model.yaml").write_text(MODEL.format(file=file))
        manifest = path.parent / "recorder.xml"
        manifest.write_text(MANIFEST.format(folder=Path(__file__).resolve().parent))
        yield path, manifest


def _cycle_starts(session: RosSession) -> npt.NDArray[np.float64]:
    """Returns when the cycles of a run in real time started [s]."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "starts.npy"
        with _recorded_world(file) as (world, manifest):
            session.environment["FLATLAND_PLUGIN_PATH"] = str(manifest)
            server = session.server(world_path=world, update_rate=RATE, seed=1)
            server.wait_for("cycle use")
            time.sleep(SETTLING + DURATION)
            session.stop(server)
            del session.environment["FLATLAND_PLUGIN_PATH"]
        starts: npt.NDArray[np.float64] = np.load(file)
    return starts[starts > starts[-1] - DURATION]


def _connections(session: RosSession) -> list[tuple[str, float]]:
    """Returns what connected, and the time of the slowest one [s]."""
    found = []
    with crowd_file(slice(MOST), scans=False) as world:
        model = world.with_name("spawned.model.yaml")
        model.write_text(SPAWNED)
        server = session.server(world_path=world, update_rate=0, seed=1)
        script = str(Path(__file__).with_name("connector.py"))
        robots = [f"robot{index}" for index in range(CONNECTIONS)]
        connector = session.start(sys.executable, script, str(model), *robots)
        for word, what in (
            ("publisher", "connection of a publisher"),
            ("subscriber", "connection of a subscriber"),
            ("spawn", "spawn of a model with its topics"),
        ):
            match = connector.wait_for(rf"{word} (.*)\n")
            found.append((what, max(map(float, match[1].split()))))
        session.stop(connector)
        session.stop(server)
    return found
