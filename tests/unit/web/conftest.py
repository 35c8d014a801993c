"""A world that a simulation runs in real time, and a viewer that shows it."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Any

import pytest
from raw_web_client import RawWebClient
from waiting import TIMEOUT

from flatland.simulation import Simulation
from flatland.web import WebViewer
from flatland.world import World

ROBOT = """
bodies:
- {name: base, color: [0, 1, 0, 0.5],
   footprints: [{type: circle, radius: 0.5, density: 1, layers: [walls]},
                {type: polygon, points: [[0, 0], [0.4, 0], [0, 0.4]], density: 0, sensor: true}]}
- {name: arm, pose: [0.1, 0, 0],
   footprints: [{type: circle, radius: 0.1, density: 1, sensor: true}]}
joints:
- {type: weld, name: j, bodies: [{name: base, anchor: [0.1, 0]}, {name: arm, anchor: [0, 0]}]}
plugins:
- {type: DiffDrive, name: drive, body: base, pub_rate: 50}
- {type: Laser, name: eye, body: base, range: 20, update_rate: 20, origin: [0.2, 0, 0],
   angle: {min: -1, max: 1, increment: 0.5}}
"""
BOX = "bodies: [{name: box, footprints: [{type: circle, radius: 0.2, density: 1}]}]"
WORLD = """
properties: {}
layers: [{name: walls, map: room.yaml, color: [1, 0, 0, 1]}]
models: [{name: robot, model: robot.model.yaml, pose: [3, 5, 0]}]
"""


@pytest.fixture
def world(files: Any) -> World:
    """A room of 8 m x 8 m with a robot at (3, 5)."""
    files.write_map("room", ["##########", *["#........#"] * 8, "##########"])
    files.write("robot.model.yaml", ROBOT)
    files.write("box.model.yaml", BOX)
    return files.load(WORLD)  # type: ignore[no-any-return]


@pytest.fixture
def simulation(world: World) -> Iterator[Simulation]:
    """Steps the world in real time in a thread."""
    simulation = Simulation(world, 200)
    thread = threading.Thread(target=simulation.run)
    thread.start()
    yield simulation
    simulation.stop()
    thread.join(TIMEOUT)
    assert not thread.is_alive()


@pytest.fixture
def viewer() -> Iterator[WebViewer]:
    """A viewer on a free port, without worlds."""
    with WebViewer(port=0) as viewer:
        yield viewer


@pytest.fixture
def url(world: World, simulation: Simulation, viewer: WebViewer) -> str:
    """Address of a viewer that shows the world."""
    viewer.add_world(world, "room", simulation)
    return viewer.url


@pytest.fixture
def client(url: str) -> Iterator[RawWebClient]:
    """A client that has received the models."""
    with RawWebClient(url) as client:
        client.wait_model("robot")
        yield client
