"""The seed makes noise reproducible; without one, a seed is drawn and logged."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from sensor_msgs.msg import LaserScan

NOISY = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: Laser, name: laser, body: base, range: 20, update_rate: 10, noise_std_dev: 0.1,
     always_publish: true, angle: {min: -1.5, max: 1.5, increment: 0.5}}
"""


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    return write_world("[{name: robot, model: noisy.model.yaml}]", noisy=NOISY)


Scans = dict[int, list[float]]


def common_scans(first: Any, second: Any) -> list[tuple[list[float], list[float]]]:
    """Waits for three pairs of scans of two servers with equal stamps, and returns them.

    The servers run at the same rate, one behind the other, so that their scans have stamps in
    common after some time, whenever a subscriber connects to either.
    """
    found: tuple[Scans, Scans] = ({}, {})
    while len(common := sorted(found[0].keys() & found[1].keys())) < 3:
        for scans, topic in zip(found, (first, second), strict=True):
            scan = topic.next()
            scans[scan.header.stamp.to_nsec()] = list(scan.ranges)
    return [(found[0][stamp], found[1][stamp]) for stamp in common]


def scans_of(ros: Any, launcher: Any, world: Path, namespace: str, seed: int) -> Any:
    launcher.start(f"__ns:={namespace}", world_path=world, seed=seed)
    return ros.topic(f"{namespace}/scan", LaserScan)


def test_runs_with_equal_seeds_are_equal(ros: Any, launcher: Any, world: Path) -> None:
    first = scans_of(ros, launcher, world, "/first", seed=42)
    second = scans_of(ros, launcher, world, "/second", seed=42)
    assert all(a == b for a, b in common_scans(first, second))


def test_runs_with_different_seeds_differ(ros: Any, launcher: Any, world: Path) -> None:
    first = scans_of(ros, launcher, world, "/first", seed=42)
    second = scans_of(ros, launcher, world, "/second", seed=43)
    assert all(a != b for a, b in common_scans(first, second))


def test_seed_is_drawn_and_logged(ros: Any, launcher: Any, world: Path) -> None:
    process = launcher.start("__ns:=/unseeded", world_path=world)
    seed = int(process.wait_for_line(r"seed (\d+) drawn at random")[1])
    first = ros.topic("/unseeded/scan", LaserScan)
    second = scans_of(ros, launcher, world, "/second", seed=seed)
    assert all(a == b for a, b in common_scans(first, second))
