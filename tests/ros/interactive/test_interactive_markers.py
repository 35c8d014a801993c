"""Interactive markers of a running node: messages to clients, and effects of their feedback."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Point, Pose, Quaternion
from nav_msgs.msg import Odometry
from std_msgs.msg import Bool
from std_srvs.srv import Empty
from visualization_msgs.msg import (
    InteractiveMarker,
    InteractiveMarkerControl,
    InteractiveMarkerFeedback,
    InteractiveMarkerInit,
    InteractiveMarkerUpdate,
    Marker,
)

SERVER = "/interactive_model_markers"

DRIVER = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins: [{type: DiffDrive, name: drive, body: base, pub_rate: 50}]
"""


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    return write_world("[{name: rob, model: driver.model.yaml, pose: [1, 2, 0.5]}]", driver=DRIVER)


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, world: Path) -> Any:
    return module_launcher.server(world)


@pytest.fixture(autouse=True)
def restore(ros: Any, server: Any) -> Iterator[None]:
    """Restores the initial state: one model, at rest at (1, 2), in a running world."""
    yield
    ros.call("/resume", Empty)
    assert ros.move("rob", (1, 2, 0.5)).success
    assert "Traceback" not in server.output


def pose_message(x: float, y: float, theta: float) -> Pose:
    return Pose(Point(x, y, 0), Quaternion(0, 0, math.sin(theta / 2), math.cos(theta / 2)))


def planar(pose: Pose) -> tuple[float, float, float]:
    return (
        pose.position.x,
        pose.position.y,
        2 * math.atan2(pose.orientation.z, pose.orientation.w),
    )


class Client:
    """Publishes feedback like RViz."""

    def __init__(self, ros: Any) -> None:
        self._publisher = ros.publisher(f"{SERVER}/feedback", InteractiveMarkerFeedback)

    def send(
        self,
        event: int,
        pose: tuple[float, float, float] = (1, 2, 0.5),
        marker: str = "rob",
        menu_entry: int = 0,
    ) -> None:
        """Publishes feedback."""
        feedback = InteractiveMarkerFeedback(
            client_id="/rviz/Move Objects",
            marker_name=marker,
            event_type=event,
            control_name="move_xy",
            menu_entry_id=menu_entry,
            pose=pose_message(*pose),
        )
        feedback.header.frame_id = "map"
        self._publisher.publish(feedback)


@pytest.fixture
def client(ros: Any) -> Client:
    return Client(ros)


@pytest.fixture
def paused(ros: Any) -> Any:
    """Whether the world is paused."""
    return ros.topic("/flatland_server/paused", Bool)


@pytest.fixture
def truth(ros: Any) -> Any:
    """Ground truth of the pose and the twist of the model."""
    return ros.topic("/odometry/ground_truth", Odometry)


def updates(ros: Any) -> Any:
    """Subscribes to updates; further ones are received as soon as there is a first one."""
    topic = ros.topic(f"{SERVER}/update", InteractiveMarkerUpdate)
    topic.next()
    return topic


def full_state(ros: Any) -> dict[str, InteractiveMarker]:
    """Returns the markers received by a new client."""
    topic = ros.topic(f"{SERVER}/update_full", InteractiveMarkerInit)
    message = topic.next()
    topic.close()  # Otherwise, rospy passes this message to the next subscriber, too.
    return {marker.name: marker for marker in message.markers}


def moved(x: float, y: float, theta: float) -> Callable[[Odometry], bool]:
    return lambda message: planar(message.pose.pose) == pytest.approx((x, y, theta), abs=1e-5)


# -- the markers ---------------------------------------------------------------------------


