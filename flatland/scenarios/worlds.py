"""The files of random worlds that scenarios use."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from flatland.scenarios.scenario import GeneratedWorld, Scenario
from flatland.worldgen import generate
from flatland.worldgen.new_files import write_new


def world_file(scenario: Scenario, seed: int, folder: Path) -> Path:
    """Returns the world file of a run; that of a random world is written unless it exists.

    Args:
        scenario: The scenario.
        seed: Seed of the run.
        folder: Folder of random worlds.

    Raises:
        ValueError: The size of a random world is out of range.
        OSError: The files cannot be written.
    """
    spec = scenario.world
    if isinstance(spec, str):
        return Path(spec)
    plan_seed = seed if spec.seed is None else spec.seed
    name = _name(spec, plan_seed, scenario)
    target = folder / name
    if not target.is_dir():
        folder.mkdir(parents=True, exist_ok=True)
        plan = generate(spec.kind, plan_seed, spec.size, radius=spec.radius)
        files = plan.files(name)
        text = json.dumps(_world(scenario, plan.start), indent=1)
        try:
            write_new(target, files | {"world.yaml": text.encode()})
        except OSError:
            if not target.is_dir():  # by another process, with the same contents
                raise
    return target / "world.yaml"


def _name(spec: GeneratedWorld, seed: int, scenario: Scenario) -> str:
    more = json.dumps([_has_people(scenario), scenario.robot.model, scenario.robot.name])
    digest = hashlib.sha256(more.encode()).hexdigest()[:8]
    return f"{spec.kind}-{seed}-{spec.size[0]:g}x{spec.size[1]:g}-{spec.radius:g}-{digest}"


def _has_people(scenario: Scenario) -> bool:
    return bool(scenario.people)


def _world(scenario: Scenario, start: tuple[float, float, float]) -> dict[str, Any]:
    """Returns the contents of the world file, YAML in the form of JSON."""
    robot = {
        "name": scenario.robot.name or "robot",
        "model": scenario.robot.model or "robot.model.yaml",
        "pose": list(start),
    }
    world: dict[str, Any] = {
        "properties": {},
        "layers": [{"name": "walls", "map": "map.yaml", "color": [0.3, 0.3, 0.3, 1]}],
        "models": [robot],
    }
    if _has_people(scenario):
        groups = {people.group or "visitor" for people in scenario.people}
        world["plugins"] = [
            {
                "name": "people",
                "type": "Pedestrians",
                "groups": [{"name": name, "count": 0} for name in sorted(groups)],
            }
        ]
    return world
