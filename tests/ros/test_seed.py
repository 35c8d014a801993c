"""A seed makes all noise repeatable; without one it is drawn and logged."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty

NOISY = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: Laser, name: laser, body: base, range: 20, update_rate: 10, noise_std_dev: 0.1,
     always_publish: true, angle: {min: -1.5, max: 1.5, increment: 0.5}}
"""


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    return write_world("[{name: robot, model: noisy.model.yaml}]", noisy=NOISY)


def scans_by_stamp(ros: Any, launcher: Any, world: Path, **parameters: int) -> dict[int, Any]:
    """The scans of the first seconds of a run, as far as they were heard."""
    process = launcher.server(world, **parameters)
    scans = ros.topic("/scan", LaserScan).take(8)
    ros.call("/pause", Empty)
    assert process.stop() == 0
    ros.close()
    return {scan.header.stamp.to_nsec(): list(scan.ranges) for scan in scans}


def test_runs_with_one_seed_are_alike(ros: Any, launcher: Any, world: Path) -> None:
    first = scans_by_stamp(ros, launcher, world, seed=42)
    second = scans_by_stamp(ros, launcher, world, seed=42)
    other = scans_by_stamp(ros, launcher, world, seed=43)
    common = first.keys() & second.keys()
    assert len(common) >= 3
    assert all(first[stamp] == second[stamp] for stamp in common)
    common = first.keys() & other.keys()
    assert common
    assert all(first[stamp] != other[stamp] for stamp in common)


def test_seed_is_drawn_and_logged(ros: Any, launcher: Any, world: Path) -> None:
    process = launcher.server(world)
    seed = int(process.wait_for_line(r"seed (\d+) drawn at random")[1])
    scans = ros.topic("/scan", LaserScan).take(8)
    assert process.stop() == 0
    ros.close()
    again = scans_by_stamp(ros, launcher, world, seed=seed)
    common = [scan for scan in scans if scan.header.stamp.to_nsec() in again]
    assert common
    assert all(list(scan.ranges) == again[scan.header.stamp.to_nsec()] for scan in common)
