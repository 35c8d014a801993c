"""The cost of people who walk in the office."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from scenes import CHECKOUT
from table import Row
from timing import mean_of

import flatland

PEOPLE = 200
STEPS = 20  # two updates of the crowd


@contextmanager
def office(count: int, model: str, *, body_type: str = "kinematic") -> Iterator[flatland.World]:
    """Loads the map of the office with people with legs who wander between random places."""
    world = {
        "properties": {},
        "layers": [{"name": ["2d", "body"], "map": str(CHECKOUT / "worlds/office/office.yaml")}],
        "plugins": [
            {
                "name": "people",
                "type": "Pedestrians",
                "model": model,
                "body_type": body_type,
                "layers": ["body"],
                "legs": {"layers": ["2d"]},
                "groups": [{"name": "person", "count": count, "area": [-28, -11, 28, 11]}],
            }
        ],
    }
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "world.yaml"
        path.write_text(json.dumps(world))
        with flatland.World.from_yaml(path, seed=1) as loaded:
            yield loaded


def rows(unit: float) -> list[Row]:
    """Measures a step with people, by each model."""
    results = []
    for model, body_type in (
        ("social_force", "kinematic"),
        ("orca", "kinematic"),
        ("social_force", "dynamic"),
    ):
        with office(PEOPLE, model, body_type=body_type) as world:
            world.step(1000)

            def run(world: flatland.World = world) -> None:
                world.step(STEPS)

            step = mean_of(run) / STEPS
        results.append(
            Row(
                f"step with {PEOPLE} people in the office, {model}, {body_type}",
                step.seconds / unit,
                "U",
                1.0,
                note=f"{step.seconds * 1e6:.0f} µs, {step.rate}",
            )
        )
    return results
