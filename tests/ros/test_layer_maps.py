"""`set_layer_map` of a running node, layers that receive their map, and the published map."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import GetMap
from sensor_msgs.msg import LaserScan
from visualization_msgs.msg import MarkerArray

from flatland.srv import SetLayerMap

HALL = "-9 -9 9 -9\n9 -9 9 9\n9 9 -9 9\n-9 9 -9 -9\n"
MODELS = "[{name: r, model: robot.model.yaml, namespace: r, pose: [1, 1, 0]}]"


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    layers = '[{name: 2d, map: map.yaml}, {name: site, map: "topic://site/map"}]'
    path = write_world(MODELS, layers=layers)
    (path.parent / "hall.dat").write_text(HALL)
    (path.parent / "hall.yaml").write_text(
        "type: line_segments\ndata: hall.dat\nscale: 1.0\norigin: [0, 0, 0]\n"
    )
    return path


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, world: Path) -> Any:
    return module_launcher.server(world, lockstep=True, show_viz=True, publish_map="2d")


def grid(size: int = 9, *, resolution: float = 0.5, x: float = 0.0, value: int = 100) -> Any:
    """A grid whose outermost cells are occupied, with an origin that has no rotation."""
    cells = np.full((size, size), value, np.int8)
    cells[1:-1, 1:-1] = 0
    message = OccupancyGrid(data=cells.ravel().tolist())
    message.info.width = message.info.height = size
    message.info.resolution = resolution
    message.info.origin.position.x = x
    return message


def set_map(ros: Any, path: str = "", message: Any = None, layer: str = "2d") -> Any:
    return ros.call("/set_layer_map", SetLayerMap, layer, path, message or OccupancyGrid())


class Scans:
    """The range ahead of the robot."""

    def __init__(self, ros: Any) -> None:
        self._ros = ros
        self._topic = ros.ready_topic("/r/scan", LaserScan)
        # The connection of the previous test may have counted as that of this one.
        while not self._topic.rest():
            ros.step(0.1)

    def ahead(self) -> float:
        self._ros.step(0.1)  # the period of the laser
        ranges = self._topic.next().ranges
        return float(ranges[len(ranges) // 2])


@pytest.fixture
def scans(ros: Any) -> Any:
    ros.reset()
    return Scans(ros)


def test_maps_from_files_and_grids(ros: Any, scans: Any) -> None:
    assert scans.ahead() == pytest.approx(4, abs=1e-5)
    answer = set_map(ros, "hall.yaml")
    assert (answer.success, answer.message) == (True, "")
    assert scans.ahead() == pytest.approx(8, abs=1e-5)
    assert set_map(ros, message=grid()).success
    assert scans.ahead() == pytest.approx(3, abs=1e-5)
    turned = grid(x=3.25)
    turned.info.origin.position.y = -1.25
    turned.info.origin.orientation.z = turned.info.origin.orientation.w = math.sqrt(0.5)
    assert set_map(ros, message=turned).success
    assert scans.ahead() == pytest.approx(1.75, abs=1e-5)


def test_the_published_map_and_markers_follow(ros: Any, scans: Any, server: Any) -> None:
    del scans
    maps, metadata = ros.topic("/map", OccupancyGrid), ros.topic("/map_metadata", MapMetaData)
    markers = ros.topic("/flatland_server/debug/layer/2d", MarkerArray)
    room = maps.next()
    assert room.header.frame_id == "map"
    assert metadata.next() == room.info
    assert markers.next().markers[0].points
    sent = grid()
    assert set_map(ros, message=sent).success
    received = maps.until(lambda message: message.info.width == 9)
    assert list(received.data) == sent.data
    assert received.info.resolution == 0.5
    metadata.until(lambda info: info.width == 9)
    markers.until(lambda message: len(message.markers[0].points) == 16)
    assert ros.call("/static_map", GetMap).map.data == received.data
    # A late subscriber receives the last map.
    assert ros.topic("/map", OccupancyGrid).next().info.width == 9
    ros.reset()
    assert maps.until(lambda message: message.info.width != 9).data == room.data


def broken(**changes: Any) -> Any:
    message = grid()
    for name, value in changes.items():
        setattr(message.info, name, value)
    return message


def test_a_failure_leaves_the_old_map(ros: Any, scans: Any) -> None:
    text = "a grid of 8 x 9 cells must have that number of values, got 81"
    for path, message, reason in (
        ("missing.yaml", None, "Flatland YAML: File does not exist"),
        ("", broken(width=8), text),
    ):
        answer = set_map(ros, path, message)
        assert answer.success is False
        assert reason in answer.message
    assert scans.ahead() == pytest.approx(4, abs=1e-5)


def test_a_layer_receives_its_map(ros: Any, scans: Any, server: Any) -> None:
    server.wait_for_line(r'Layer "site" is empty until a map is received from topic "site/map"')
    assert scans.ahead() == pytest.approx(4, abs=1e-5)
    maps = ros.publisher("/site/map", OccupancyGrid)
    maps.publish(grid())
    server.wait_for_line(r'Layer "site": map of 9 x 9 cells from topic "site/map"')
    assert scans.ahead() == pytest.approx(3, abs=1e-5)
    maps.publish(broken(resolution=0.0))
    server.wait_for_line(
        r'\[ERROR\].*Layer "site": cannot use the map of topic "site/map": .*resolution'
    )
    assert scans.ahead() == pytest.approx(3, abs=1e-5)
