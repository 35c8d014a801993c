"""The ROS node: time of a step, processor use, start, memory and services."""

from __future__ import annotations

import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
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
from timing import Mean

RUNS = 3  # repetitions of each measurement
SIMULATED = 100.0  # simulated time of a benchmark run [s]
CLOCK = "/clock:rosgraph_msgs/Clock"
SCAN = "/scan:sensor_msgs/LaserScan"
ODOMETRY = "/odometry/filtered:nav_msgs/Odometry"
TF = "/tf:tf2_msgs/TFMessage"
TWIST = "/twist:geometry_msgs/TwistWithCovarianceStamped"
MARKERS = "visualization_msgs/MarkerArray"
DEBUG = "/flatland_server/debug"
HANDLES = "/interactive_model_markers"

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
    """Measures the node in the benchmark world."""
    world = benchmark_world_path()
    with ros_session() as session, quiet(world) as quiet_world:
        laser = speed(session, world)
        unwanted = speed(session, quiet_world)
        subscribed = speed(session, world, CLOCK, SCAN, ODOMETRY)
        four = speed(session, world, SCAN, TF, ODOMETRY, TWIST)
        markers = _markers(world)
        displayed = speed(session, quiet_world, *markers, show_viz=True)
        use = statistics.fmean(_processor_use(session, quiet_world, SCAN) for _ in range(RUNS))
        displayed_use = statistics.fmean(
            _processor_use(session, quiet_world, *markers, show_viz=True) for _ in range(RUNS)
        )
        starts, peaks = zip(
            *(_start(session, session.server, world) for _ in range(RUNS)), strict=True
        )
        launch = partial(session.launch, "server.launch")
        launches, _ = zip(*(_start(session, launch, world) for _ in range(RUNS)), strict=True)
        spawn = _spawn(session, quiet_world)
    return [
        _step_row("step of the node, laser computed, no subscribers", laser, unit, 0.03),
        _step_row("step of the node, laser not wanted", unwanted, unit, 0.009),
        _step_row("step of the node, /scan, /odometry, /clock subscribed", subscribed, unit, 0.06),
        _step_row("step of the node, /scan, /tf, /odometry, /twist subscribed", four, unit, 0.05),
        _step_row("step of the node, all markers and handles subscribed", displayed, unit, 0.0115),
        Row("processor use at 200 Hz, all markers and handles", 100 * displayed_use, "%", 3.5),
        Row("processor use at 200 Hz, one subscriber of /scan", 100 * use, "%", 12.0),
        Row("time from the start of the node to the first step", min(starts), "s", 0.3),
        Row("time from roslaunch to the first step", min(launches), "s", 1.0),
        Row("peak memory of the node", max(peaks), "MB", 150.0),
        Row("call of /spawn_model while the simulation runs", 1e3 * spawn, "ms", 10.0),
    ]


def _step_row(name: str, step: Mean, unit: float, bar: float) -> Row:
    note = f"{step.seconds * 1e6:.1f} µs, {step.rate}"
    return Row(name, step.seconds / unit, "U", bar, note=note)


@contextmanager
def quiet(world_path: Path) -> Iterator[Path]:
    """Copies a world, without the `always_publish` of its plugins, and yields the path."""
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


def _markers(world: Path) -> list[str]:
    """Returns the topics of all markers and of the handles, after the option to drive."""
    properties = yaml.safe_load(world.read_text())
    layers = [layer["name"] for layer in properties["layers"]]
    first = [name if isinstance(name, str) else name[0] for name in layers]
    names = ["all_layers", "all_layers_3d", "all_models"]
    names += [f"layer/{name}{suffix}" for name in first for suffix in ("", "_3d")]
    names += [f"model/{model['name']}" for model in properties["models"]]
    return [
        "--drive",
        "/cmd_vel",
        *(f"{DEBUG}/{name}:{MARKERS}" for name in names),
        f"{DEBUG}/topics:flatland/DebugTopicList",
        f"{HANDLES}/update:visualization_msgs/InteractiveMarkerUpdate",
        f"{HANDLES}/update_full:visualization_msgs/InteractiveMarkerInit",
    ]


def speed(session: RosSession, world: Path, *topics: str, show_viz: bool = False) -> Mean:
    """Returns the time of a step as logged by the node, over all runs."""
    listener = _subscribe(session, *topics) if topics else None
    arguments = {"world_path": world, "benchmark_duration": SIMULATED, "seed": 1}
    times = []
    for _ in range(RUNS):
        program = (
            session.server(update_rate=0, show_viz=True, **arguments)
            if show_viz
            else session.launch("benchmark.launch", **arguments)
        )
        match = program.wait_for(r"wall time, ([\d.]+) iterations a second")
        times.append(1.0 / float(match[1]))
        session.stop(program)
    if listener is not None:
        session.stop(listener)
    return Mean.of(times)


def _subscribe(session: RosSession, *topics: str) -> Program:
    """Starts `listener.py` and waits until it has subscribed to the topics."""
    listener = session.start(sys.executable, str(Path(__file__).with_name("listener.py")), *topics)
    listener.wait_for("ready")
    return listener


def _processor_use(session: RosSession, world: Path, *topics: str, show_viz: bool = False) -> float:
    """Returns the fraction of a core that the node uses in real time with a subscriber."""
    listener = _subscribe(session, *topics)
    server = session.server(world_path=world, update_rate=200, seed=1, show_viz=show_viz)
    listener.wait_for(r"first /")
    time.sleep(1.0)  # until the start of the node is complete
    before, start = processor_time(server.pid), time.monotonic()
    time.sleep(5.0)
    use = (processor_time(server.pid) - before) / (time.monotonic() - start)
    session.stop(server)
    session.stop(listener)
    return use


def _start(session: RosSession, start: Callable[..., Program], world: Path) -> tuple[float, float]:
    """Returns the time to the first /clock after 0 [s], and the peak memory of the program [MB].

    The first message has the time 0 and is published before the world is loaded.
    """
    listener = _subscribe(session, CLOCK)
    server = start(world_path=world, update_rate=200, seed=1)
    match = listener.wait_for(r"running ([\d.]+)")
    time.sleep(2.0)  # until the interactive markers have been created
    peak = peak_memory(server.pid)
    session.stop(server)
    session.stop(listener)
    return float(match[1]) - server.started, peak


def _spawn(session: RosSession, world: Path) -> float:
    """Returns the time of a call of /spawn_model [s], including connection and response."""
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
            response = rospy.ServiceProxy("/spawn_model", SpawnModel)(
                str(model), name, name, Pose2D(8.0 + index, 0.0, 0.0)
            )
            times.append(time.perf_counter() - start)
            if not response.success:
                raise RuntimeError(f"the model was not spawned: {response.message}")
    session.stop(server)
    return min(times)
