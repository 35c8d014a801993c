"""The nodes of two versions, which run by turns while the other one is stopped."""

from __future__ import annotations

import contextlib
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import rosgraph
from by_turns import Measure
from light_reader import connected, light_reader, simulated_time
from ros_session import RosSession, ros_session
from scenes import CHECKOUT
from versions import Version

STEP_SIZE = 0.005  # s
PART = 1.0  # wall time of a turn [s]
TIMEOUT = 60.0  # s, for the start of a node
SETTLING = 3.0  # s, until a node has opened the topics of markers and diagnostics
SERVER = CHECKOUT / "scripts" / "flatland_server"
NODE = "/flatland_server"
SCAN = "/scan"
FOUR = (SCAN, "/tf", "/odometry/filtered", "/twist")  # a tricycle has no /twist
READERS = ("nobody reads", "/scan read", "/scan read by rospy", "four topics read")


LISTENER = str(Path(__file__).with_name("listener.py"))


class RunningNode:
    """A node at full speed with a driving robot, stopped except while it is measured."""

    def __init__(self, session: RosSession, world: Path) -> None:
        """Starts the node, and waits until it has opened all topics."""
        self._session = session
        self._pid = session.server(world_path=world, update_rate=0, seed=1).pid
        self._master = rosgraph.Master("/bench", session.environment["ROS_MASTER_URI"])
        self._uri = _wait_for_node(self._master)
        session.start(sys.executable, LISTENER, "--drive", "/cmd_vel").wait_for("driving")
        self._pause()

    def resume(self) -> None:
        """Resumes the node."""
        os.kill(self._pid, signal.SIGCONT)

    def _pause(self) -> None:
        os.kill(self._pid, signal.SIGSTOP)

    @contextlib.contextmanager
    def _running(self) -> Iterator[None]:
        self.resume()
        try:
            yield
        finally:
            self._pause()

    @contextlib.contextmanager
    def read(self, reader: str) -> Iterator[None]:
        """Connects a subscriber, one of `READERS`."""
        with contextlib.ExitStack() as stack:
            with self._running():
                if reader == "/scan read by rospy":
                    listener = self._session.start(
                        sys.executable, LISTENER, f"{SCAN}:sensor_msgs/LaserScan"
                    )
                    stack.callback(self._session.stop, listener)
                    listener.wait_for("first /scan")
                elif reader != "nobody reads":
                    topics = FOUR if reader == "four topics read" else (SCAN,)
                    published = dict(self._master.getPublishedTopics(""))
                    topics = tuple(topic for topic in topics if topic in published)
                    stack.enter_context(light_reader(self._uri, topics))
            yield
            with self._running():  # Programs that end wait for the node.
                stack.close()

    def measure(self) -> float:
        """Returns the processor time of a step [s]."""
        with self._running():
            first, used = simulated_time(self._uri), self._processor_time()
            time.sleep(PART)
            last, used_later = simulated_time(self._uri), self._processor_time()
        return (used_later - used) / (last - first) * STEP_SIZE

    def _processor_time(self) -> float:
        """Returns the processor time used by all threads [s], without the resolution of /proc.

        The clock is that which `clock_getcpuclockid` of the C library returns.
        """
        return time.clock_gettime((~self._pid << 3) | 2)


def _wait_for_node(master: rosgraph.Master) -> str:
    """Waits until the node has been started, and returns the address of its XML-RPC server."""
    end = time.monotonic() + TIMEOUT
    while True:
        try:
            uri = str(master.lookupNode(NODE))
            for topic in ("/clock", SCAN):
                connected(uri, topic).close()
            break
        except (rosgraph.MasterError, OSError, RuntimeError):
            if time.monotonic() > end:
                raise
            time.sleep(0.1)
    time.sleep(SETTLING)
    return uri


@contextlib.contextmanager
def running_node(version: Version, world: Path) -> Iterator[RunningNode]:
    """Runs a node with a ROS master of its own."""
    with ros_session(version.variables) as session:
        node = RunningNode(session, world)
        try:
            yield node
        finally:
            node.resume()


@contextlib.contextmanager
def start_of(version: Version, world: Path) -> Iterator[Measure]:
    """Yields a function that starts a node, and returns the processor time until it ends [s].

    The node ends after its first step.
    """
    with ros_session(version.variables) as session:
        command = [sys.executable, str(SERVER), f"_world_path:={world}"]
        command += ["_update_rate:=0", f"_benchmark_duration:={STEP_SIZE}", "_seed:=1"]

        def measure() -> float:
            before = _children()
            subprocess.run(command, env=session.environment, check=True, capture_output=True)
            return _children() - before

        yield measure


def _children() -> float:
    """Returns the processor time of all child processes that have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