def test_fields_of_a_marker(ros: Any) -> None:
    ros.wait_until_ready()
    types = ros.types()
    assert types[f"{SERVER}/update"] == "visualization_msgs/InteractiveMarkerUpdate"
    assert types[f"{SERVER}/update_full"] == "visualization_msgs/InteractiveMarkerInit"
    assert types[f"{SERVER}/feedback"] == "visualization_msgs/InteractiveMarkerFeedback"
    message = ros.topic(f"{SERVER}/update_full", InteractiveMarkerInit).next()
    assert message.server_id == "/flatland_server"
    assert message._connection_header["latching"] == "1"
    (marker,) = message.markers
    assert marker.name == "rob"
    assert marker.header.frame_id == "map"
    # With a stamp, RViz would send poses in its fixed frame.
    assert marker.header.stamp.to_nsec() == 0
    assert planar(marker.pose) == pytest.approx((1, 2, 0.5), abs=1e-5)
    move, rotate, rest = marker.controls
    assert (move.name, move.interaction_mode) == ("move_xy", InteractiveMarkerControl.MOVE_PLANE)
    assert (rotate.name, rotate.interaction_mode) == (
        "rotate_z",
        InteractiveMarkerControl.ROTATE_AXIS,
    )
    for control in (move, rotate):  # The x axis of the rotated control is vertical.
        q = control.orientation
        assert (q.x, q.y, q.z, q.w) == pytest.approx((0, math.sqrt(0.5), 0, math.sqrt(0.5)))
    (box,) = move.markers
    assert box.type == Marker.CUBE
    assert (box.scale.x, box.scale.y, box.scale.z) == (0.5, 0.5, 0.05)
    assert (box.color.r, box.color.g, box.color.b) == (0, 1, 0)
    assert 0 < box.color.a < 1
    assert rest.interaction_mode == InteractiveMarkerControl.NONE
    text, outline = rest.markers
    assert (text.type, text.text) == (Marker.TEXT_VIEW_FACING, "rob")
    assert math.hypot(text.pose.position.x, text.pose.position.y) == 0.5
    assert text.color.a == 1
    assert outline.type == Marker.LINE_LIST
    assert {round(math.hypot(p.x, p.y), 6) for p in outline.points} == {0.2}
    (entry,) = marker.menu_entries
    assert (entry.title, entry.parent_id) == ("Delete Model", 0)
    assert entry.command_type == entry.FEEDBACK


def test_models_are_added_moved_and_deleted(ros: Any) -> None:
    update = updates(ros)
    assert ros.spawn("ball.model.yaml", "ball", "", (-1, -2, 0)).success
    message = update.until(lambda message: message.markers)
    (marker,) = message.markers
    assert marker.name == "ball"
    assert planar(marker.pose) == pytest.approx((-1, -2, 0))
    assert set(full_state(ros)) == {"rob", "ball"}

    assert ros.move("ball", (-2, 2, 1)).success
    message = update.until(lambda message: message.poses)
    (pose,) = message.poses
    assert (pose.name, pose.header.frame_id) == ("ball", "map")
    assert planar(pose.pose) == pytest.approx((-2, 2, 1), abs=1e-5)
    assert planar(full_state(ros)["ball"].pose) == pytest.approx((-2, 2, 1), abs=1e-5)

    assert ros.delete("ball").success
    assert update.until(lambda message: message.erases).erases == ["ball"]
    assert set(full_state(ros)) == {"rob"}


# -- feedback ------------------------------------------------------------------------------


def test_drag_pauses_and_release_moves(client: Client, ros: Any, paused: Any, truth: Any) -> None:
    update = updates(ros)
    client.send(InteractiveMarkerFeedback.MOUSE_DOWN, (1, 2, 0.5))
    client.send(InteractiveMarkerFeedback.POSE_UPDATE, (0, -1, 1.5))
    paused.until(lambda message: message.data)
    # Without a release, the drag ends, and the marker returns to the model.
    update.until(lambda m: m.poses and planar(m.poses[0].pose) == pytest.approx((1, 2, 0.5)))
    paused.until(lambda message: not message.data)
    client.send(InteractiveMarkerFeedback.MOUSE_UP, (-1, -2, 2.5))
    # From the initial pose straight to the last one.
    while not moved(-1, -2, 2.5)(message := truth.next()):
        assert moved(1, 2, 0.5)(message), planar(message.pose.pose)


def test_menu_deletes_the_model(client: Client, ros: Any) -> None:
    update = updates(ros)
    assert ros.spawn("robot.model.yaml", "victim", "victim").success
    update.until(lambda message: message.markers)
    entry = full_state(ros)["victim"].menu_entries[0].id
    client.send(InteractiveMarkerFeedback.MENU_SELECT, marker="victim", menu_entry=entry)
    assert update.until(lambda message: message.erases).erases == ["victim"]
    assert not ros.delete("victim").success
    assert set(full_state(ros)) == {"rob"}
