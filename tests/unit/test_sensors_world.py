"""The world worlds/sensors: all sensors publish, and scans depend on its materials."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import flatland
from flatland.geometry import compose


@pytest.fixture
def sensors(checkout: Path) -> Iterator[flatland.World]:
    path = checkout / "worlds/sensors/world.yaml"
    with flatland.World.from_yaml(str(path), seed=1) as world:
        yield world


def test_the_robot_is_free_and_all_sensors_publish(sensors: flatland.World) -> None:
    topics = ("/tip", "/scan", "/semantic_scan", "/sonar/left", "/sonar/front", "/sonar/right")
    outputs = {topic: sensors.output(topic) for topic in topics}
    sensors.step(100)
    assert not sensors.contacts
    for topic, output in outputs.items():
        assert output.latest is not None, topic
    scan = outputs["/scan"].latest
    is_hit = np.isfinite(scan.ranges)
    assert np.count_nonzero(scan.intensities) > 0.9 * np.count_nonzero(is_hit) > 0


def test_labels_are_those_of_the_places_that_the_beams_hit(sensors: flatland.World) -> None:
    output = sensors.output("/semantic_scan")
    legs = [(x, y) for x in (-0.2, 0.2) for y in (-0.2, 0.2)]
    feet = {
        name: np.array([compose(sensors.model(name).pose, (*leg, 0.0))[:2] for leg in legs])
        for name in ("chair1", "chair2")
    }
    x, y, theta = sensors.model("robot").pose
    discs = {name: (center, 0.03) for name, center in feet.items()}
    discs |= {"plant": (np.array([[8.5, 4.2]]), 0.3), "robot": (np.array([[x, y]]), 0.25)}
    for _ in range(5):  # a share of the beams passes the glass, another one is reflected
        sensors.step(20)
        scan = output.latest
        assert scan is not None
        angles = theta + scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
        ends = scan.ranges[:, None] * np.stack([np.cos(angles), np.sin(angles)], 1) + (x, y)
        # A beam may have been reflected once, by the mirror at y = 0.05 or by the glass at x = 6.
        images = np.array([ends, ends * (1, -1) + (0, 0.1), ends * (-1, 1) + (12, 0)])
        assert ((scan.labels > 0) == np.isfinite(scan.ranges)).all()
        names, classes = (
            np.array([getattr(label, key) for label in scan.table])[scan.labels]
            for key in ("name", "class_name")
        )
        assert set(classes) - {"mirror", ""} == {"wall", "glass", "chair", "plant", "robot"}
        assert ends[classes == "glass", 0] == pytest.approx(6.0, abs=1e-3)
        for name, (centers, radius) in discs.items():
            offsets = images[:, names == name, None] - centers
            errors = np.abs(np.hypot(offsets[..., 0], offsets[..., 1]) - radius)
            assert errors.min(axis=(0, 2)) == pytest.approx(0.0, abs=2e-3), name
