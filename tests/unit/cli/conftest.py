"""Worlds for the commands."""

from __future__ import annotations

from typing import Any

import pytest

MODEL = """
bodies:
- name: base
  footprints:
  - type: circle
    radius: $eval param("/radius", 0.5)
    density: 1
- {name: arm, footprints: []}
joints: [{type: weld, name: j, bodies: [{name: base, anchor: [0, 0]}, {name: arm, anchor: [0, 0]}]}]
plugins:
- {type: Laser, name: eye, body: base, range: 9, angle: {min: 0, max: 6, increment: 0.01}}
- {type: Tween, name: tween, body: base, mode: once, duration: 1, delta: [3, 0, 0]}
"""


ROBOT = """
bodies:
- {name: base, footprints: [{type: circle, radius: 0.5, density: 1}]}
plugins:
- {type: DiffDrive, name: drive, body: base, pub_rate: 20}
- {type: Laser, name: eye, body: base, range: 9, noise_std_dev: 0.1, update_rate: 10,
   angle: {min: 0, max: 6, increment: 0.1}}
"""


@pytest.fixture
def robot_world(files: Any, monkeypatch: pytest.MonkeyPatch) -> str:
    """A room with a robot at (3, 5) that can be driven; its folder is the current one."""
    files.write_map("room", ["##########", *["#........#"] * 8, "##########"])
    files.write("robot.model.yaml", ROBOT)
    monkeypatch.chdir(files.folder)
    return files.write(
        "world.yaml",
        """
        properties: {}
        layers: [{name: walls, map: room.yaml}]
        models: [{name: robot, model: robot.model.yaml, pose: [3, 5, 0]}]
        """,
    )


@pytest.fixture
def world_file(files: Any) -> str:
    """A room with a robot at (3, 5) that a tween moves to (6, 5) in one second."""
    files.write_map("room", ["##########", *["#........#"] * 8, "##########"])
    files.write("robot.model.yaml", MODEL)
    return files.write(
        "world.yaml",
        """
        properties: {}
        layers: [{name: [walls, 3d], map: room.yaml, color: [1, 0, 0, 1]}, {name: empty}]
        models: [{name: robot, model: robot.model.yaml, pose: [3, 5, 0]}]
        """,
    )
