"""The node: steps on ROS, processor use, start, memory, services."""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import yaml

from ros_session import (  # isort: skip
    Program,
    RosSession,
    peak_memory,
    processor_time,
    ros_session,
)
from scenes import benchmark_world_path
from table import Row

RUNS = 3  # of each figure, the best of which counts
SIMULATED = 100.0  # s of a benchmark run
CLOCK = "/clock:rosgraph_msgs/Clock"
SCAN = "/scan:sensor_msgs/LaserScan"
ODOMETRY = "/odometry/filtered:nav_msgs/Odometry"

SPAWNED = """
bodies:
  - name: base
    footprints: [{type: circle, radius: 0.2, density: 50}]
plugins:
  - {type: DiffDrive, name: drive, body: base, pub_rate: 50}
  - {type: Laser, name: laser, body: base, range: 20, update_rate: 10,
     angle: {min: -1.5, max: 1.5, increment: 0.01}}
"""


def rows(unit: float) -> list[Row]:
    """Measures the node on the benchmark world."""
    world = benchmark_world_path()
    with ros_session() as session, _quiet(world) as quiet_world:
        laser = _fastest(session, world)
        quiet = _fastest(session, quiet_world)
        listened = _fastest(session, world, CLOCK, SCAN, ODOMETRY)
        use = min(_processor_use(session, quiet_world) for _ in range(RUNS))
        starts, peaks = zip(*(_start(session, world) for _ in range(RUNS)), strict=True)
        spawn = _spawn(session, quiet_world)
    return [
        _step_row("step of the node, laser computed, no subscriber", laser, unit, 0.03),
        _step_row("step of the node, nobody wants the laser", quiet, unit, 0.009),
        _step_row("step of the node, /scan, /odometry, /clock subscribed", listened, unit, 0.06),
        Row("processor use at 200 Hz, one /scan subscriber", 100 * use, "%", 12.0),
        Row("start of the node to the first /clock", min(starts), "s", 1.0),
        Row("peak memory of the node", max(peaks), "MB", 150.0),
        Row("spawn of a model by service while running", 1e3 * spawn, "ms", 10.0),
    ]


def _step_row(name: str, seconds: float, unit: float, bar: float) -> Row:
    note = f"{seconds * 1e6:.1f} µs, {1 / seconds:.0f} steps a second"
    return Row(name, seconds / unit, "U", bar, note=note)


@contextmanager
def _quiet(world_path: Path) -> Iterator[Path]:
    """A copy of a world whose lasers scan only for those who listen."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file in world_path.parent.iterdir():
            if not file.is_file():
                continue
            copy = folder / file.name
            copy.symlink_to(file)
            if file.name.endswith(".model.yaml"):
                model = yaml.safe_load(file.read_text())
                for plugin in model.get("plugins") or []:
                    plugin.pop("always_publish", None)
                copy.unlink()
                copy.write_text(yaml.safe_dump(model))
        yield folder / world_path.name


def _fastest(session: RosSession, world: Path, *topics: str) -> float:
    """Returns the time of a step [s] in `benchmark.launch`, as the node itself tells."""
    listener = _listen(session, *topics) if topics else None
    rates = []
    for _ in range(RUNS):
        program = session.launch(
            "benchmark.launch", world_path=world, benchmark_duration=SIMULATED, seed=1
        )
        match = program.wait_for(r"wall time, ([\d.]+) iterations a second")
        rates.append(float(match[1]))
        session.stop(program)
    if listener is not None:
        session.stop(listener)
    return 1.0 / max(rates)


def _listen(session: RosSession, *topics: str) -> Program:
    listener = session.start(sys.executable, str(Path(__file__).with_name("listener.py")), *topics)
    listener.wait_for("ready")
    return listener


def _processor_use(session: RosSession, world: Path) -> float:
    """Returns the share of a core that the node uses in real time with one subscriber."""
    listener = _listen(session, SCAN)
    server = session.server(world_path=world, update_rate=200, seed=1)
    listener.wait_for(r"first /scan")
    time.sleep(1.0)  # until it has settled
    before, start = processor_time(server.pid), time.monotonic()
    time.sleep(5.0)
    use = (processor_time(server.pid) - before) / (time.monotonic() - start)
    session.stop(server)
    session.stop(listener)
    return use


def _start(session: RosSession, world: Path) -> tuple[float, float]:
    """Returns the time to the first /clock [s], and the node's peak memory [MB]."""
    listener = _listen(session, CLOCK)
    server = session.server(world_path=world, update_rate=200, seed=1)
    match = listener.wait_for(r"first /clock ([\d.]+)")
    time.sleep(2.0)  # the interactive markers come a little later
    peak = peak_memory(server.pid)
    session.stop(server)
    session.stop(listener)
    return float(match[1]) - server.started, peak


def _spawn(session: RosSession, world: Path) -> float:
    """Returns the time of a call of /spawn_model [s], connection and answer included."""
    os.environ.update({k: v for k, v in session.environment.items() if k.startswith("ROS_")})
    import rospy
    from geometry_msgs.msg import Pose2D

    from flatland.srv import SpawnModel

    server = session.server(world_path=world, update_rate=200, seed=1)
    times = []
    with tempfile.TemporaryDirectory() as folder:
        model = Path(folder) / "spawned.model.yaml"
        model.write_text(SPAWNED)
        rospy.wait_for_service("/spawn_model", 30.0)
        for index in range(10):
            start = time.perf_counter()
            name = f"spawned{index}"
            answer = rospy.ServiceProxy("/spawn_model", SpawnModel)(
                str(model), name, name, Pose2D(8.0 + index, 0.0, 0.0)
            )
            times.append(time.perf_counter() - start)
            if not answer.success:
                raise RuntimeError(f"the model was not spawned: {answer.message}")
    session.stop(server)
    return min(times)
