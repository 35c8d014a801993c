"""The published map of a layer, and layers that receive their maps, without ROS."""

from __future__ import annotations

import math
import threading
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from waiting import wait_until

from flatland.errors import FlatlandError
from flatland.maps.map_image import image_edges
from flatland.maps.occupancy_grid import OccupancyGrid
from flatland.node.parameters import ParameterError
from flatland.node.transport import CallError

MAP = "type: line_segments\ndata: walls.dat\nscale: 1.0\norigin: [0, 0, 0]\n"
WALLS = "-5 -5 5 -5\n5 -5 5 5\n5 5 -5 5\n-5 5 -5 -5\n"  # a room of 10 m by 10 m around (0, 0)
ROBOT = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins: [{type: Laser, name: laser, body: base, range: 20, update_rate: 10,
  angle: {min: 0, max: 0, increment: 1}}]
"""
WORLD = """
properties: {publish_map: 2d}
layers: [{name: 2d, map: map.yaml}, {name: empty}]
models: []
"""
RASTER = """
properties: {publish_map: 2d}
layers: [{name: 2d, map: room.yaml}, {name: 3d}]
"""
WAITING = """
properties: {publish_map: 2d}
layers: [{name: 2d, map: "topic://site/map"}]
models: [{name: r, model: robot.model.yaml, pose: [1, 1, 0]}]
"""


def box(size: int = 9, resolution: float = 0.5) -> OccupancyGrid:
    """A grid with its corner at the origin, whose outermost cells are occupied."""
    cells = np.full((size, size), 100, np.int8)
    cells[1:-1, 1:-1] = 0
    return OccupancyGrid((0.0, 0.0, 0.0), resolution, cells)


@pytest.fixture
def start(serve: Any, files: Any) -> Any:
    for name, text in {"map.yaml": MAP, "walls.dat": WALLS, "robot.model.yaml": ROBOT}.items():
        files.write(name, text)
    files.write_map("room", ["#####", "#...#", "#####"])
    return lambda world=WORLD, **parameters: serve(world, lockstep=True, **parameters)


def static_map(node: Any) -> Any:
    return node.call("static_map").map


def shapes(node: Any, topic: str) -> list[tuple[int, ...]]:
    """Returns the shapes of the maps that were published on a topic."""
    return [value.grid.cells.shape for value in node.transport.topics[topic].sent]


def ahead(node: Any) -> float:
    """Returns the range ahead of the robot."""
    output = node.run(lambda: node.world.output("/scan"))
    assert node.call("step_world", duration=0.1).success
    return float(output.latest.ranges[0])


def test_a_layer_of_line_segments(start: Any) -> None:
    node = start(map_resolution=0.5, map_frame="/arena")
    published = static_map(node)
    assert published.frame_id == "arena"
    grid = published.grid
    assert (grid.origin, grid.resolution) == ((-5, -5, 0), 0.5)
    assert grid.cells.shape == (21, 21)
    walls = np.full((21, 21), 100)
    walls[1:-1, 1:-1] = 0
    assert (grid.cells == walls).all()


def test_the_map_of_a_layer_is_published_for_the_first_subscriber(
    start: Any, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO")
    node = start(RASTER)
    node.transport.topics["map_metadata"].connect()
    wait_until("the map is loaded", lambda: shapes(node, "map_metadata") == [(3, 5)])
    (metadata,) = node.transport.topics["map_metadata"].sent
    assert metadata.frame_id == "map"
    assert static_map(node) is metadata
    assert 'publishing layer "2d" as a map of 5 x 3 cells of 1 m' in caplog.text


def test_a_map_that_replaces_another_is_published(start: Any) -> None:
    node = start(RASTER)
    node.transport.topics["map"].connect()
    wait_until("the first map", lambda: shapes(node, "map") == [(3, 5)])
    node.run(lambda: node.world.set_layer_map("2d", box(7)))
    wait_until("the second map", lambda: shapes(node, "map") == [(3, 5), (7, 7)])
    # Other layers and walls are not part of the map.
    before = static_map(node)
    node.run(lambda: node.world.set_layer_map("3d", box(9)))
    node.run(lambda: node.world.layer("2d").add_edges([(1, 1, 2, 2)]))
    assert static_map(node) is before
    assert shapes(node, "map") == [(3, 5), (7, 7)]


def test_false_overrides_the_world_file(start: Any) -> None:
    transport = start(publish_map=False).transport
    assert not {"map", "map_metadata"} & set(transport.topics)
    assert "static_map" not in transport.services


@pytest.mark.parametrize(
    ("layer", "reason"),
    [
        (
            "roof",
            'Invalid parameter "~publish_map": it must be the name of a layer '
            r"\(2d, empty\), got 'roof'",
        ),
        ("empty", 'layer "empty" has no walls and therefore no map'),
    ],
)
def test_a_layer_that_cannot_be_published(start: Any, layer: str, reason: str) -> None:
    with pytest.raises((FlatlandError, ParameterError), match=reason):
        start(publish_map=layer)


def test_a_layer_is_not_published_on_its_own_topic(start: Any) -> None:
    world = WAITING.replace("topic://site/map", "topic:///map")
    with pytest.raises(FlatlandError, match="cannot be published on the topic that it is received"):
        start(world)


def test_a_layer_waits_for_its_map(start: Any, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO")
    node = start(WAITING)
    published = node.transport.topics["map"]
    published.connect()
    published.sent.clear()
    receive = node.transport.callbacks["site/map"]
    assert math.isnan(ahead(node))
    with pytest.raises(CallError, match='layer "2d" has no map'):
        static_map(node)
    # Another map replaces the first one.
    for size, distance in ((9, 3), (11, 4)):
        receive(box(size))
        assert ahead(node) == pytest.approx(distance, abs=1e-5)
        wait_until(
            "the map",
            lambda size=size: [m.grid.cells.shape[0] for m in published.sent][-1:] == [size],
        )
    assert 'Layer "2d": map of 9 x 9 cells from topic "site/map"' in caplog.text
    # An invalid one, or one beyond the range of the physics, does not, and a reset keeps it.
    receive(OccupancyGrid((0.0, 0.0, 0.0), 0.0, np.zeros((3, 3), np.int8)))
    receive(OccupancyGrid((1e30, 0.0, 0.0), 1.0, box(9).cells))
    assert node.call("reset_world", seed=-1, keep_time=False).success
    assert ahead(node) == pytest.approx(4, abs=1e-5)
    assert caplog.text.count('Layer "2d": cannot use the map of topic "site/map": ') == 2


def test_grids_are_converted_in_the_threads_that_receive_them(
    start: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    threads = []

    def convert(*arguments: Any) -> Any:
        threads.append(threading.current_thread())
        return image_edges(*arguments)

    monkeypatch.setattr("flatland.maps.grid_map.image_edges", convert)
    node = start(WAITING)
    node.transport.callbacks["site/map"](box(9))
    assert ahead(node) == pytest.approx(3, abs=1e-5)
    node.transport.receivable = lambda _type: (OccupancyGrid, lambda _grid: box(11))
    grid = SimpleNamespace(data=[0])
    assert node.call("set_layer_map", layer="2d", map_path="", grid=grid).success
    assert ahead(node) == pytest.approx(4, abs=1e-5)
    assert threads == [threading.current_thread()] * 2


def test_a_map_is_latched_and_published_once(start: Any) -> None:
    topics = start(RASTER).transport.topics
    assert topics["map"].options["latch"] is topics["map_metadata"].options["latch"] is True
    topics["map_metadata"].disconnect()
    for name in ("map", "map_metadata"):
        topics[name].connect()
        wait_until("the map", lambda: topics["map"].sent)
        assert len(topics["map"].sent) == 1


@pytest.mark.parametrize(
    ("error", "has_traceback"), [(FlatlandError("cause"), False), (RuntimeError("cause"), True)]
)
def test_a_map_that_cannot_be_published_is_reported(
    start: Any,
    caplog: pytest.LogCaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
    error: Exception,
    has_traceback: bool,
) -> None:
    node = start(RASTER)
    topic = node.transport.topics["map"]

    def fail(_message: Any) -> None:
        raise error

    def errors() -> list[Any]:
        return [each for each in caplog.records if each.levelname == "ERROR"]

    with monkeypatch.context() as patch:
        patch.setattr(topic, "publish", fail)
        topic.connect()
        [record] = wait_until("the error", errors)
    assert record.getMessage() == "cannot publish the map: cause"
    assert bool(record.exc_info) is has_traceback
    topic.connect()  # The next subscriber causes another attempt.
    wait_until("the map", lambda: topic.sent)
