"""The map of a layer, published as by `map_server`, and the warning of lasers without a TF path."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import rospy
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import GetMap
from sensor_msgs.msg import LaserScan

GREYS = [[0, 205, 254], [254, 254, 0]]
CELLS = [0, 0, 100, 100, -1, 0]  # the bottom row first; 205 is unknown
GREY_MAP = "image: grey.png\nresolution: 0.5\norigin: [1, -2, 0.3]\noccupied_thresh: 0.65\n"
LAYERS = "[{name: 2d, map: map.yaml}, {name: [grey, low], map: grey.yaml}, {name: empty}]"
LASER = "{type: Laser, name: eye, body: base, range: 20, angle: {min: 0, max: 1, increment: 1}}"
BODIES = "bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]"
LOST = f"{BODIES}\nplugins: [{LASER}]\n"
FOUND = f"{BODIES}\nplugins: [{LASER}, {{type: DiffDrive, name: drive, body: base}}]\n"
MODELS = """
  - {name: lost, model: lost.model.yaml, namespace: lost}
  - {name: found, model: found.model.yaml, namespace: found, pose: [2, 2, 0]}
"""


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    """A world whose file publishes the layer `grey`, an image."""
    path = write_world(MODELS, layers=LAYERS, lost=LOST, found=FOUND)
    (path.parent / "grey.yaml").write_text(GREY_MAP)
    cv2.imwrite(str(path.parent / "grey.png"), np.array(GREYS, np.uint8))
    text = path.read_text().replace("properties: {}", "properties: {publish_map: low}")
    path.write_text(text)
    return path


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, module_ros: Any, world: Path) -> Any:
    """One server for most tests of this file; the scans of both robots have a subscriber."""
    process = module_launcher.server(world, seed=1, update_rate=20)
    for robot in ("lost", "found"):
        module_ros.topic(f"/{robot}/scan", LaserScan)
    return process


def assert_is_the_map(grid: OccupancyGrid) -> None:
    assert grid.header.frame_id == "map"
    assert list(grid.data) == CELLS
    info = grid.info
    assert (info.width, info.height, info.resolution) == (3, 2, 0.5)
    position, rotation = info.origin.position, info.origin.orientation
    assert (position.x, position.y, position.z) == (1, -2, 0)
    assert (rotation.x, rotation.y) == (0, 0)
    assert (rotation.z, rotation.w) == pytest.approx((math.sin(0.15), math.cos(0.15)))


def test_topics_and_service_have_the_names_and_types_of_map_server(ros: Any, server: Any) -> None:
    registered = ros.registered()
    assert {"/map", "/map_metadata"} <= registered["publishers"]
    assert "/static_map" in registered["services"]
    types = ros.types()
    assert types["/map"] == "nav_msgs/OccupancyGrid"
    assert types["/map_metadata"] == "nav_msgs/MapMetaData"
    assert "publishing layer" not in server.output


def test_a_missing_image_is_an_error_until_it_is_back(ros: Any, world: Path, server: Any) -> None:
    image = world.parent / "grey.png"
    content = image.read_bytes()
    image.unlink()
    try:
        with pytest.raises(rospy.ServiceException, match=r"Failed to load .*grey\.yaml:1"):
            ros.call("/static_map", GetMap)
        topic = ros.topic("/map_metadata", MapMetaData)
        server.wait_for_line(r"\[ERROR\].*cannot publish the map: .*Failed to load .*grey\.yaml:1")
        assert topic.rest() == []
    finally:
        image.write_bytes(content)
    assert_is_the_map(ros.call("/static_map", GetMap).map)


def test_map_is_published_with_its_metadata(ros: Any) -> None:
    grid = ros.topic("/map", OccupancyGrid).next()
    assert_is_the_map(grid)
    assert 0 < grid.header.stamp.to_sec() < 1000  # simulated time
    assert grid.info.map_load_time == grid.header.stamp
    assert ros.topic("/map_metadata", MapMetaData).next() == grid.info


def test_map_is_latched_and_created_once(ros: Any, server: Any) -> None:
    first = ros.topic("/map", OccupancyGrid).next()
    second = ros.topic("/map", OccupancyGrid)
    assert second.next().header.stamp == first.header.stamp
    assert second.rest() == []
    assert ros.call("/static_map", GetMap).map.header.stamp == first.header.stamp
    server.wait_for_line('publishing layer "low" as a map of 3 x 2 cells of 0.5 m')
    assert server.output.count("publishing layer") == 1
