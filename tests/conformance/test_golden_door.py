"""Comparison with a recorded trace: a robot that drives, and a sliding door."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

import flatland

POSE_TOLERANCE = 2e-4  # m and rad


@pytest.fixture(scope="module")
def records(golden_dir: Path) -> list[dict[str, Any]]:
    trace = json.loads((golden_dir / "free.trace.json").read_text())
    found: list[dict[str, Any]] = trace["records"]
    return found


def test_the_door_matches_the_trace(golden_dir: Path, records: list[dict[str, Any]]) -> None:
    by_step = {record["step"]: record["bodies"]["door1/panel"] for record in records}
    worst = 0.0
    with flatland.World.from_yaml(golden_dir / "free.yaml", seed=1, step_size=0.005) as world:
        panel = world.model("door1").body("panel")
        for step in range(max(by_step) + 1):
            if step in by_step:
                expected = by_step[step]
                worst = max(
                    worst, *(abs(a - b) for a, b in zip(panel.pose, expected[:3], strict=True))
                )
                # The door is moved by setting its pose, so that it has no velocity.
                assert panel.velocity == tuple(expected[3:]) == (0.0, 0.0, 0.0)
            world.step()
    print(f"\ndoor within {worst:.2g} m and rad")
    assert not math.isnan(worst)
    assert worst < POSE_TOLERANCE
