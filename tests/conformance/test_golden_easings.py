"""Comparison of all easings with a recorded trace; unlike the reference, the end is exact."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import flatland
from flatland.plugins._easing import EASINGS

TOLERANCE = 1e-4  # m, for a distance of 1 m

WORLD = """
properties: {}
layers: []
models: [{name: door, model: door.model.yaml}]
"""


@pytest.fixture(scope="module")
def golden(golden_dir: Path) -> dict[str, Any]:
    trace: dict[str, Any] = json.loads((golden_dir / "easings.json").read_text())
    return trace


def positions(golden: dict[str, Any], easing: str, folder: Path) -> list[float]:
    """Returns the x coordinate of the body after each step [m]."""
    (folder / "world.yaml").write_text(WORLD)
    (folder / "door.model.yaml").write_text(
        f"""
        bodies:
          - name: panel
            type: kinematic
            footprints: [{{type: circle, radius: 0.1, density: 1}}]
        plugins:
          - {{type: Tween, name: slide, body: panel, delta: [{golden["delta_x"]}, 0, 0],
             duration: {golden["duration"]}, mode: {golden["mode"]}, easing: {easing}}}
        """
    )
    found = []
    with flatland.World.from_yaml(folder / "world.yaml", seed=1, step_size=golden["dt"]) as world:
        panel = world.model("door").body("panel")
        for _ in golden["x_after_each_step"][easing]:
            world.step()
            found.append(panel.pose[0])
    return found


def test_the_trace_contains_all_easings(golden: dict[str, Any]) -> None:
    assert set(golden["x_after_each_step"]) == set(EASINGS)


@pytest.mark.parametrize("easing", EASINGS)
def test_positions_match_the_trace(golden: dict[str, Any], easing: str, tmp_path: Path) -> None:
    expected = golden["x_after_each_step"][easing]
    found = positions(golden, easing, tmp_path)
    last = round(golden["duration"] / golden["dt"])
    assert found[: last - 1] == pytest.approx(expected[: last - 1], abs=TOLERANCE)
    # The exponential curves of the reference do not reach the end exactly.
    assert found[last - 1 :] == [golden["delta_x"]] * (len(expected) - last + 1)
