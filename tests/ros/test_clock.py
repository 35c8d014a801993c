"""The time of the node: `/clock` before the first step, for late nodes, and with a limited rate."""

from __future__ import annotations

import itertools
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import rosbag
import rospy
from raw_subscriber import RawSubscriber
from rosgraph_msgs.msg import Clock
from waiting import TIMEOUT, wait_until

from flatland.node.clock import SimulatedClock
from flatland.ros.transport.registrar import Registrar
from flatland.ros.transport.ros_transport import RosTransport

SLOW = """
import pathlib
import time
import flatland

class Slow(flatland.WorldPlugin):
    def on_initialize(self, config):
        while not pathlib.Path(config.get("go", "string")).exists():
            time.sleep(0.01)
"""


@contextmanager
def clock_of_this_process(rate: float) -> Iterator[SimulatedClock]:
    """A clock in this process, whose own time is the wall time again at the end."""
    registrar = Registrar()
    clock = SimulatedClock(RosTransport(registrar), rate)
    try:
        assert registrar.flush(TIMEOUT)
        yield clock
    finally:
        clock.close()
        assert registrar.flush(TIMEOUT)
        registrar.close(TIMEOUT)
        rospy.rostime._rostime_current = None


def test_the_time_is_published_while_the_world_is_loaded_and_to_late_nodes(
    launcher: Any, ros: Any, write_world: Callable[..., Path]
) -> None:
    world = write_world()
    go = world.parent / "go"
    plugin = f"{{type: 'test::Slow', name: s, go: {go}}}"
    world.write_text(world.read_text().replace("plugins: []", f"plugins: [{plugin}]"))
    launcher.add_plugins(world.parent, SLOW, "slow_start")
    server = launcher.start(world_path=world, lockstep=True, clock_rate=1e-3)
    clock = ros.topic("/clock", Clock)
    assert clock.next().clock.to_nsec() == 1  # Nodes and recorders take 0 for no time.
    assert "loaded" not in server.output
    go.touch()
    now = ros.step(0.1)
    assert now == 100_000_000
    # The times in between are not published, because the next message is due after 1000 s.
    assert clock.until(lambda message: message.clock.to_nsec() > 0).clock.to_nsec() == now
    late = RawSubscriber(ros.master, "/clock", Clock)
    assert late.next().clock.to_nsec() == now
    late.close()
    assert clock.rest() == []  # Only the new subscriber received it.


@pytest.mark.parametrize("clock_rate", [0, 50])
def test_a_recorder_runs_across_resets_and_starts(
    launcher: Any, ros: Any, write_world: Callable[..., Path], tmp_path: Path, clock_rate: float
) -> None:
    """`rosbag record` ends, with exit code 0, when the time is 0."""
    rospy.set_param("/use_sim_time", True)
    world = write_world()
    file = tmp_path / "run.bag"
    parameters = {"lockstep": True, "clock_rate": clock_rate}
    server = launcher.server(world, **parameters)
    recorder = launcher.program("rosbag", "record", "-O", str(file), "/clock")
    wait_until("the recorder", Path(f"{file}.active").exists)
    wait_until("the recorder", lambda: "/clock" in ros.connected_topics(of="/record"))
    ros.step(0.1)
    ros.reset()
    ros.step(0.1)
    server.stop()
    launcher.server(world, **parameters)  # which begins before its first step
    wait_until("the recorder", lambda: "/clock" in ros.connected_topics(of="/record"))
    ros.step(0.1)
    assert recorder.running, recorder.output
    recorder.send(signal.SIGINT)
    assert recorder.wait() == 0
    with rosbag.Bag(str(file)) as bag:
        times = [message.clock.to_nsec() for _, message, _ in bag.read_messages("/clock")]
    assert 0 not in times
    # The recorder may end before it receives the last message.
    assert times.count(1) >= 2  # of the reset, and of one of the starts
    assert times.count(100_000_000) >= 2


def test_another_publisher_of_the_time_is_named_once(
    launcher: Any, ros: Any, server_path: str, write_world: Callable[..., Path]
) -> None:
    server = launcher.server(write_world(), lockstep=True)
    other = rospy.Publisher("/clock", Clock, queue_size=1)
    try:
        server.wait_for_line("/clock is also published by /flatland_tests: the time of all nodes")
        world = f"_world_path:={write_world()}"
        second = launcher.program("env", server_path, "__ns:=/second", world)
        second.wait_for_line("/clock is also published by /flatland_server, /flatland_tests: ")
        server.wait_for_line("/clock is also published by /second/flatland_server: ")
    finally:
        other.unregister()
    assert server.output.count("published by /flatland_tests") == 1


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
                late = RawSubscriber(ros.master, "/clock", Clock, publisher="/flatland_tests")
                times = [late.next().clock.to_nsec() for _ in range(20)]
                late.close()
                assert times == sorted(times)
        finally:
            ended.set()
            thread.join()
