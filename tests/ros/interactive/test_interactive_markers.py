"""Interactive markers of a running node: messages to clients, and effects of their feedback."""

from __future__ import annotations

import math
import threading
import time
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
NAN = math.nan

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

    def __init__(self, ros: Any, name: str = "/rviz/Move Objects") -> None:
        self._ros = ros
        self._name = name
        self._publisher = ros.publisher(f"{SERVER}/feedback", InteractiveMarkerFeedback)

    def send(
        self,
        event: int,
        pose: tuple[float, float, float] | Pose = (1, 2, 0.5),
        *,
        marker: str = "rob",
        frame: str = "map",
        **fields: Any,
    ) -> None:
        """Publishes feedback."""
        feedback = InteractiveMarkerFeedback(
            client_id=self._name, marker_name=marker, event_type=event, control_name="move_xy"
        )
        feedback.header.frame_id = frame
        feedback.pose = pose if isinstance(pose, Pose) else pose_message(*pose)
        for name, value in fields.items():
            setattr(feedback, name, value)
        self._publisher.publish(feedback)

    def press(self, **options: Any) -> None:
        self.send(InteractiveMarkerFeedback.MOUSE_DOWN, **options)

    def drag(self, *pose: float, **options: Any) -> None:
        self.send(InteractiveMarkerFeedback.POSE_UPDATE, pose, **options)

    def release(self, *pose: float, **options: Any) -> None:
        self.send(InteractiveMarkerFeedback.MOUSE_UP, pose, **options)


class ContinuousDrag:
    """Context manager that publishes the pose of a drag 30 times per second, like RViz."""

    def __init__(self, client: Client, *pose: float, **options: Any) -> None:
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(client, pose, options))

    def _run(self, client: Client, pose: tuple[float, ...], options: dict[str, Any]) -> None:
        while not self._stop.is_set():
            client.drag(*pose, **options)
            self._stop.wait(0.033)

    def __enter__(self) -> None:
        self._thread.start()

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()


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


def full_state(ros: Any, namespace: str = "") -> dict[str, InteractiveMarker]:
    """Returns the markers received by a new client."""
    topic = ros.topic(f"{namespace}{SERVER}/update_full", InteractiveMarkerInit)
    message = topic.next()
    topic.close()  # Otherwise, rospy passes this message to the next subscriber, too.
    return {marker.name: marker for marker in message.markers}


def assert_moves_straight(truth: Any, pose: tuple[float, float, float]) -> None:
    """Checks that the model is at its initial pose until it is at another one."""
    is_there, is_at_start = moved(*pose), moved(1, 2, 0.5)
    message = truth.next()
    while not is_there(message):
        assert is_at_start(message), planar(message.pose.pose)
        message = truth.next()


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


def test_late_subscriber_receives_the_current_pose(ros: Any) -> None:
    full_state(ros)
    assert ros.move("rob", (-2, 0, 0)).success
    assert planar(full_state(ros)["rob"].pose) == pytest.approx((-2, 0, 0), abs=1e-5)
    ros.call("/pause", Empty)
    assert ros.move("rob", (2, 0, 0)).success
    assert planar(full_state(ros)["rob"].pose) == pytest.approx((2, 0, 0), abs=1e-5)


def test_sequence_numbers_of_updates_have_no_gaps(ros: Any) -> None:
    """RViz reinitializes when a number is missing, and initially waits for a matching state."""
    update = updates(ros)
    full = ros.topic(f"{SERVER}/update_full", InteractiveMarkerInit)
    numbers = [update.next().seq_num]  # of a keep-alive message
    for i in range(3):
        assert ros.move("rob", (i, 0, 0)).success
        numbers.append(update.until(lambda message: message.poses).seq_num)
    assert numbers == list(range(numbers[0], numbers[0] + 4))
    full.until(lambda message: message.seq_num == numbers[-1])


