"""`set_layer_map` of a running node, layers that receive their map, and the published map."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rospy
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import GetMap
from sensor_msgs.msg import LaserScan
from visualization_msgs.msg import MarkerArray
from waiting import wait_until

from flatland.srv import ResetWorld, SetLayerMap, StepWorld

NAN, INF = float("nan"), float("inf")
HALL = "-9 -9 9 -9\n9 -9 9 9\n9 9 -9 9\n-9 9 -9 -9\n"
MODELS = "[{name: r, model: robot.model.yaml, namespace: r, pose: [1, 1, 0]}]"


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    path = write_world(MODELS)
    (path.parent / "hall.dat").write_text(HALL)
    for name, data in (("hall", "hall.dat"), ("lost", "none.dat")):
        (path.parent / f"{name}.yaml").write_text(
            f"type: line_segments\ndata: {data}\nscale: 1.0\norigin: [0, 0, 0]\n"
        )
    return path


@pytest.fixture(scope="module")
def waiting_world(write_world: Callable[..., Path]) -> Path:
    return write_world(MODELS, layers='[{name: 2d, map: "topic://site/map"}]')


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
        self._topic = ros.topic("/r/scan", LaserScan)

    def ahead(self) -> float:
        self._topic.drop()
        # The node may not know of the subscription in the first call.
        while self._topic.is_empty:
            stamp = self._ros.call("/step_world", StepWorld, 0.1).stamp
            self._topic.rest()
            scan_stamp = stamp - rospy.Duration(0.1)
            self._ros.call("/step_world", StepWorld, 0.1)
        scan = self._topic.until(lambda message: message.header.stamp >= scan_stamp)
        return float(scan.ranges[len(scan.ranges) // 2])


@pytest.fixture
def scans(ros: Any) -> Any:
    assert ros.call("/reset_world", ResetWorld, False, -1).success
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


def test_a_reset_returns_to_the_map_of_the_file(ros: Any, scans: Any) -> None:
    assert set_map(ros, message=grid()).success
    assert ros.call("/reset_world", ResetWorld, False, -1).success
    assert scans.ahead() == pytest.approx(4, abs=1e-5)


def test_the_published_map_and_markers_follow(ros: Any, scans: Any, server: Any) -> None:
    del scans
    maps, metadata = ros.topic("/map", OccupancyGrid), ros.topic("/map_metadata", MapMetaData)
    markers = ros.topic("/flatland_server/debug/layer/2d", MarkerArray)
    room = maps.next()
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
    assert ros.call("/reset_world", ResetWorld, False, -1).success
    assert maps.until(lambda message: message.info.width != 9).data == room.data


def test_overlapped_models_are_logged(ros: Any, scans: Any, server: Any) -> None:
    del scans
    assert set_map(ros, message=grid(3, x=1.0)).success
    server.wait_for_line(r'\[WARN\].*model "r" overlaps layer "2d" at \(1\.000, 1\.000, 0\.000\)')


def broken(**changes: Any) -> Any:
    message = grid()
    for name, value in changes.items():
        setattr(message.info, name, value)
    return message


def shifted(x: float) -> Any:
    return grid(x=x)


@pytest.mark.parametrize(
    ("path", "message", "text"),
    [
        ("", None, "exactly one of map_path and grid must be given"),
        ("hall.yaml", grid(), "exactly one of map_path and grid must be given"),
        ("missing.yaml", None, "Flatland YAML: File does not exist"),
        ("lost.yaml", None, "Flatland File: Failed to load"),
        ("walls.dat", None, "Flatland YAML: "),
        ("/dev/zero", None, "it is not a regular file"),
        ("", broken(width=8), "a grid of 8 x 9 cells must have that number of values, got 81"),
        ("", broken(width=0), "a grid of 0 x 9 cells must have that number of values, got 81"),
        ("", broken(resolution=0.0), "the resolution of a grid must be positive and finite"),
        ("", broken(resolution=-1.0), "the resolution of a grid must be positive and finite"),
        ("", broken(resolution=NAN), "the resolution of a grid must be positive and finite"),
        ("", broken(resolution=INF), "the resolution of a grid must be positive and finite"),
        ("", broken(resolution=1e30), "must be finite"),
        ("", shifted(NAN), "must be finite"),
        ("", shifted(1e300), "must be finite"),
    ],
)
def test_a_failure_leaves_the_old_map(
    ros: Any, scans: Any, path: str, message: Any, text: str
) -> None:
    answer = set_map(ros, path, message)
    assert answer.success is False
    assert text in answer.message
    assert scans.ahead() == pytest.approx(4, abs=1e-5)


def test_an_unknown_layer_is_an_error(ros: Any) -> None:
    answer = set_map(ros, "hall.yaml", layer="3d")
    assert answer.success is False
    assert 'layer with name "3d" does not exist' in answer.message


class TestTopic:
    """Other servers replace the one of this file from here on."""

    @pytest.fixture
    def waiting(self, launcher: Any, waiting_world: Path, server: Any) -> Any:
        server.stop()
        return launcher.server(waiting_world, lockstep=True, publish_map="2d", seed=1)

    def test_a_layer_waits_for_its_map(self, ros: Any, waiting: Any) -> None:
        waiting.wait_for_line(r'Layer "2d" is empty until a map is received from topic "site/map"')
        scans = Scans(ros)
        assert math.isnan(scans.ahead())
        with pytest.raises(rospy.ServiceException, match='layer "2d" has no map'):
            ros.call("/static_map", GetMap)
        published = ros.topic("/map", OccupancyGrid)
        assert published.rest() == []

        maps = ros.publisher("/site/map", OccupancyGrid)
        maps.publish(grid())
        waiting.wait_for_line(r'Layer "2d": map of 9 x 9 cells from topic "site/map"')
        assert scans.ahead() == pytest.approx(3, abs=1e-5)
        assert published.next().info.width == 9

        # Another map replaces it, an invalid one does not, and a reset keeps it.
        maps.publish(grid(11))
        published.until(lambda message: message.info.width == 11)
        assert scans.ahead() == pytest.approx(4, abs=1e-5)
        maps.publish(broken(resolution=0.0))
        waiting.wait_for_line(
            r'\[ERROR\].*Layer "2d": cannot use the map of topic "site/map": .*resolution'
        )
        assert ros.call("/reset_world", ResetWorld, False, -1).success
        assert scans.ahead() == pytest.approx(4, abs=1e-5)

    def test_a_latched_map_is_received_after_the_start(
        self, ros: Any, launcher: Any, waiting_world: Path
    ) -> None:
        maps = rospy.Publisher("/site/map", OccupancyGrid, queue_size=1, latch=True)
        try:
            maps.publish(grid())
            process = launcher.server(waiting_world, lockstep=True)
            process.wait_for_line(r'Layer "2d": map of 9 x 9 cells')
            assert Scans(ros).ahead() == pytest.approx(3, abs=1e-5)
        finally:
            maps.unregister()

    def test_a_layer_is_not_published_on_its_own_topic(
        self, launcher: Any, write_world: Callable[..., Path]
    ) -> None:
        world = write_world(layers='[{name: 2d, map: "topic:///map"}]')
        process = launcher.start(world_path=world, publish_map="2d")
        assert process.wait() == 1
        (line,) = [line for line in process.lines if "[FATAL]" in line]
        assert 'layer "2d" cannot be published on the topic that it is received from' in line

    def test_files_are_restricted(
        self, ros: Any, launcher: Any, world: Path, tmp_path: Path
    ) -> None:
        launcher.server(world, model_path=str(tmp_path))
        answer = set_map(ros, "hall.yaml")
        assert answer.success is False
        assert "outside the folders of model_path" in answer.message
        assert set_map(ros, message=grid()).success

    def test_a_large_map(self, ros: Any, launcher: Any, world: Path) -> None:
        launcher.server(world, lockstep=True)
        assert set_map(ros, message=grid(2000, resolution=0.05, x=-50.0)).success
        wait_until("a step", lambda: ros.call("/step_world", StepWorld, 0.0).success)
