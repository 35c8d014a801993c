"""Runs flatland for a long time and checks that nothing grows: `make soak`.

Each scenario repeats one operation many times. Memory, threads, file descriptors and objects of the
physics engine are sampled at regular intervals. After the first tenth, the memory must stay within
3 % (and 4 MB), and everything else must be constant. The exit code is 1 if anything grows.
"""

from __future__ import annotations

import argparse
import gc
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import astuple, dataclass
from pathlib import Path

import numpy as np

import flatland
from flatland.timekeeper import NANOSECONDS

from ros_session import CHECKOUT, ros_session  # isort: skip

SAMPLES = 40
MEMORY_TOLERANCE = 0.03
# MB; one arena of the allocator more is not growth. CPython resizes its table of interned strings,
# into which pathlib puts the parts of each path, once or twice in a long run: 2 MB each.
MEMORY_ALLOWANCE = 4.0
OFFICE = CHECKOUT / "worlds" / "office" / "world.yaml"
CHAIR = OFFICE.with_name("chair.model.yaml")
STEP_RATE = 200  # Hz
# Exact multiples of the step, and 40 Hz.
RATES = (40.0, 25.0, 10.0)

ALL_PLUGINS = Path(__file__).with_name("all_plugins.model.yaml")
TIMERS = "\n".join(
    [
        "bodies: [{name: base, footprints: []}]",
        "plugins:",
        *(
            f"  - {{name: imu{i}, type: Imu, body: base, update_rate: {rate}, "
            f"imu_pub: imu{i}, ground_truth_pub: truth{i}, broadcast_tf: false}}"
            for i, rate in enumerate(RATES)
        ),
    ]
)


@dataclass(frozen=True)
class Sample:
    """The resources in use at one point of a run."""

    memory: float  # resident [MB]
    threads: int
    descriptors: int
    bodies: int = 0
    fixtures: int = 0
    joints: int = 0


def take_sample(pid: int, world: flatland.World | None = None) -> Sample:
    """Returns the resources of a process, and the objects of a world in this process."""
    process = Path(f"/proc/{pid}")
    pages = int((process / "statm").read_text().split()[1])
    memory = pages * os.sysconf("SC_PAGE_SIZE") / 2**20
    threads = len(list((process / "task").iterdir()))
    descriptors = len(list((process / "fd").iterdir()))
    if world is None:
        return Sample(memory, threads, descriptors)
    counts = world.physics.object_counts()
    return Sample(memory, threads, descriptors, counts.bodies, counts.fixtures, counts.joints)


