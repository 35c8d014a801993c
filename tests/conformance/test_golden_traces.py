"""Drives through the worlds `free` and `office` as the reference did and compares what happens."""

from __future__ import annotations

import json
import math
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flatland

POSE_TOLERANCE = 2e-4  # m and rad
VELOCITY_TOLERANCE = 1e-5  # m/s and rad/s
FIRST_SCAN_TOLERANCE = 1e-4  # m, on all but one beam in 500
LATER_SCAN_TOLERANCE = 2e-3  # m, on 99 % of the beams
GPS_TOLERANCE = 1e-8  # deg
# Box2D 2.4 lets a joint with equal limits coast between them and puts its pose right afterwards,
# where 2.3 took its velocity away: the wheel is where it must be, but for a while it turns.
STEERED = "trike1/front_wheel"
BEAMS = {"diff1/front": 271, "diff1/rear": 151, "diff1/high": 629, "trike1/front": 641}


@dataclass
class Comparison:
    """The greatest differences of a run from its trace, by the name of body or plugin.

    Attributes:
        pose: Of position [m] and yaw [rad].
        velocity: [m/s], [rad/s].
        first_scan: Beams of the scan at step 0 that are farther off than the tolerance.
        later_scan: Greatest share of such beams in one of the later scans.
        gps: Of latitude and longitude [deg].
    """

    pose: dict[str, float] = field(default_factory=dict)
    velocity: dict[str, float] = field(default_factory=dict)
    first_scan: dict[str, int] = field(default_factory=dict)
    later_scan: dict[str, float] = field(default_factory=dict)
    gps: dict[str, float] = field(default_factory=dict)


def read_commands(path: Path) -> dict[int, list[tuple[str, flatland.Twist]]]:
    """Reads which model gets which command before which step; all take them on `cmd_vel`."""
    commands = defaultdict(list)
    for line in path.read_text().splitlines():
        step, model, plugin, v, omega = line.split()
        assert plugin == "drive"
        twist = flatland.Twist(linear_x=float(v), angular_z=float(omega))
        commands[int(step)].append((model, twist))
    return commands


def raise_to(greatest: dict[str, float], name: str, value: float) -> None:
    greatest[name] = max(greatest.get(name, 0.0), float(value))


def scan_difference(measured: Any, expected: list[float | None]) -> Any:
    """Difference of each beam, infinite where only one of the two is a hit."""
    wanted = np.array([math.nan if value is None else value for value in expected])
    assert measured.shape == wanted.shape
    difference = np.abs(measured - wanted)
    difference[np.isnan(measured) & np.isnan(wanted)] = 0.0
    return np.nan_to_num(difference, nan=math.inf)


def compare_record(world: flatland.World, record: dict[str, Any], result: Comparison) -> None:
    """Compares bodies and scans before a step."""
    for name, values in record["bodies"].items():
        model, body_name = name.split("/")
        body = world.model(model).body(body_name)
        difference = np.abs(np.array([*body.pose, *body.velocity]) - values)
        raise_to(result.pose, name, difference[:3].max())
        raise_to(result.velocity, name, difference[3 : 5 if name == STEERED else 6].max())
    for name, expected in record["scans"].items():
        model, plugin_name = name.split("/")
        laser: Any = world.model(model).plugin(plugin_name)
        difference = scan_difference(laser.compute_ranges(), expected["ranges"])
        assert difference.size == BEAMS[name]
        if record["step"] == 0:
            result.first_scan[name] = int((difference > FIRST_SCAN_TOLERANCE).sum())
        else:
            raise_to(result.later_scan, name, (difference > LATER_SCAN_TOLERANCE).mean())


def compare_gps(world: flatland.World, record: dict[str, Any], result: Comparison) -> None:
    """Compares the fixes that the step just made took before it."""
    for name, expected in record["gps"].items():
        model, _ = name.split("/")
        fix = world.output(f"{world.model(model).namespace}/gps/fix").latest
        assert fix.stamp == round(record["t"] * 1e9)
        measured = np.array([fix.latitude, fix.longitude])
        raise_to(result.gps, name, np.abs(measured - expected).max())


def run(golden: Path, name: str) -> Comparison:
    result = Comparison()
    trace = json.loads((golden / f"{name}.trace.json").read_text())
    commands = read_commands(golden / f"{name}.cmd")
    records = {record["step"]: record for record in trace["records"]}
    with flatland.World.from_yaml(golden / f"{name}.yaml", seed=1, step_size=trace["dt"]) as world:
        world.output("/r1/gps/fix")
        for step in range(trace["steps"] + 1):
            record = records.get(step)
            if record is not None:
                assert world.time == pytest.approx(record["t"])
                compare_record(world, record, result)
            for model, twist in commands.get(step, []):
                world.command(f"{world.model(model).namespace}/cmd_vel").set(twist)
            world.step()
            if record is not None:
                compare_gps(world, record, result)
    print(f"\n{name}: {result}")
    return result


@pytest.fixture(scope="module", params=["free", "office"])
def comparison(request: pytest.FixtureRequest, golden_dir: Path) -> Comparison:
    # The map of the office belongs to the reference, so its trace is among the reference data.
    if request.param == "office":
        golden_dir = request.getfixturevalue("shared_dir") / "golden"
    return run(golden_dir, request.param)


def test_poses(comparison: Comparison) -> None:
    assert {name.split("/")[0] for name in comparison.pose} >= {"diff1", "trike1"}
    assert all(value < POSE_TOLERANCE for value in comparison.pose.values()), comparison.pose


def test_velocities(comparison: Comparison) -> None:
    velocity = comparison.velocity
    assert all(value < VELOCITY_TOLERANCE for value in velocity.values()), velocity


def test_first_scans(comparison: Comparison) -> None:
    assert set(comparison.first_scan) == set(BEAMS)
    for name, misses in comparison.first_scan.items():
        assert misses <= BEAMS[name] / 500, name


def test_later_scans(comparison: Comparison) -> None:
    assert set(comparison.later_scan) == set(BEAMS)
    for name, share in comparison.later_scan.items():
        assert share <= 0.01, name


def test_gps(comparison: Comparison) -> None:
    assert set(comparison.gps) == {"diff1/gps"}
    assert comparison.gps["diff1/gps"] < GPS_TOLERANCE