def test_keep_alive_messages_are_published_while_paused(ros: Any) -> None:
    before_the_first = time.monotonic()
    update = updates(ros)
    ros.call("/pause", Empty)
    update.until(lambda message: message.type == InteractiveMarkerUpdate.KEEP_ALIVE)
    messages = update.take(3)
    assert {message.type for message in messages} == {InteractiveMarkerUpdate.KEEP_ALIVE}
    # Half a second between two of them, however late they arrive, but for the one on connection.
    assert time.monotonic() - before_the_first > 2 * 0.5 - 0.1


# -- feedback ------------------------------------------------------------------------------


def test_drag_pauses_and_release_moves(client: Client, paused: Any, truth: Any) -> None:
    client.press()
    with ContinuousDrag(client, 0, -1, 1.5):
        paused.until(lambda message: message.data)
        client.release(-1, -2, 2.5)
    # Feedback after the release starts another drag, which times out.
    truth.until(moved(-1, -2, 2.5))
    twist = truth.next().twist.twist
    assert (twist.linear.x, twist.linear.y, twist.angular.z) == pytest.approx((0, 0, 0), abs=1e-6)
    paused.until(lambda message: not message.data)


def test_click_does_not_move_and_release_without_a_drag_does(client: Client, truth: Any) -> None:
    client.press()
    client.release(1, 2, 0.5)
    client.release(-2, -1, -0.5)
    # From the initial pose straight to the last one.
    assert_moves_straight(truth, (-2, -1, -0.5))


def test_model_does_not_move_during_a_drag(
    client: Client, ros: Any, paused: Any, truth: Any
) -> None:
    update = updates(ros)
    with ContinuousDrag(client, -3, -3, 1):
        # Other clients receive the pose of the drag.
        update.until(lambda m: m.poses and planar(m.poses[0].pose) == pytest.approx((-3, -3, 1)))
        paused.until(lambda message: message.data)
        assert planar(full_state(ros)["rob"].pose) == pytest.approx((-3, -3, 1))
    # The drag timed out without a release: the marker returns to the model.
    message = update.until(lambda m: m.poses and m.poses[0].pose.position.x > 0)
    assert planar(message.poses[0].pose) == pytest.approx((1, 2, 0.5), abs=1e-5)
    paused.until(lambda message: not message.data)
    client.release(-2, -1, -0.5)
    assert_moves_straight(truth, (-2, -1, -0.5))


def test_menu_deletes_the_model(client: Client, ros: Any) -> None:
    update = updates(ros)
    assert ros.spawn("robot.model.yaml", "victim", "victim").success
    update.until(lambda message: message.markers)
    entry = full_state(ros)["victim"].menu_entries[0].id
    client.send(InteractiveMarkerFeedback.MENU_SELECT, marker="victim", menu_entry_id=entry)
    assert update.until(lambda message: message.erases).erases == ["victim"]
    assert not ros.delete("victim").success
    assert set(full_state(ros)) == {"rob"}


def test_invalid_feedback_is_ignored(client: Client, ros: Any, truth: Any, server: Any) -> None:
    for pose in (pose_message(NAN, 0, 0), Pose(), pose_message(1e30, 0, 0)):
        for event in (
            InteractiveMarkerFeedback.MOUSE_DOWN,
            InteractiveMarkerFeedback.POSE_UPDATE,
            InteractiveMarkerFeedback.MOUSE_UP,
            InteractiveMarkerFeedback.KEEP_ALIVE,
            77,
        ):
            client.send(event, pose)
    client.press(marker="ghost")
    client.release(0, 0, 0, marker="ghost")
    client.send(InteractiveMarkerFeedback.MENU_SELECT, marker="ghost", menu_entry_id=1)
    client.send(InteractiveMarkerFeedback.MENU_SELECT, menu_entry_id=99)
    client.release(0, 0, 0, frame="base_link")
    server.wait_for_line('WARN.*"rob": ignoring a pose in frame "base_link"')
    client.release(1, 1, 1, frame="/map")
    assert_moves_straight(truth, (1, 1, 1))
    assert set(full_state(ros)) == {"rob"}
