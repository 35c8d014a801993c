"""The time of the node: `/clock` before the first step, while paused, with a limited rate."""

from __future__ import annotations

import itertools
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import rospy
from raw_subscriber import RawSubscriber
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Empty
from waiting import TIMEOUT

from flatland.ros.clock import SimulatedClock
from flatland.ros.transport.registrar import Registrar

# A node as users write it: with simulated time, and without a wait for the first /clock.
NODE = """
import rospy
rospy.init_node("late_node", anonymous=True)
rospy.wait_for_message("/clock", rospy.AnyMsg)
while not rospy.get_rostime() and {positive}:
    rospy.rostime.wallsleep(0.01)
print("time", rospy.get_rostime().to_nsec(), flush=True)
"""

SLOW = """
import pathlib
import time
import flatland

class Slow(flatland.WorldPlugin):
    def on_initialize(self, config):
        while not pathlib.Path(config.get("go", "string")).exists():
            time.sleep(0.01)
"""
MANIFEST = """
<library path=".">
  <class name="Slow" type="slow_start.Slow" base_class_type="flatland::WorldPlugin"/>
</library>
"""


@contextmanager
def clock_of_this_process(rate: float) -> Iterator[SimulatedClock]:
    """A clock in this process, whose own time is the wall time again at the end."""
    registrar = Registrar()
    clock = SimulatedClock(registrar, rate)
    try:
        assert registrar.flush(TIMEOUT)
        yield clock
    finally:
        clock.close()
        assert registrar.flush(TIMEOUT)
        registrar.close(TIMEOUT)
        rospy.rostime._rostime_current = None


@pytest.fixture
def node_time(launcher: Any) -> Callable[[bool], int]:
    """Starts a node and returns its first ROS time [ns]."""

    def start(positive: bool) -> int:
        node = launcher.program(sys.executable, "-c", NODE.format(positive=positive))
        time = int(node.wait_for_line(r"^time (\d+)$")[1])
        assert node.wait() == 0
        return time

    return start


def test_time_0_is_published_while_the_world_is_loaded(
    launcher: Any, ros: Any, write_world: Callable[..., Path], node_time: Callable[[bool], int]
) -> None:
    world = write_world()
    go = world.parent / "go"
    world.write_text(
        world.read_text().replace("plugins: []", f"plugins: [{{type: Slow, name: s, go: {go}}}]")
    )
    (world.parent / "slow_start.py").write_text(SLOW)
    (world.parent / "manifest.xml").write_text(MANIFEST)
    manifest = str(world.parent / "manifest.xml")
    launcher.environment = {**launcher.environment, "FLATLAND_PLUGIN_PATH": manifest}
    server = launcher.start(world_path=world)
    clock = ros.topic("/clock", Clock)
    assert clock.next().clock.to_nsec() == 0
    assert node_time(False) == 0
    assert "loaded" not in server.output
    go.touch()
    assert clock.next().clock.to_nsec() == 5_000_000


def test_late_nodes_receive_the_time_of_a_paused_world(
    launcher: Any, ros: Any, write_world: Callable[..., Path], node_time: Callable[[bool], int]
) -> None:
    launcher.server(write_world())
    clock = ros.topic("/clock", Clock)
    clock.until(lambda message: message.clock.to_nsec() > 0)
    ros.call("/pause", Empty)
    paused = clock.rest()[-1].clock.to_nsec()
    assert node_time(True) == paused
    assert clock.rest() == []  # Only the new node received it.
    ros.call("/resume", Empty)
    assert clock.next().clock.to_nsec() == paused + 5_000_000


# -- limited rate -----------------------------------------------------------------------------


def test_limited_clock_publishes_the_last_time_before_a_pause(ros: Any) -> None:
    with clock_of_this_process(5.0) as clock:
        topic = ros.topic("/clock", Clock)
        assert topic.next().clock.to_nsec() == 0
        times = range(5_000_000, 1_000_000_000, 5_000_000)
        for time_ns in times:  # within less than a period
            clock.time_advanced(time_ns)
        received = [message.clock.to_nsec() for message in topic.rest(0.5)]
        assert received[-1] == times[-1]
        assert len(received) < len(times) / 10


def test_limited_clock_of_a_fast_simulation(
    launcher: Any, ros: Any, write_world: Callable[..., Path]
) -> None:
    launcher.server(write_world(), update_rate=0, clock_rate=20)
    clock = ros.topic("/clock", Clock)
    clock.take(3)
    times = [message.clock.to_nsec() for message in clock.take(10)]
    steps = [after - before for before, after in itertools.pairwise(times)]
    # A step takes less than 1 ms, and two messages are 50 ms apart.
    assert min(steps) > 50 * 5_000_000
    ros.call("/pause", Empty)
    paused = clock.rest()[-1].clock.to_nsec()
    late = RawSubscriber(ros.master, "/clock", Clock)
    assert late.next().clock.to_nsec() == paused
    late.close()


# -- concurrent subscribers -------------------------------------------------------------------


def test_no_subscriber_receives_a_time_that_is_earlier_than_the_previous_one(ros: Any) -> None:
    """New subscribers are served in other threads than the one that advances the time."""
    ended = threading.Event()

    def advance(clock: SimulatedClock) -> None:
        for number in itertools.count(1):
            # The seconds and the nanoseconds change in each step.
            clock.time_advanced(number * 999_999_999)
            if ended.wait(1e-5):
                return

    with clock_of_this_process(0.0) as clock:
        thread = threading.Thread(target=advance, args=(clock,))
        thread.start()
        try:
            for _ in range(20):
                late = RawSubscriber(ros.master, "/clock", Clock)
                times = [late.next().clock.to_nsec() for _ in range(20)]
                late.close()
                assert times == sorted(times)
        finally:
            ended.set()
            thread.join()
