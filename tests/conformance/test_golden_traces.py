"""Comparison of runs of the worlds `free` and `office` with recorded traces."""

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
# At a joint with equal limits, Box2D 2.4 corrects the position after the step but keeps an angular
# velocity, which Box2D 2.3 removed. The pose of the wheel is compared, its angular velocity is not.
STEERED = "trike1/front_wheel"
BEAMS = {"diff1/front": 271, "diff1/rear": 151, "diff1/high": 629, "trike1/front": 641}


@dataclass
class Comparison:
    """Maximum differences of a run from its trace, by the name of the body or plugin.

    Attributes:
        pose: Difference of position [m] and yaw [rad].
        velocity: Difference of velocity [m/s] and angular velocity [rad/s].
        first_scan: Number of beams in the scan at step 0 whose difference exceeds the tolerance.
        later_scan: Maximum fraction of such beams in a later scan.
        gps: Difference of latitude and longitude [deg].
    """

    pose: dict[str, float] = field(default_factory=dict)
    velocity: dict[str, float] = field(default_factory=dict)
    first_scan: dict[str, int] = field(default_factory=dict)
    later_scan: dict[str, float] = field(default_factory=dict)
    gps: dict[str, float] = field(default_factory=dict)


def read_commands(path: Path) -> dict[int, list[tuple[str, flatland.Twist]]]:
    """Returns the commands (model, twist) before each step; all are sent to `cmd_vel`."""
    commands = defaultdict(list)
    for line in path.read_text().splitlines():
        step, model, plugin, v, omega = line.split()
        assert plugin == "drive"
        twist = flatland.Twist(linear_x=float(v), angular_z=float(omega))
        commands[int(step)].append((model, twist))
    return commands


def update_maximum(maxima: dict[str, float], name: str, value: float) -> None:
    maxima[name] = max(maxima.get(name, 0.0), float(value))


def scan_difference(measured: Any, expected: list[float | None]) -> Any:
    """Returns the difference of each beam [m], infinite if only one of the two is a hit."""
    ranges = np.array([math.nan if value is None else value for value in expected])
    assert measured.shape == ranges.shape
    difference = np.abs(measured - ranges)
    difference[np.isnan(measured) & np.isnan(ranges)] = 0.0
    return np.nan_to_num(difference, nan=math.inf)


def compare_record(world: flatland.World, record: dict[str, Any], result: Comparison) -> None:
    """Compares bodies and scans with a record before the step."""
    for name, values in record["bodies"].items():
        model, body_name = name.split("/")
        body = world.model(model).body(body_name)
        difference = np.abs(np.array([*body.pose, *body.velocity]) - values)
        update_maximum(result.pose, name, difference[:3].max())
        update_maximum(result.velocity, name, difference[3 : 5 if name == STEERED else 6].max())
    for name, expected in record["scans"].items():
        model, plugin_name = name.split("/")
        laser: Any = world.model(model).plugin(plugin_name)
        difference = scan_difference(laser.compute_ranges(), expected["ranges"])
        assert difference.size == BEAMS[name]
        if record["step"] == 0:
            result.first_scan[name] = int((difference > FIRST_SCAN_TOLERANCE).sum())
        else:
            update_maximum(result.later_scan, name, (difference > LATER_SCAN_TOLERANCE).mean())


def compare_gps(world: flatland.World, record: dict[str, Any], result: Comparison) -> None:
    """Compares the satellite positions measured at the start of the last step with a record."""
    for name, expected in record["gps"].items():
        model, _ = name.split("/")
        fix = world.output(f"{world.model(model).namespace}/gps/fix").latest
        assert fix.stamp == round(record["t"] * 1e9)
        measured = np.array([fix.latitude, fix.longitude])
        update_maximum(result.gps, name, np.abs(measured - expected).max())


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
    # The map of the office belongs to the reference, so its trace is part of the reference data.
    if request.param == "office":
        golden_dir = request.getfixturevalue("shared_dir") / "golden"
    return run(golden_dir, request.param)


def test_poses_match_the_trace(comparison: Comparison) -> None:
    assert {name.split("/")[0] for name in comparison.pose} >= {"diff1", "trike1"}
    assert all(value < POSE_TOLERANCE for value in comparison.pose.values()), comparison.pose


def test_velocities_match_the_trace(comparison: Comparison) -> None:
    velocity = comparison.velocity
    assert all(value < VELOCITY_TOLERANCE for value in velocity.values()), velocity


def test_first_scans_match_the_trace(comparison: Comparison) -> None:
    assert set(comparison.first_scan) == set(BEAMS)
    for name, mismatches in comparison.first_scan.items():
        assert mismatches <= BEAMS[name] / 500, name


def test_later_scans_match_the_trace(comparison: Comparison) -> None:
    assert set(comparison.later_scan) == set(BEAMS)
    for name, fraction in comparison.later_scan.items():
        assert fraction <= 0.01, name


def test_satellite_positions_match_the_trace(comparison: Comparison) -> None:
    assert set(comparison.gps) == {"diff1/gps"}
    assert comparison.gps["diff1/gps"] < GPS_TOLERANCE
