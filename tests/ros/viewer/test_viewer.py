"""The viewer of a running simulator: what it displays, and its response to mouse and keys."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rospy
from nav_msgs.msg import Odometry
from std_msgs.msg import Bool
from std_srvs.srv import Empty
from visualization_msgs.msg import MarkerArray
from waiting import wait_until

from flatland.msg import DebugTopicList
from flatland.srv import SetRate

DEBUG = "/flatland_server/debug"
BLUE, CYAN, RED, GREEN, LIGHT_BLUE, YELLOW = (
    *((0, 0, 255), (0, 255, 255), (255, 70, 70), (0, 255, 0)),
    *((80, 200, 255), (255, 217, 26)),
)
START = (-2.0, 1.0)
SLOW_MOTION = {f"Real-time factor: {factor}" for factor in ("0.04", "0.05", "0.06")}


@pytest.fixture
def panel(viewer: Any) -> Any:
    """The area of the 3-D view on the screen."""
    return viewer.widget("rviz::RenderPanel")


@pytest.fixture
def spawned(ros: Any) -> Any:
    """Returns a function that waits for a model; deletes all spawned models after the test."""
    listed = ros.topic(f"{DEBUG}/topics", DebugTopicList)

    def until(name: str) -> None:
        listed.until(lambda message: f"model/{name}" in message.topics)

    yield until
    ros.call("/resume", Empty)
    topics = ros.topic(f"{DEBUG}/topics", DebugTopicList).next().topics
    for topic in topics:
        if topic.startswith("model/") and topic != "model/robot":
            ros.delete(topic.removeprefix("model/"))


def choose(viewer: Any, screen: Any, path: Path, *, name: str = "", number: bool = False) -> None:
    """Fills in and accepts the spawn dialog."""
    viewer.click("spawn")
    viewer.fill_in("path", str(path))
    if name:
        viewer.fill_in("name", name)
    if viewer.widget("number")["checked"] != number:
        box = viewer.widget("number")
        screen.click(box["x"] + 8, box["y"] + box["height"] / 2)
        viewer.until("number", lambda widget: widget["checked"] == number)
    screen.key("Return")


def test_shows_walls_robot_and_scan(
    screenshot: Callable[..., Any], viewer: Any, panel: Any
) -> None:
    def shows_room_and_scan(picture: Any) -> bool:
        # The whole room is in view, as large as fits.
        assert picture.pixels_per_metre * 10 == pytest.approx(panel["height"] / 1.06, abs=8)
        assert picture.center == pytest.approx(
            (panel["x"] + panel["width"] / 2, panel["y"] + panel["height"] / 2), abs=2
        )
        scan = picture.places(RED)
        assert len(scan) > 30
        distance_to_wall = np.abs(np.abs(scan).max(axis=1) - 5.0)
        assert (distance_to_wall < 0.1).mean() > 0.9
        assert len(set(np.sign(scan[:, 0]))) == len(set(np.sign(scan[:, 1]))) == 2
        return True

    picture = screenshot(shows_room_and_scan, panel)
    # The background is dark grey, with a thin line every metre.
    (left, row), (right, _) = picture.at(0.5, 3.5), picture.at(4.5, 3.5)
    background = picture.image[int(row), int(left) : int(right)].max(axis=1).astype(int)
    assert np.median(background) == 48
    assert set(background) <= set(range(48, 80))
    lines = np.flatnonzero(np.diff((background > 50).astype(int)) > 0)
    assert len(lines) == 4
    assert np.diff(lines) == pytest.approx(picture.pixels_per_metre, abs=1.5)


def test_shows_the_robot_at_its_pose(
    screenshot: Callable[..., Any], viewer: Any, screen: Any, panel: Any
) -> None:
    # The handle covers the robot unless the Move camera tool is selected.
    screenshot(lambda picture: not len(picture.near(BLUE, *START, 0.15)), panel)
    viewer.click("move_camera")

    def shows_robot(picture: Any) -> bool:
        assert len(picture.near(BLUE, *START, 0.15)) > 20
        assert len(picture.near(BLUE, *START, 0.5)) > 200
        robot = picture.places(BLUE)
        assert robot.mean(axis=0) == pytest.approx(START, abs=0.05)
        assert np.hypot(*(robot - START).T).max() == pytest.approx(0.4, abs=0.08)
        return True

    screenshot(shows_robot, panel)
    viewer.click("interact")


def test_pause_and_resume(ros: Any, viewer: Any, screen: Any) -> None:
    paused = ros.topic("/flatland_server/paused", Bool)
    viewer.until("toggle_pause", lambda widget: widget["text"] == "Pause")
    viewer.until("factor", lambda widget: widget["text"].startswith("Real-time factor: "))
    viewer.click("toggle_pause")
    assert paused.until(lambda message: message.data)
    viewer.until("toggle_pause", lambda widget: widget["text"] == "Resume")
    viewer.until("factor", lambda widget: widget["text"] == "Paused")
    still = viewer.widget("time")["text"]
    screen.key("space")
    assert paused.until(lambda message: not message.data)
    viewer.until("toggle_pause", lambda widget: widget["text"] == "Pause")
    viewer.until("time", lambda widget: widget["text"] != still)
    # A pause by another client.
    ros.call("/pause", Empty)
    viewer.until("toggle_pause", lambda widget: widget["text"] == "Resume")
    ros.call("/resume", Empty)


def test_slider_sets_the_rate(
    ros: Any, viewer: Any, screen: Any, eventually: Callable[..., Any]
) -> None:
    def is_set(rate: float) -> bool:
        return bool(rospy.get_param("/flatland_server/update_rate", 200.0) == rate)

    viewer.until("rate", lambda widget: widget["text"] == "200 Hz (x1)")
    slider = viewer.widget("rate_slider")
    viewer.click("rate_slider")
    screen.key("Home")
    eventually("slow motion", lambda: is_set(10.0))
    viewer.until("rate", lambda widget: widget["text"] == "10 Hz (x0.05)")
    viewer.until("factor", lambda widget: widget["text"] in SLOW_MOTION)
    screen.key("End")
    eventually("no limit", lambda: is_set(0.0))
    viewer.until("rate", lambda widget: widget["text"] == "as fast as possible")
    # The length of the text beside the slider does not move it.
    assert viewer.widget("rate_slider")["x"] == slider["x"]
    # A rate set by another client.
    assert ros.call("/set_rate", SetRate, 200.0).success
    viewer.until("rate", lambda widget: widget["text"] == "200 Hz (x1)")


def test_two_clicks_spawn_a_model(
    ros: Any,
    screenshot: Callable[..., Any],
    viewer: Any,
    screen: Any,
    panel: Any,
    room: Path,
    spawned: Callable[[str], None],
) -> None:
    picture = screenshot(lambda picture: True, panel)
    choose(viewer, screen, room.parent / "crate.model.yaml")
    x, y = picture.at(2, -1)
    screen.move(x, y)

    # The preview is an outline at the mouse, with an arrow in the direction of the heading.
    def shows_outline_and_arrow(preview: Any) -> bool:
        assert len(preview.near(CYAN, 2, -1, 0.7)) > 50
        assert preview.near(YELLOW, 2.5, -1, 0.6).size
        assert not preview.near(YELLOW, 1.4, -1, 0.3).size
        return True

    screenshot(shows_outline_and_arrow, panel)
    # The handles are hidden, so that they do not receive the clicks.
    screenshot(lambda picture: len(picture.near(BLUE, *START, 0.15)) > 20, panel)
    screen.click(x, y)
    screen.move(*picture.at(2, 2))
    screenshot(lambda picture: picture.near(YELLOW, 2, -0.4, 0.2).size, panel)
    screen.click(*picture.at(2, 2))
    spawned("crate_model")
    (marker,) = ros.topic(f"{DEBUG}/model/crate_model", MarkerArray).next().markers
    assert (marker.pose.position.x, marker.pose.position.y) == pytest.approx((2, -1), abs=0.05)
    yaw = 2 * math.atan2(marker.pose.orientation.z, marker.pose.orientation.w)
    assert yaw == pytest.approx(math.pi / 2, abs=0.05)

    # The model is displayed at its pose, and the preview is hidden.
    def shows_crate(picture: Any) -> bool:
        crate = picture.near(CYAN, 2, -1, 0.8)
        assert len(crate) > 50
        assert not len(picture.places(YELLOW))
        assert crate.max(axis=0) == pytest.approx((2.25, -0.5), abs=0.07)
        assert crate.min(axis=0) == pytest.approx((1.75, -1.5), abs=0.07)
        return True

    screenshot(shows_crate, panel)
    # A deleted model disappears.
    assert ros.delete("crate_model").success
    screenshot(lambda picture: not len(picture.near(CYAN, 2, -1, 0.8)), panel)


def test_model_name_is_the_namespace_and_can_be_numbered(
    ros: Any,
    screenshot: Callable[..., Any],
    viewer: Any,
    screen: Any,
    panel: Any,
    room: Path,
    spawned: Callable[[str], None],
) -> None:
    picture = screenshot(lambda picture: True, panel)
    for count, x in ((1, 0.0), (2, 3.0)):
        choose(viewer, screen, room.parent / "robot.model.yaml", number=True)
        screen.move(*picture.at(x, -3))
        screenshot(lambda picture, x=x: len(picture.near(YELLOW, x + 0.5, -3, 0.6)), panel)
        screen.click(*picture.at(x, -3))
        screen.click(*picture.at(x, -3))
        spawned(f"robot_model{count}")
    scans = {"/robot_model1/scan", "/robot_model2/scan"}
    wait_until("their topics", lambda: scans <= ros.registered()["publishers"])
    # Each laser has a different colour.
    screenshot(
        lambda picture: len(picture.places(LIGHT_BLUE)) > 30 and len(picture.places(RED)) > 30,
        panel,
    )
    # The points of a laser disappear with its model.
    assert ros.delete("robot_model1").success
    screenshot(
        lambda picture: not (np.abs(picture.places(LIGHT_BLUE)).max(axis=1) > 4.8).any(),
        panel,
    )


def test_relative_path_and_custom_name(
    ros: Any,
    screenshot: Callable[..., Any],
    viewer: Any,
    screen: Any,
    panel: Any,
    spawned: Callable[[str], None],
) -> None:
    picture = screenshot(lambda picture: True, panel)
    # Relative to the folder of the world file, as for the service spawn_model.
    choose(viewer, screen, Path("crate.model.yaml"), name="parcel", number=True)
    screen.move(*picture.at(2, 2))
    screenshot(lambda picture: len(picture.places(YELLOW)), panel)
    screen.click(*picture.at(2, 2))
    screen.click(*picture.at(2, 2))
    spawned("parcel1")
    # The dialog suggests the next free number.
    viewer.click("spawn")
    viewer.until("name", lambda widget: widget["text"] == "parcel2")
    ros.spawn("crate.model.yaml", "parcel2", pose=(-3, -3, 0))
    viewer.until("name", lambda widget: widget["text"] == "parcel3")
    box = viewer.widget("number")
    screen.click(box["x"] + 8, box["y"] + box["height"] / 2)
    viewer.until("name", lambda widget: widget["text"] == "parcel")
    screen.key("Escape")
    viewer.until("interact", lambda widget: widget["checked"])


def test_file_dialog_sets_the_path(viewer: Any, screen: Any, room: Path) -> None:
    path = str(room.parent / "crate.model.yaml")
    viewer.click("spawn")
    viewer.click("browse")
    viewer.widget("QFileDialog")
    viewer.fill_in("fileNameEdit", path)
    screen.key("Return")
    viewer.until("path", lambda widget: widget["text"] == path)
    viewer.click("path")  # Without a window manager, a click gives a dialog the focus.
    viewer.until("path", lambda widget: widget["focus"])
    screen.key("Escape")
    viewer.until("interact", lambda widget: widget["checked"])


def test_menu_deletes_a_model(
    ros: Any,
    screenshot: Callable[..., Any],
    viewer: Any,
    screen: Any,
    panel: Any,
    eventually: Callable[..., Any],
) -> None:
    topics = ros.topic(f"{DEBUG}/topics", DebugTopicList)
    assert ros.spawn("crate.model.yaml", "crate", "", (2, -2, 0)).success
    picture = screenshot(lambda picture: len(picture.near(GREEN, 2, -2, 0.4)) > 50, panel)

    def menu() -> Any:
        # RViz picks the object below the mouse once per frame, and misses a shorter click.
        screen.move(*picture.at(2.1, -2))
        screen.move(*picture.at(2, -2))
        screenshot(lambda picture: True, panel)
        screen.press(3)
        screenshot(lambda picture: True, panel)
        screen.release(3)
        screenshot(lambda picture: True, panel)
        return viewer.widgets("QMenu")

    (area,) = eventually("menu", menu)
    screen.click(area["x"] + 30, area["y"] + area["height"] / 2)
    topics.until(lambda message: "model/crate" not in message.topics)
    screenshot(lambda picture: not len(picture.near(CYAN, 2, -2, 0.8)), panel)


def test_view_fits_the_window_until_the_camera_is_moved(
    screenshot: Callable[..., Any], viewer: Any, screen: Any, panel: Any
) -> None:
    def resize(width: int, height: int) -> Any:
        screen.resize("flatland", width, height)
        # The tool bar and the status line keep their heights.
        below = height - 800 + panel["height"]
        return viewer.until(
            "rviz::RenderPanel",
            lambda widget: (widget["width"], widget["height"]) == (width, below),
        )

    def fits(area: Any) -> Callable[[Any], bool]:
        wanted = area["height"] / 10.6
        return lambda picture: abs(picture.pixels_per_metre - wanted) < 0.8

    viewer.click("zoom_to_fit")
    screenshot(fits(panel), panel)
    small = resize(1000, 500)
    picture = screenshot(fits(small), small)
    screen.click(*picture.at(3, 3), button=5)
    zoomed = screenshot(lambda seen: seen.pixels_per_metre < 0.98 * picture.pixels_per_metre, small)
    area = resize(1200, 800)
    screenshot(lambda seen: abs(seen.pixels_per_metre - zoomed.pixels_per_metre) < 0.2, area)
    viewer.click("zoom_to_fit")
    screenshot(fits(area), area)


def test_view_includes_models_outside_the_walls(
    ros: Any, screenshot: Callable[..., Any], viewer: Any, screen: Any, panel: Any, spawned: Any
) -> None:
    def shows(metres: float, pixels: int) -> Callable[[Any], bool]:
        wanted = pixels / (1.06 * metres)
        return lambda picture: abs(picture.pixels_per_metre - wanted) < 0.5

    viewer.click("zoom_to_fit")
    screenshot(shows(10.0, panel["height"]), panel)
    # The view extends from the wall at x = -5 to the end of the crate.
    assert ros.spawn("crate.model.yaml", "far", "", (20, 0, 0)).success
    spawned("far")
    shows_all = shows(25.5, panel["width"])
    screenshot(
        lambda picture: shows_all(picture) and len(picture.near(CYAN, 20, 0, 0.7)) > 10, panel
    )
    assert ros.move("far", (25, 0, 0)).success
    screen.key("f")
    screenshot(shows(30.5, panel["width"]), panel)
    assert ros.delete("far").success
    screenshot(shows(10.0, panel["height"]), panel)


def test_model_is_below_the_mouse_in_a_rotated_view(
    screenshot: Callable[..., Any], viewer: Any, screen: Any, panel: Any, room: Path
) -> None:
    viewer.click("zoom_to_fit")
    x, y = panel["x"] + panel["width"] / 2, panel["y"] + panel["height"] / 2
    straight = screenshot(lambda picture: True, panel)
    for _ in range(4):
        screen.click(x, y, button=5)
        # RViz must apply each zoom step before the next one.
        nearer = straight.pixels_per_metre
        straight = screenshot(
            lambda seen, nearer=nearer: seen.pixels_per_metre < 0.95 * nearer, panel
        )
    assert straight.pixels_per_metre * 10 < 0.8 * panel["height"]
    screen.move(x + 150, y + 100)
    screen.press()
    for step in range(1, 6):
        screen.move(x + 150 + 20 * step, y + 100)
    screen.release()
    # The bounding box of a rotated square is larger.
    screenshot(lambda picture: picture.pixels_per_metre > 1.2 * straight.pixels_per_metre, panel)
    choose(viewer, screen, room.parent / "crate.model.yaml")
    for mouse in ((x + 120, y + 60), (x - 40, y + 130)):
        screen.move(*mouse)

        def is_below_the_mouse(picture: Any, mouse: tuple[float, float] = mouse) -> bool:
            rows, columns = picture.pixels(CYAN)
            return len(rows) > 30 and math.dist((columns.mean(), rows.mean()), mouse) < 6

        screenshot(is_below_the_mouse, panel)
    screen.key("Escape")
    viewer.click("zoom_to_fit")
    screenshot(lambda picture: abs(picture.pixels_per_metre * 10.6 - panel["height"]) < 8, panel)


def test_escape_cancels(
    screenshot: Callable[..., Any],
    viewer: Any,
    screen: Any,
    panel: Any,
    room: Path,
    eventually: Callable[..., Any],
) -> None:
    picture = screenshot(lambda picture: True, panel)
    choose(viewer, screen, room.parent / "crate.model.yaml")
    x, y = picture.at(2, -1)
    screen.click(x, y)
    screenshot(lambda picture: len(picture.places(YELLOW)), panel)
    # The camera can still be moved.
    screen.press(2)
    for step in range(1, 6):
        screen.move(x + 20 * step, y)
    screen.release(2)
    screenshot(lambda seen: abs(seen.center[0] - picture.center[0] - 100) < 8, panel)
    viewer.click("zoom_to_fit")
    screenshot(lambda seen: abs(seen.center[0] - picture.center[0]) < 2, panel)
    screen.key("Escape")
    screenshot(lambda picture: not len(picture.places(YELLOW)), panel)
    viewer.until("interact", lambda widget: widget["checked"])
    viewer.until("spawn", lambda widget: not widget["checked"])
    # Escape closes the dialog as well.
    viewer.click("spawn")
    viewer.until("path", lambda widget: widget["active"])
    screen.key("Escape")
    viewer.until("interact", lambda widget: widget["checked"])
    eventually("end of the dialog", lambda: not viewer.widgets("path"))


def test_errors_are_shown_in_dialogs(
    screenshot: Callable[..., Any], viewer: Any, screen: Any, panel: Any, room: Path, spawned: Any
) -> None:
    choose(viewer, screen, room.parent / "nothing.yaml")
    label = viewer.until(
        "qt_msgbox_label", lambda widget: "nothing.yaml" in widget["text"] and widget["active"]
    )
    assert label["text"].startswith("Flatland YAML: ")
    screen.key("Return")
    # The service reports an error: the name is already in use.
    renamed = room.parent / "robot.yaml"
    renamed.write_text((room.parent / "robot.model.yaml").read_text())
    picture = screenshot(lambda picture: True, panel)
    choose(viewer, screen, renamed)
    screen.move(*picture.at(2, 2))
    screenshot(lambda picture: len(picture.places(YELLOW)), panel)
    screen.click(*picture.at(2, 2))
    screen.click(*picture.at(2, 2))
    label = viewer.until(
        "qt_msgbox_label", lambda widget: "nothing.yaml" not in widget["text"] and widget["active"]
    )
    assert label["text"] == 'Flatland YAML: Model with name "robot" already exists'
    screen.key("Return")


def test_dragged_robot_moves(
    ros: Any,
    screenshot: Callable[..., Any],
    viewer: Any,
    screen: Any,
    panel: Any,
    eventually: Callable[..., Any],
) -> None:
    truth = ros.topic("/odometry/ground_truth", Odometry)
    paused = ros.topic("/flatland_server/paused", Bool)
    assert not paused.next().data

    def drags() -> bool:
        viewer.click("zoom_to_fit")
        # The handle covers the robot.
        picture = screenshot(lambda picture: not len(picture.near(BLUE, *START, 0.15)), panel)
        screen.move(*picture.at(START[0] + 0.1, START[1]))
        screen.move(*picture.at(*START))
        screenshot(lambda picture: True, panel)
        screen.press()
        for step in range(1, 11):
            screen.move(*picture.at(START[0] + 0.3 * step, START[1] - 0.2 * step))
        if any(message.data for message in paused.rest(1.0)):
            return True
        # RViz has not yet found the handle below the mouse, and has moved the camera.
        screen.release()
        return False

    eventually("a drag", drags)
    screen.release()

    def is_there(message: Odometry) -> bool:
        position = message.pose.pose.position
        return bool((position.x, position.y) == pytest.approx((1, -1), abs=0.1))

    truth.until(is_there)
    viewer.until("toggle_pause", lambda widget: widget["text"] == "Pause")
    assert ros.move("robot", (*START, 0.0)).success


def test_quit_leaves_the_simulator_running(
    viewer: Any, screen: Any, panel: Any, room_server: Any, eventually: Callable[..., Any]
) -> None:
    def has_ended() -> bool:
        # Without a window manager, a click gives the window the keyboard focus.
        screen.click(panel["x"] + 10, panel["y"] + 10)
        screen.key("ctrl+q")
        return not viewer.process.running

    eventually("end of the viewer", has_ended, poll_period=1.0)
    assert viewer.process.wait() == 0
    assert "Traceback" not in viewer.process.output
    assert room_server.running
