"""Comparison with a recorded trace of carts and pucks in contact with walls and a crate."""

from __future__ import annotations

import json
import math
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flatland

CLOSE = 1e-4  # m and rad, for half of the bodies
TOLERANCE = 2e-3  # m and rad, for all but `FAR_BODIES`
FAR_TOLERANCE = 50e-3  # m and rad, for the rest, which hit corners, where Box2D 2.3 and 2.4 differ
FAR_BODIES = 2


def difference(world: flatland.World, name: str, expected: list[float]) -> float:
    """Returns the maximum difference of the pose of `model/body` from the trace [m or rad]."""
    model, body = name.split("/")
    return float(np.abs(np.subtract(world.model(model).body(body).pose, expected)).max())


@pytest.fixture(scope="module")
def differences(shared_dir: Path) -> dict[int, list[float]]:
    """Sorted maximum differences of the poses of all bodies from the trace [m or rad], by step."""
    golden = shared_dir / "golden"
    trace: dict[str, Any] = json.loads((golden / "friction.trace.json").read_text())
    commands = defaultdict(list)
    for line in (golden / "friction.cmd").read_text().splitlines():
        step, model, _, v, omega = line.split()
        commands[int(step)].append(
            (model, flatland.Twist(linear_x=float(v), angular_z=float(omega)))
        )
    records = {record["step"]: record["bodies"] for record in trace["records"]}
    found: dict[int, list[float]] = {}
    with flatland.World.from_yaml(golden / "friction.yaml", seed=1, step_size=trace["dt"]) as world:
        for step in range(max(records) + 1):
            if step in records:
                found[step] = sorted(
                    difference(world, name, pose) for name, pose in records[step].items()
                )
            for model, twist in commands[step]:
                world.command(f"{world.model(model).namespace}/cmd_vel").set(twist)
            world.step()
    worst = [max(column) for column in zip(*found.values(), strict=True)]
    print(f"\nfriction: maximum differences {[f'{value:.2g}' for value in worst]}")
    return found


def test_all_bodies_are_compared_until_the_end(differences: dict[int, list[float]]) -> None:
    assert max(differences) == 800
    assert {len(values) for values in differences.values()} == {15}
    assert all(math.isfinite(value) for values in differences.values() for value in values)


def test_poses_match_the_trace(differences: dict[int, list[float]]) -> None:
    for step, values in differences.items():
        assert values[len(values) // 2] < CLOSE, step
        assert values[-FAR_BODIES - 1] < TOLERANCE, step
        assert values[-1] < FAR_TOLERANCE, step
