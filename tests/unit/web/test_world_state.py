"""The state of a world as clients see it, without a world and a connection."""

from __future__ import annotations

import json

import numpy as np

from flatland.geometry import FloatArray
from flatland.web.capture import Captured
from flatland.web.client_view import Seen
from flatland.web.scene import LayerContents, SceneChange
from flatland.web.world_state import WorldState


def layer(name: str, *edges: list[float]) -> LayerContents:
    return LayerContents(name, (1, 1, 1, 1), (0, 0, 0), np.array(edges, np.float32))


def captured(layers: list[LayerContents]) -> Captured:
    """Returns the state of a world without models."""
    return Captured(
        time=1.0,
        paused=False,
        rate=None,
        lockstep=False,
        step_size=0.01,
        change=SceneChange(),
        layers=layers,
        motions=np.empty((0, 6)),
        scans=[],
        frames=None,
        details=[],
        series={},
    )


class Receiver:
    """A client that keeps the edges of each layer by its index, as the page does."""

    def __init__(self) -> None:
        self.seen = Seen()
        self.names: list[str] = []
        self.edges: dict[int, FloatArray] = {}

    def receive(self, state: WorldState) -> int:
        """Receives everything; returns the number of messages with edges."""
        count = 0
        while (message := state.next_contents(self.seen)) is not None:
            if isinstance(message, bytes):
                (number,) = np.frombuffer(message, "<u4", 1, 16)
                self.edges[int(number)] = np.frombuffer(message, "<f4", offset=24).reshape(-1, 4)
                count += 1
            elif json.loads(message)["type"] == "world":
                self.names = [each["name"] for each in json.loads(message)["layers"]]
        return count

    def layers(self) -> dict[str, list[list[float]]]:
        return {name: self.edges[number].tolist() for number, name in enumerate(self.names)}


WALLS, DOORS = layer("walls", [0, 0, 1, 0]), layer("doors", [0, 0, 0, 2], [0, 2, 3, 2])
BOTH = {"walls": [[0, 0, 1, 0]], "doors": [[0, 0, 0, 2], [0, 2, 3, 2]]}


def test_edges_follow_a_new_order_of_layers() -> None:
    state, client = WorldState(0, "room"), Receiver()
    state.apply(captured([WALLS, DOORS]))
    client.receive(state)
    assert client.layers() == BOTH
    state.apply(captured([DOORS, WALLS]))
    client.receive(state)
    assert client.names == ["doors", "walls"]
    assert client.layers() == BOTH


def test_only_changed_edges_are_sent() -> None:
    state, client = WorldState(0, "room"), Receiver()
    state.apply(captured([WALLS, DOORS]))
    assert client.receive(state) == 2
    state.apply(captured([WALLS, layer("doors", [5, 5, 6, 6])]))
    assert client.receive(state) == 1
    assert client.layers() == {"walls": [[0, 0, 1, 0]], "doors": [[5, 5, 6, 6]]}


def test_a_layer_that_returns_is_sent_again() -> None:
    state, client = WorldState(0, "room"), Receiver()
    for layers in ([WALLS, DOORS], [WALLS], [WALLS, DOORS]):
        state.apply(captured(layers))
        client.edges = {n: e for n, e in client.edges.items() if n < len(layers)}
        client.receive(state)
    assert client.layers() == BOTH
