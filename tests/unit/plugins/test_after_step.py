"""`after_step: true`: the values of a time equal those that the default publishes at that time."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import tricycle

import flatland
from flatland.values import Transform

STEP = 5_000_000  # ns
STEPS = 99  # no update of a rate below is due after the last one
LASER = "type: Laser, name: laser, body: base, range: 9, angle: {min: -2, max: 2, increment: 0.5}"
DIFF = "type: DiffDrive, name: drive, body: base"
TRICYCLE = f"{tricycle.DRIVE}, enable_odom_tf_pub: true"
TF = "type: ModelTfPublisher, name: tf, publish_tf_world: true"
ROOM = "[{name: 2d, map: map.yaml}]"

Record = dict[Any, Any]


class Transforms(flatland.WorldObserver):
    """All transforms sent, by frames and stamp."""

    def __init__(self) -> None:
        self.sent: dict[tuple[str, str, int], Transform] = {}

    def transforms_sent(self, transforms: list[Transform]) -> None:
        for sent in transforms:
            self.sent[sent.parent, sent.child, sent.stamp] = sent


@pytest.fixture
def record(plugin_world: Any) -> Callable[..., tuple[Record, Record]]:
    """Drives in a room; returns the values by topic and stamp, and the transforms."""
    plugin_world.files.write(
        "map.yaml", "type: line_segments\ndata: walls.dat\nscale: 1.0\norigin: [0, 0, 0]\n"
    )
    plugin_world.files.write("walls.dat", "-5 -5 5 -5\n5 -5 5 5\n5 5 -5 5\n-5 5 -5 -5\n")

    def run(plugin: str, driver: str = "", steps: int = STEPS, omega: float = 0.6) -> Any:
        transforms = Transforms()
        drive = f"\n- {{{driver}}}" if driver else ""
        world = plugin_world(
            f"- {{{plugin}}}{drive}",
            bodies=tricycle.BODIES,
            joints=tricycle.JOINTS,
            layers=ROOM,
            observers=[transforms],
        )
        values: Record = {}
        for topic, output in world.ports.outputs.items():
            output.subscribe(
                lambda value, topic=topic: values.update({(topic, value.stamp): value})
            )
        world.command("/cmd_vel").set(flatland.Twist(linear_x=0.8, angular_z=omega))
        world.step(steps)
        return values, transforms.sent

    return run


def pair(record: Any, plugin: str, **options: Any) -> tuple[Any, Any]:
    """Returns the record of the default, and that with `after_step: true`."""
    return record(plugin, **options), record(f"{plugin}, after_step: true", **options)


def shared(before: Record, after: Record, rate: str) -> list[Any]:
    """Returns the keys of both records, whose last part is the stamp, and checks the others."""
    if rate == "0":
        assert set(before) == set(after)
        return list(before)
    late = {key for key in after if key[-1] == STEPS * STEP}
    assert bool(late) == (rate == ".inf")
    keys = [key for key in before if key[-1] > 0]
    assert set(after) - late == set(keys)
    return keys


@pytest.mark.parametrize("rate", [".inf", "30", "0.5", "0"])
def test_laser(record: Any, rate: str) -> None:
    # The drive would send a transform at time 0.
    driver = f"{DIFF}, enable_odom_tf_pub: false, enable_odom_pub: false, enable_twist_pub: false"
    plugin = f"{LASER}, update_rate: {rate}"
    (before, before_tf), (after, after_tf) = pair(record, plugin, driver=driver)
    for key in shared(before, after, rate):
        assert np.array_equal(after[key].ranges, before[key].ranges, equal_nan=True)
    keys = shared(before_tf, after_tf, rate)
    assert all(after_tf[key] == before_tf[key] for key in keys)
    assert len(before_tf) == len(before)


@pytest.mark.parametrize("drive", [DIFF, TRICYCLE], ids=["DiffDrive", "TricycleDrive"])
@pytest.mark.parametrize("rate", [".inf", "30", "0"])
@pytest.mark.parametrize("drift", [0.0, 0.1])
def test_drives(record: Any, drive: str, rate: str, drift: float) -> None:
    plugin = f"{drive}, pub_rate: {rate}, odom_drift: {[drift] * 4}"
    (before, before_tf), (after, after_tf) = pair(record, plugin)
    for topic, stamp in shared(before, after, rate):
        value, found = before[topic, stamp], after[topic, stamp]
        if topic != "/twist":
            assert found.pose == value.pose
        # DiffDrive publishes before a step the velocity of that step, which begins at rest; the
        # errors of a drift change between two steps.
        if drive is TRICYCLE:
            assert found.twist == value.twist
        elif stamp and not drift:
            assert found.twist == pytest.approx(value.twist, abs=0.01)
    keys = shared(before_tf, after_tf, rate)
    assert all(after_tf[key] == before_tf[key] for key in keys)


def test_the_velocity_of_diff_drive_is_that_after_the_step(record: Any) -> None:
    plugin = f"{DIFF}, linear_dynamics: {{acceleration_limit: 1}}"
    (before, _), (after, _) = pair(record, plugin, omega=0.0)
    for topic in ("/odometry/ground_truth", "/odometry/filtered", "/twist"):
        assert before[topic, 20 * STEP].twist[0] == pytest.approx(0.105, abs=1e-5)
        assert after[topic, 20 * STEP].twist[0] == pytest.approx(0.1, abs=1e-5)


@pytest.mark.parametrize("rate", [".inf", "30", "0"])
def test_model_tf_publisher(record: Any, rate: str) -> None:
    driver = f"{DIFF}, enable_odom_tf_pub: false"
    (_, before), (_, after) = pair(record, f"{TF}, update_rate: {rate}", driver=driver)
    assert {key[:2] for key in before} == {
        ("map", "base"),
        *(("base", wheel) for wheel in ("front", "left", "right")),
    }
    assert all(after[key] == before[key] for key in shared(before, after, rate))


def test_a_model_that_is_spawned_later_publishes_after_its_first_step(plugin_world: Any) -> None:
    world = plugin_world(f"- {{{DIFF}, after_step: true}}")
    world.step(3)
    world.spawn_model("robot.model.yaml", "second", "second")
    output = world.output("/second/odometry/ground_truth")
    stamps: list[int] = []
    output.subscribe(lambda value: stamps.append(value.stamp))
    world.step(2)
    assert stamps == [4 * STEP, 5 * STEP]
    assert math.isfinite(output.latest.pose[0])
