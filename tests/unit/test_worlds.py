"""The included worlds: maps, robots, and stepping."""

from __future__ import annotations

import importlib
import math
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import pytest

import flatland

Image = npt.NDArray[np.uint8]

# A place in each room [m], in the world frame.
ROOMS = {
    "lobby": (-24.5, 1.5),
    "draught lobby": (-28.3, 0.0),
    "post room": (-27.0, -8.0),
    "training room": (-22.6, 9.1),
    "large meeting room": (-19.0, 11.0),
    "office S1": (-18.5, -9.0),
    "office S2": (-14.5, -9.0),
    "office S3": (-10.5, -9.0),
    "office S4": (-6.5, -9.0),
    "office S5": (-2.5, -9.0),
    "meeting room S": (0.3, -8.0),
    "office S6": (6.0, -9.0),
    "store": (11.3, -9.0),
    "office N1": (-9.5, 8.5),
    "office N2": (-5.5, 8.5),
    "office N3": (-1.5, 8.5),
    "director": (4.0, 8.6),
    "project room": (8.0, 8.0),
    "toilets S": (-17.7, -2.0),
    "toilets N": (-17.7, 2.0),
    "stairs": (-14.5, -2.0),
    "kitchen": (-6.0, -3.0),
    "meeting room B": (-10.0, 1.0),
    "cross corridor": (0.0, 0.0),
    "small meeting room": (2.0, -3.5),
    "copy room": (3.0, 2.0),
    "archive": (8.2, -3.7),
    "server room": (7.5, 2.0),
    "open-plan area": (14.0, 0.0),
    "meeting box": (25.0, 7.6),
}


@pytest.fixture(scope="module")
def worlds(checkout: Path) -> Path:
    return checkout / "worlds"


@pytest.fixture
def office(worlds: Path) -> Iterator[flatland.World]:
    with flatland.World.from_yaml(str(worlds / "office/world.yaml"), seed=1) as world:
        yield world


