"""The world worlds/sensors: all sensors publish, and scans depend on its materials."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import flatland


@pytest.fixture
def sensors(checkout: Path) -> Iterator[flatland.World]:
    path = checkout / "worlds/sensors/world.yaml"
    with flatland.World.from_yaml(str(path), seed=1) as world:
        yield world


def test_the_robot_is_free_and_all_sensors_publish(sensors: flatland.World) -> None:
    topics = ("/tip", "/scan", "/sonar/left", "/sonar/front", "/sonar/right")
    outputs = {topic: sensors.output(topic) for topic in topics}
    sensors.step(100)
    assert not sensors.contacts
    for topic, output in outputs.items():
        assert output.latest is not None, topic


def test_scans_have_intensities_and_depend_on_the_seed(checkout: Path) -> None:
    path = str(checkout / "worlds/sensors/world.yaml")
    scans = []
    for seed in (1, 1, 2):
        with flatland.World.from_yaml(path, seed=seed) as world:
            output = world.output("/scan")
            world.step(100)
            assert output.latest is not None
            scans.append(output.latest)
    assert scans[0].ranges.tobytes() == scans[1].ranges.tobytes()
    assert scans[0].ranges.tobytes() != scans[2].ranges.tobytes()
    is_hit = np.isfinite(scans[0].ranges)
    assert np.count_nonzero(scans[0].intensities) > 0.9 * np.count_nonzero(is_hit) > 0