def numbered(count: int) -> Iterator[tuple[int, bool]]:
    """Yields the numbers from 1 to `count`, and whether to take a sample after each."""
    period = max(1, count // SAMPLES)
    for number in range(1, count + 1):
        yield number, number % period == 0


def models(count: int, folder: Path) -> Iterator[Sample]:
    """Spawns, steps and deletes a model with all plugins."""
    del folder
    with flatland.World.from_yaml(OFFICE, seed=1) as world:
        for number, is_due in numbered(count):
            world.spawn_model(ALL_PLUGINS, f"m{number}", f"ns{number % 7}", (0, -5.5, 0), "allow")
            if number % 10 == 0:
                world.output(f"/ns{number % 7}/scan")
            world.step(2)
            world.delete_model(f"m{number}")
            if is_due:
                yield take_sample(os.getpid(), world)


def worlds(count: int, folder: Path) -> Iterator[Sample]:
    """Loads and closes a world."""
    del folder
    for number, is_due in numbered(count):
        with flatland.World.from_yaml(OFFICE, seed=number) as world:
            world.step()
            if is_due:
                sample = take_sample(os.getpid(), world)
        if is_due:
            yield sample


def office(seconds: int, folder: Path) -> Iterator[Sample]:
    """Drives the robots of the office with random commands, and checks time and rates."""
    path = folder / "timers.model.yaml"
    path.write_text(TIMERS)
    rng = np.random.default_rng(1)
    with flatland.World.from_yaml(OFFICE, seed=1) as world:
        world.spawn_model(path, "timers", "timers")
        received = [0] * len(RATES)

        def counter(index: int) -> Callable[[object], None]:
            def count(_value: object) -> None:
                received[index] += 1

            return count

        for index in range(len(RATES)):
            world.output(f"/timers/imu{index}").subscribe(counter(index))
        scan = world.output("/scan")
        commands = [world.command("/cmd_vel"), world.command("/tricycle/cmd_vel")]
        for second, is_due in numbered(seconds):
            for command in commands:
                command.set(flatland.Twist(rng.uniform(-0.5, 1.0), 0.0, rng.uniform(-1.0, 1.0)))
            world.step(STEP_RATE)
            elapsed = world.timekeeper.sim_time_ns
            assert elapsed == second * NANOSECONDS, f"time {elapsed} ns after {second} s"
            expected = [round(second * rate) for rate in RATES]
            assert received == expected, f"{received} messages instead of {expected}"
            assert scan.latest.stamp > elapsed - NANOSECONDS
            if is_due:
                yield take_sample(os.getpid(), world)


def services(count: int, folder: Path) -> Iterator[Sample]:
    """Calls the services of a node."""
    del folder
    with ros_session() as ros:
        os.environ.update({k: v for k, v in ros.environment.items() if k.startswith("ROS_")})
        import rospy
        from geometry_msgs.msg import Pose2D

        from flatland.srv import DeleteModel, MoveModel, SpawnModel, WaitUntilReady

        server = ros.server(world_path=OFFICE, update_rate=0, seed=1)
        rospy.init_node("soak", disable_signals=True, disable_rostime=True)
        kinds = {"spawn_model": SpawnModel, "move_model": MoveModel, "delete_model": DeleteModel}
        for name in kinds:
            rospy.wait_for_service(name, 60.0)
        # The node opens topics, with threads, after the first step.
        rospy.wait_for_service("wait_until_ready", 60.0)
        ready = rospy.ServiceProxy("wait_until_ready", WaitUntilReady)([], 60.0)
        assert ready.success, ready.message
        spawn, move, delete = (
            rospy.ServiceProxy(name, kind, persistent=True) for name, kind in kinds.items()
        )
        for cycle, is_due in numbered(-(-count // 3)):
            # The topics of many plugins are registered with the master, which takes most of a call.
            path = ALL_PLUGINS if cycle % 20 == 0 else CHAIR
            for response in (
                spawn(str(path), "m", "", Pose2D(0, -5.5, 0)),
                move("m", Pose2D(1, -5.5, 1)),
                delete("m"),
            ):
                assert response.success, response.message
            if is_due:
                yield take_sample(server.pid)


# Numbers of operations of the full run.
SCENARIOS: dict[str, tuple[Callable[[int, Path], Iterator[Sample]], int]] = {
    "models": (models, 100_000),
    "worlds": (worlds, 10_000),
    "office": (office, 24 * 3600),
    "services": (services, 100_000),
}


def growth(samples: list[Sample]) -> list[str]:
    """Returns what changes after the first tenth of the samples."""
    start = len(samples) // 10
    first, rest = samples[start], samples[start + 1 :]
    limit = first.memory * (1 + MEMORY_TOLERANCE) + MEMORY_ALLOWANCE
    faults = []
    peak = max(sample.memory for sample in rest)
    if peak > limit:
        faults.append(f"memory grows from {first.memory:.1f} to {peak:.1f} MB")
    names = ["threads", "bodies", "fixtures", "joints"]
    if first.bodies:
        names.append("descriptors")
    else:
        # A node has connections to the master that rospy closes some time after their use.
        middle = len(rest) // 2
        early, late = (max(s.descriptors for s in half) for half in (rest[:middle], rest[middle:]))
        if late > 1.5 * early:
            faults.append(f"descriptors grow from {early} to {late}")
    for name in names:
        values = {getattr(sample, name) for sample in (first, *rest)}
        if len(values) > 1:
            faults.append(f"{name} vary: {sorted(values)}")
    return faults


def run(name: str, scale: float, report: Callable[[str], None]) -> bool:
    """Runs a scenario, reports its samples, and returns whether nothing grew."""
    scenario, full = SCENARIOS[name]
    count = max(SAMPLES, round(full * scale))
    report(f"{name}: {scenario.__doc__} {count} of {full}")
    samples = []
    start = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        for sample in scenario(count, Path(folder)):
            gc.collect()
            samples.append(sample)
            memory, *numbers = astuple(sample)
            report(
                f"  {time.monotonic() - start:7.0f} s {memory:7.1f} MB  "
                + "  ".join(map(str, numbers))
            )
    faults = growth(samples)
    for fault in faults or ["nothing grows"]:
        report(f"  {fault}")
    return not faults


def main() -> int:
    """Runs the selected scenarios; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenarios", nargs="*", metavar="SCENARIO", help=", ".join(SCENARIOS))
    parser.add_argument(
        "--scale", type=float, default=1.0, help="share of the full number of operations"
    )
    options = parser.parse_args()
    unknown = set(options.scenarios) - set(SCENARIOS)
    if unknown:
        parser.error(f"unknown: {', '.join(sorted(unknown))}; there are {', '.join(SCENARIOS)}")
    names = options.scenarios or list(SCENARIOS)
    print("time, memory, threads, file descriptors, bodies, fixtures, joints")
    done = [run(name, options.scale, lambda text: print(text, flush=True)) for name in names]
    return 0 if all(done) else 1


if __name__ == "__main__":
    sys.exit(main())
