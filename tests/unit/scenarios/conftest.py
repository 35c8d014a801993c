"""A room with a robot, and scenarios in it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from textwrap import dedent
from typing import Any

import pytest
from forked_workers import CONTEXT

from flatland.scenarios.episode import Options, Result, run_scenario
from flatland.scenarios.reader import read_scenarios
from flatland.scenarios.scenario import Run, Scenario

ROBOT = """
bodies:
  - name: base
    footprints: [{type: circle, radius: 0.2, density: 100}]
plugins:
  - {type: DiffDrive, name: drive, body: base}
  - type: Laser
    name: laser
    body: base
    range: 10
    angle: {min: -3.1, max: 3.1, increment: 0.05}
    update_rate: 10
    noise_std_dev: 0.01
"""
BOX = """
bodies:
  - name: box
    type: static
    footprints:
      - {type: polygon, density: 0, points: [[-0.3, -0.3], [0.3, -0.3], [0.3, 0.3], [-0.3, 0.3]]}
"""
# A kinematic person who stands still.
PERSON = """
class: person
bodies:
  - {name: body, type: kinematic, footprints: [{type: circle, radius: 0.2, density: 80}]}
"""
WORLD = """
properties: {}
layers: [{name: walls, map: room.yaml}]
models: [{name: robot, model: robot.model.yaml, pose: [2, 5, 0]}]
"""


@pytest.fixture
def forked(monkeypatch: pytest.MonkeyPatch) -> None:
    """Makes worker processes start faster."""
    monkeypatch.setattr("flatland.scenarios.workers._CONTEXT", CONTEXT)


@pytest.fixture
def room(files: Any) -> Path:
    """A folder with the world of a room of 8 m by 8 m, a robot at (2, 5), and models."""
    files.write_map("room", ["##########", *["#........#"] * 8, "##########"])
    files.write("robot.model.yaml", ROBOT)
    files.write("box.model.yaml", BOX)
    files.write("person.model.yaml", PERSON)
    files.write("world.yaml", WORLD)
    folder: Path = files.folder
    return folder


@pytest.fixture
def scenario(room: Path) -> Callable[..., Scenario]:
    """Returns the only scenario of a text, with the world of the room and the goal (5, 5)."""

    def read(text: str = "", **params: object) -> Scenario:
        lines = "" if "world:" in text else "world: world.yaml\n"
        lines += "" if "goal" in text else "goal: [5, 5]\n"
        file = room / "scenario.yaml"
        file.write_text(lines + dedent(text))
        (found,) = read_scenarios(file, params)
        return found

    return read


@pytest.fixture
def run(scenario: Callable[..., Scenario], room: Path) -> Callable[..., Result]:
    """Runs the scenario of a text in this process."""

    def run(
        text: str = "", controller: str = "straight", seed: int = 1, record: str = "none"
    ) -> Result:
        options = Options(str(room), str(room / "out"), record)
        return run_scenario(Run(scenario(text), controller, seed), options)

    return run
