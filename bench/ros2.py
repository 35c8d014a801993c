"""The node of ROS 2: latency of scans, speed beside the node of ROS 1, processor use and start."""

from __future__ import annotations

import os
import random
import statistics
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from node import ODOMETRY, RUNS, SCAN, TF, speed
from ros_session import CHECKOUT, Program, processor_time, ros_session
from scenes import benchmark_world_path
from table import Row

DISTRIBUTION = "kilted"
PYTHON = CHECKOUT / "build" / "ros2" / DISTRIBUTION / "bin" / "python"
LISTENER = str(Path(__file__).with_name("ros2_listener.py"))
DRIVE = ("--drive", "/cmd_vel")
CLOCK = "/clock:rosgraph_msgs/Clock"
# Of a free-running simulation, so that the stamp of a scan is the wall time at which the step that
# computes it has begun. A scan follows after each 250 of these steps: the client keeps up.
FREE_RUNNING = {"use_sim_time": False, "update_rate": 0.0, "step_size": 0.0001}
SCANS_DURATION = 10.0  # s
SPEED_DURATION = 5.0  # s
STEP_SIZE = 0.005  # s, the default


def rows(_unit: float) -> list[Row]:
    """Measures the node in the benchmark world; returns no rows without an environment."""
    if not PYTHON.exists():
        print(f"ros2: not measured, {PYTHON} does not exist (tools/ros2_setup.sh {DISTRIBUTION})")
        return []
    world = benchmark_world_path()
    with ros_session() as session:
        ros_1 = speed(session, world, *DRIVE, SCAN, TF, ODOMETRY)
    ros_2 = statistics.fmean(_steps_per_second(world) for _ in range(RUNS))
    p50, p95, count = _latency(world)
    use = statistics.fmean(_processor_use(world) for _ in range(RUNS))
    start = min(_start(world) for _ in range(RUNS))
    note = f"{count} scans"
    return [
        Row("ROS 2: 1081 beams from step to client, median", 1e6 * p50, "µs", note=note),
        Row("ROS 2: 1081 beams from step to client, p95", 1e6 * p95, "µs", 500.0, note=note),
        Row(
            "ROS 2: steps per second / ROS 1, /scan, /tf, /odometry, /cmd_vel in use",
            ros_2 * ros_1.seconds,
            "",
            0.5,
            at_least=True,
            note=f"{ros_2:,.0f} per second, ROS 1 {ros_1.rate}".replace(",", " "),
        ),
        Row("ROS 2: processor use at 200 Hz, one subscriber of /scan", 100 * use, "%"),
        Row("ROS 2: time from the start of the node to the first step", start, "s"),
    ]


class _Processes:
    """Processes of ROS 2 in a domain of their own."""

    def __init__(self) -> None:
        kept = ("HOME", "LANG", "PATH", "TMPDIR")
        self._environment = {
            **{name: os.environ[name] for name in kept if name in os.environ},
            "PYTHONPATH": str(CHECKOUT),
            "PYTHONUNBUFFERED": "1",
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "ROS_DOMAIN_ID": str(random.SystemRandom().randrange(1, 101)),
        }
        self._programs: list[Program] = []

    def start(self, *arguments: str) -> Program:
        """Starts Python of ROS 2."""
        self._programs.append(Program([str(PYTHON), *arguments], self._environment))
        return self._programs[-1]

    def server(self, **parameters: object) -> Program:
        """Starts the node."""
        given = [
            word
            for name, value in parameters.items()
            for word in ("-p", f"{name}:={str(value).lower() if value in (True, False) else value}")
        ]
        return self.start("-m", "flatland.ros2", "--ros-args", *given)

    def listener(self, *topics: str) -> Program:
        """Starts a subscriber and waits until it has subscribed."""
        listener = self.start(LISTENER, *topics)
        listener.wait_for("ready")
        return listener

    def close(self) -> None:
        """Stops all processes, in reverse order of their start."""
        while self._programs:
            self._programs.pop().stop()


@contextmanager
def _processes() -> Iterator[_Processes]:
    processes = _Processes()
    try:
        yield processes
    finally:
        processes.close()


def _steps_per_second(world: Path) -> float:
    """Returns the steps per second with subscribers and commands.

    They follow from the stamps of the scans that arrive: a run of limited duration would contain a
    time without subscribers, since DDS discovers these in the background.
    """
    with _processes() as processes:
        listener = processes.listener(*DRIVE, SCAN, TF, ODOMETRY)
        processes.server(world_path=world, update_rate=0.0, step_size=STEP_SIZE, seed=1)
        listener.wait_for("first /scan")
        time.sleep(SPEED_DURATION)
        listener.interrupt()
        return float(listener.wait_for(r"speed (\S+)")[1]) / STEP_SIZE


def _latency(world: Path) -> tuple[float, float, int]:
    """Returns the median and the 95th percentile of the latency of scans [s], and their number."""
    with _processes() as processes:
        listener = processes.listener(SCAN)
        processes.server(world_path=world, seed=1, **FREE_RUNNING)
        listener.wait_for("first /scan")
        time.sleep(SCANS_DURATION)
        listener.interrupt()
        match = listener.wait_for(r"latency (\S+) (\S+) (\d+)")
        return float(match[1]), float(match[2]), int(match[3])


def _processor_use(world: Path) -> float:
    """Returns the fraction of a core that the node uses in real time with a subscriber."""
    with _processes() as processes:
        listener = processes.listener(SCAN)
        node = processes.server(world_path=world, update_rate=200.0, seed=1)
        listener.wait_for("first /scan")
        time.sleep(1.0)  # until the start of the node is complete
        before, start = processor_time(node.pid), time.monotonic()
        time.sleep(5.0)
        return (processor_time(node.pid) - before) / (time.monotonic() - start)


def _start(world: Path) -> float:
    """Returns the time to the first /clock after 0 [s]."""
    with _processes() as processes:
        listener = processes.listener(CLOCK)
        node = processes.server(world_path=world, update_rate=200.0, seed=1)
        return float(listener.wait_for(r"running ([\d.]+)")[1]) - node.started
