"""A subscriber that connects and never reads does not block the simulation."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from raw_subscriber import RawSubscriber
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty

BEAMS = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: Laser, name: laser, body: base, range: 20,
     angle: {min: -2, max: 2, increment: 0.0004}}
"""
SCAN_SIZE = 40_000  # bytes, about: 10 001 beams


@pytest.fixture(autouse=True)
def server(launcher: Any, write_world: Callable[..., Path]) -> Any:
    world = write_world("[{name: robot, model: beams.model.yaml}]", beams=BEAMS)
    return launcher.server(world, update_rate=1000)


@pytest.fixture
def stuck(ros: Any) -> Iterator[RawSubscriber]:
    subscriber = RawSubscriber(ros.master, "/scan", LaserScan, receive_buffer=4096)
    yield subscriber
    subscriber.socket.close()


def test_other_subscribers_receive_all_messages(ros: Any, stuck: RawSubscriber) -> None:
    del stuck
    clock, scans = ros.topic("/clock", Clock), ros.topic("/scan", LaserScan)
    # 500 scans of 40 kB exceed the buffers of any socket.
    first = clock.next().clock.to_sec()
    clock.until(lambda message: message.clock.to_sec() > first + 500 * 0.005)
    scans.drop()
    scans.take(10)
    # Services and the simulation are not affected either.
    assert ros.spawn("ball.model.yaml", "ball").success
    clock.drop()
    clock.next()


def test_slow_reader_receives_complete_messages_up_to_the_newest(
    ros: Any, stuck: RawSubscriber
) -> None:
    clock = ros.topic("/clock", Clock)
    first = clock.next().clock.to_sec()
    later = clock.until(lambda message: message.clock.to_sec() > first + 500 * 0.005)
    ros.call("/pause", Empty)
    last = [later, *clock.rest(1.0)][-1].clock.to_nsec()
    stamps = []
    while not stamps or stamps[-1] < last - 5_000_000:
        scan = LaserScan()
        scan.deserialize(stuck.read_frame())
        assert len(scan.ranges) == 10_001
        stamps.append(scan.header.stamp.to_nsec())
    # In order, without duplicates, and with gaps of dropped messages.
    assert stamps == sorted(set(stamps))
    steps = [after - before for before, after in itertools.pairwise(stamps)]
    assert max(steps) > 5_000_000


def test_closed_connection_is_removed(ros: Any, stuck: RawSubscriber, server: Any) -> None:
    clock = ros.topic("/clock", Clock)
    first = clock.next().clock.to_sec()
    clock.until(lambda message: message.clock.to_sec() > first + 500 * 0.005)
    stuck.socket.close()
    ros.topic("/scan", LaserScan).take(5)
    assert "Traceback" not in server.output
    assert server.stop() == 0
