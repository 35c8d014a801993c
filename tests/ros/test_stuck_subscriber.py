"""A subscriber that connects and never reads does not block the simulation."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from raw_subscriber import RawSubscriber
from sensor_msgs.msg import LaserScan

BEAMS = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: Laser, name: laser, body: base, range: 20,
     angle: {min: -2, max: 2, increment: 0.0004}}
"""
DURATION = 1.0  # s of simulated time: 200 scans of 40 kB exceed the buffers of a connection


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, write_world: Callable[..., Path]) -> Any:
    world = write_world("[{name: robot, model: beams.model.yaml}]", beams=BEAMS)
    return module_launcher.server(world, lockstep=True)


@pytest.fixture
def stuck(ros: Any) -> Iterator[RawSubscriber]:
    subscriber = RawSubscriber(ros.master, "/scan", LaserScan, receive_buffer=4096)
    ros.wait_until_ready("/scan")
    yield subscriber
    subscriber.close()


def test_other_subscribers_receive_all_messages(ros: Any, stuck: RawSubscriber) -> None:
    del stuck
    scans = ros.ready_topic("/scan", LaserScan)
    for _ in range(round(DURATION / 0.005)):
        now = ros.step()
        # One scan at a time: the queue of the publisher drops those that a busy reader is late for.
        assert scans.next().header.stamp.to_nsec() == now - 5_000_000
    # Services are not affected either.
    assert ros.spawn("ball.model.yaml", "ball").success


def test_closed_connection_is_removed(ros: Any, stuck: RawSubscriber, server: Any) -> None:
    ros.step(DURATION)
    stuck.close()
    ros.step(0.1)
    scans = ros.ready_topic("/scan", LaserScan)
    ros.step(0.025)
    scans.take(5)
    assert "Traceback" not in server.output
    assert server.stop() == 0