def test_the_maps_are_the_output_of_the_script(
    worlds: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(worlds))
    importlib.import_module("draw_office").main(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["office.png", "tables.png"]
    for path in tmp_path.iterdir():
        committed = cv2.imread(str(worlds / "office" / path.name), cv2.IMREAD_UNCHANGED)
        np.testing.assert_array_equal(cv2.imread(str(path), cv2.IMREAD_UNCHANGED), committed)


def room_for_disc(free: npt.NDArray[np.bool_], radius: float) -> tuple[int, npt.NDArray[np.int32]]:
    """Finds the connected regions of the map in which the center of a disc may be.

    Returns:
        The number of regions, and for each pixel the number of its region, 0 for none.
    """
    distance = cv2.distanceTransform(free.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    # The distance is that to the center of the nearest occupied pixel, not to its border.
    possible = (distance - 0.75) * 0.05 >= radius
    count, labels = cv2.connectedComponents(possible.astype(np.uint8), connectivity=4)
    return count - 1, labels


def read(worlds: Path, name: str) -> Image:
    image: Image = cv2.imread(str(worlds / "office" / name), cv2.IMREAD_GRAYSCALE)
    return image


def labels_of_rooms(labels: npt.NDArray[np.int32]) -> dict[str, int]:
    """Returns the number of the region of the place in each room."""
    return {
        name: int(labels[499 - int((y + 12.5) / 0.05), int((x + 30) / 0.05)])
        for name, (x, y) in ROOMS.items()
    }


def test_a_robot_of_30_cm_reaches_all_rooms(worlds: Path) -> None:
    count, labels = room_for_disc(read(worlds, "office.png") == 254, 0.3)
    assert count == 1  # one region, including the space under the tables
    assert [room for room, label in labels_of_rooms(labels).items() if label != 1] == []


def test_a_tall_robot_of_45_cm_reaches_all_rooms(worlds: Path) -> None:
    free = (read(worlds, "office.png") == 254) & (read(worlds, "tables.png") == 254)
    _, labels = room_for_disc(free, 0.45)
    corridor = labels_of_rooms(labels)["cross corridor"]
    assert corridor > 0
    assert [room for room, label in labels_of_rooms(labels).items() if label != corridor] == []


@pytest.mark.parametrize("world", ["office", "simple"])
def test_worlds_can_be_stepped_and_robots_are_free(worlds: Path, world: str) -> None:
    path = str(worlds / world / "world.yaml")
    with flatland.World.from_yaml(path, seed=1) as loaded:
        before = {model.name: model.bodies[0].pose for model in loaded.models}
        scan = loaded.output("/scan")
        loaded.step(100)
        assert not loaded.contacts
        for model in loaded.models:
            assert model.bodies[0].pose == pytest.approx(before[model.name], abs=1e-6)
        assert np.isfinite(scan.latest.ranges).any()


def test_the_robots_drive_and_scan(office: flatland.World) -> None:
    scan = office.output("/scan")
    tall_scan = office.output("/tricycle/scan")
    office.command("/cmd_vel").set(flatland.Twist(linear_x=0.5))
    office.command("/tricycle/cmd_vel").set(flatland.Twist(linear_x=0.5))
    office.step(400)
    x, y, _ = office.model("robot").body("base_link").pose
    assert x == pytest.approx(-3 + 0.5 * 2, abs=0.1)
    assert y == pytest.approx(-5.5, abs=1e-3)
    assert office.model("tricycle").body("base_link").pose[0] > -8 + 0.5
    assert scan.latest.ranges.shape == (1081,)
    assert scan.latest.frame_id == "laser"
    assert tall_scan.latest.frame_id == "tricycle_laser"
    # The corridor is 2 m wide.
    side = scan.latest.ranges[[180, 900]]  # 90 degrees to the right and to the left
    assert side.sum() == pytest.approx(2.0, abs=0.1)


def test_only_the_laser_of_the_tall_robot_detects_table_tops(office: flatland.World) -> None:
    # In front of the long table of the large meeting room.
    office.move_model("robot", (-16.5, 7.6, math.pi / 2))
    office.move_model("tricycle", (-15.5, 7.8, math.pi / 2))
    low, tall = office.output("/scan"), office.output("/tricycle/scan")
    office.step(100)
    table_front = 21.8 - 0.8 - 12.5
    ahead = low.latest.ranges[540]
    assert ahead > table_front + 1.6 - 7.6 - 0.15  # to the sideboard behind the table
    assert tall.latest.ranges[270] == pytest.approx(table_front - 7.8 - 0.15, abs=0.1)


def test_each_frame_has_one_parent(office: flatland.World) -> None:
    office.output("/scan")
    office.output("/tricycle/scan")
    office.step(100)
    parents = Counter(child for _, child in office.transforms)
    assert set(parents.values()) == {1}
    assert {("map", "odom"), ("odom", "base_link"), ("base_link", "laser")} <= set(
        office.transforms
    )
    assert ("map", "tricycle_base_link") in office.transforms
    roots = {parent for parent, _ in office.transforms} - set(parents)
    assert roots == {"map"}


def odometry_error(world: flatland.World) -> float:
    """Returns the distance between odometry and true position after 10 m [m]."""
    odometry, truth = world.output("/odometry/filtered"), world.output("/odometry/ground_truth")
    world.command("/cmd_vel").set(flatland.Twist(linear_x=0.5))
    world.step(4000)
    assert truth.latest.pose[0] > 6.5
    return math.dist(odometry.latest.pose[:2], truth.latest.pose[:2])


def test_a_localization_can_send_the_transform_to_map_and_correct_the_drift(
    office: flatland.World, worlds: Path
) -> None:
    assert odometry_error(office) == 0.0
    path = str(worlds / "office/world.yaml")
    with flatland.World.from_yaml(path, seed=1, params={"/map_to_odom": False}) as world:
        assert 0.01 < odometry_error(world) < 1.0
        assert ("map", "odom") not in world.transforms
        assert ("odom", "base_link") in world.transforms


@pytest.mark.parametrize("model", ["chair", "box", "door", "diff_robot", "tricycle"])
def test_models_can_be_spawned(office: flatland.World, model: str) -> None:
    office.spawn_model(f"{model}.model.yaml", "another", "another", (14.0, 0.0, 0.0))
    office.step(100)
    assert not office.contacts
    assert office.model("another").bodies[0].pose[:2] == pytest.approx((14.0, 0.0), abs=1e-5)


def test_a_pushed_chair_rolls_to_a_stop(office: flatland.World) -> None:
    office.spawn_model("chair.model.yaml", "chair", pose=(-1.5, -5.5, 0))
    drive = office.command("/cmd_vel")
    drive.set(flatland.Twist(linear_x=0.6))
    office.step(800)
    chair = office.model("chair").body("chair")
    assert chair.pose[0] > -0.5
    drive.set(flatland.Twist())
    office.step(2000)
    assert math.hypot(*chair.velocity[:2]) < 1e-3
