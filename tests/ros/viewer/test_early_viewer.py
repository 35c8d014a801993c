"""A viewer that starts before the simulator and keeps running after it has ended."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import rospy
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Empty

BLUE, RED = (0, 0, 255), (255, 70, 70)


@pytest.fixture
def elsewhere(room: Path) -> Path:
    """The room and the robot far from the origin, on a layer of another name."""
    (room.parent / "far.yaml").write_text(
        "type: line_segments\ndata: walls.dat\nscale: 1.0\norigin: [70, -40, 0]\n"
    )
    path = room.parent / "elsewhere.yaml"
    text = room.read_text().replace("name: 2d, map: map.yaml", "name: far, map: far.yaml")
    assert "far.yaml" in text
    path.write_text(text.replace("pose: [-2, 1, 0]", "pose: [68, -39, 0]"))
    return path


@pytest.fixture
def bare_master(ros: Any) -> Iterator[None]:
    """A ROS master without `/use_sim_time`."""
    ros.master.deleteParam("/use_sim_time")
    yield
    ros.master.setParam("/use_sim_time", True)


def test_simulator_is_started_killed_and_replaced(
    ros: Any,
    bare_master: None,
    early_viewer: Any,
    on_screen: Any,
    room: Path,
    elsewhere: Path,
    screenshot: Any,
) -> None:
    del bare_master
    viewer = early_viewer
    area = viewer.widget("rviz::RenderPanel")

    def assert_waits() -> None:
        viewer.until("rate", lambda widget: widget["text"] == "Waiting for the simulator")
        viewer.until("factor", lambda widget: widget["text"] == "")
        viewer.until("toggle_pause", lambda widget: widget["text"] == "Pause")
        viewer.until("rate_slider", lambda widget: not widget["enabled"])

    def is_simulated_time(widget: dict[str, Any]) -> bool:
        return 0.0 < float(widget["text"].split()[1]) < 1e6

    def fits(picture: Any) -> bool:
        return bool(picture.pixels_per_metre * 10 == pytest.approx(area["height"] / 1.06, abs=8))

    def assert_shows_room_and_robot(place: Callable[[Any], Any]) -> None:
        viewer.until("rate", lambda widget: widget["text"] == "200 Hz (x1)")
        viewer.until("time", is_simulated_time)
        screenshot(lambda picture: place(picture) and fits(picture), area)
        screenshot(lambda picture: len(picture.places(RED)) > 30, area)

    def robot_is_there(picture: Any) -> bool:
        return len(picture.near(BLUE, -2, 1, 0.6)) > 10

    assert_waits()
    first = on_screen.server(room, show_viz=True)
    assert_shows_room_and_robot(robot_is_there)
    ros.call("/pause", Empty)
    viewer.until("toggle_pause", lambda widget: widget["text"] == "Resume")
    # When the time jumps back, RViz clears all displays. Paused, the simulator sends no scans, but
    # the walls are latched.
    other_clock = rospy.Publisher("/clock", Clock, queue_size=1, latch=True)
    other_clock.publish(Clock(rospy.Time(nsecs=1)))
    viewer.until("time", lambda widget: widget["text"] == "Time: 0.00 s")
    screenshot(lambda picture: len(picture.places(RED)) == 0, area)
    other_clock.unregister()
    # A killed node stays registered with the master.
    first.send(signal.SIGKILL)
    first.wait()
    assert_waits()
    viewer.click("toggle_pause")
    message = viewer.until("qt_msgbox_label", lambda widget: widget["active"])
    assert "service" in message["text"]
    viewer.screen.key("Return")
    # Another simulator, with another world; nothing of the first one remains visible.
    on_screen.server(elsewhere, show_viz=True)
    assert_shows_room_and_robot(robot_is_there)
    assert viewer.process.running
