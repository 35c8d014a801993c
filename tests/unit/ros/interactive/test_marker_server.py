"""Messages of the server of interactive markers, without connections."""

from __future__ import annotations

from concurrent.futures import Future
from io import BytesIO
from types import SimpleNamespace
from typing import Any

import pytest
from visualization_msgs.msg import (
    InteractiveMarker,
    InteractiveMarkerFeedback,
    InteractiveMarkerInit,
    InteractiveMarkerUpdate,
)

from flatland.node.handles import Event, Feedback
from flatland.node.values import ReceivedPose
from flatland.ros.interactive import marker_server
from flatland.ros.interactive.marker_server import (
    CONNECTING_TIME,
    FULL_STATE_PERIOD,
    MarkerServer,
)

Message = InteractiveMarkerInit | InteractiveMarkerUpdate


class NoRegistrar:
    """A registrar without a master: topics are never advertised."""

    def claim(self, *_arguments: object, **_options: object) -> None:
        pass

    def submit(self, _action: object) -> None:
        pass


def _handle(_model: object, name: str) -> InteractiveMarker:
    marker = InteractiveMarker(name=name, description=f"marker {name}", scale=2.0)
    marker.header.frame_id = "map"
    marker.pose.orientation.w = 1.0
    return marker


class Setup:
    """A server with clients, and what it publishes."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 100.0
        self.poses: dict[str, tuple[float, float, float]] = {}
        self.sent: list[Message] = []
        monkeypatch.setattr(marker_server.time, "monotonic", lambda: self.now)
        monkeypatch.setattr(marker_server, "model_handle", _handle)
        registrar: Any = NoRegistrar()
        source: Any = SimpleNamespace(
            pose_of=self.poses.__getitem__, connection_changed=lambda: None
        )
        self.server = MarkerServer(registrar, lambda _action: Future(), source)
        for topic, message_type in (
            (self.server._init, InteractiveMarkerInit),
            (self.server._update, InteractiveMarkerUpdate),
        ):
            monkeypatch.setattr(topic, "connected", True)
            monkeypatch.setattr(topic, "publish_serialized", self._recorder(message_type))

    def _recorder(self, message_type: type[Any]) -> Any:
        def record(data: bytes) -> None:
            message = message_type().deserialize(data)
            buffer = BytesIO()
            message.serialize(buffer)
            assert buffer.getvalue() == data
            self.sent.append(message)

        return record

    def insert(self, name: str, x: float = 0.0) -> None:
        self.poses[name] = (x, 0.0, 0.0)
        model: Any = None
        self.server.insert(model, name)

    def move(self, name: str, x: float) -> None:
        self.poses[name] = (x, 0.0, 0.0)
        self.server.move(name)

    def apply(self) -> list[Message]:
        """Applies the changes; returns what was published."""
        self.sent.clear()
        self.server.apply_changes()
        return list(self.sent)

    def keep_alive(self) -> list[Message]:
        self.sent.clear()
        self.server.keep_alive()
        return list(self.sent)


@pytest.fixture
def setup(monkeypatch: pytest.MonkeyPatch) -> Setup:
    setup = Setup(monkeypatch)
    setup.insert("a", 1.0)
    setup.insert("b", 2.0)
    setup.apply()
    return setup


def test_updates_contain_what_has_changed(setup: Setup) -> None:
    setup.insert("c", 3.0)
    setup.move("a", 4.0)
    setup.move("c", 5.0)
    update, full = setup.apply()
    assert (update.type, update.seq_num) == (InteractiveMarkerUpdate.UPDATE, 2)
    (marker,) = update.markers
    assert (marker.name, marker.description, marker.scale) == ("c", "marker c", 2.0)
    assert (marker.header.frame_id, marker.pose.position.x) == ("map", 5.0)
    (pose,) = update.poses
    assert (pose.name, pose.header.frame_id, pose.pose.position.x) == ("a", "map", 4.0)
    assert update.erases == []
    assert full.seq_num == 2
    assert {m.name: m.pose.position.x for m in full.markers} == {"a": 4.0, "b": 2.0, "c": 5.0}

    setup.server.erase("b")
    update, full = setup.apply()
    assert (update.seq_num, update.markers, update.poses) == (3, [], [])
    assert update.erases == ["b"]
    assert {marker.name for marker in full.markers} == {"a", "c"}
    assert setup.apply() == []


def test_a_name_that_is_used_again_is_replaced(setup: Setup) -> None:
    setup.server.erase("a")
    setup.insert("a", 7.0)
    update, _ = setup.apply()
    assert [marker.pose.position.x for marker in update.markers] == [7.0]
    assert update.erases == []


def test_an_erased_marker_has_no_pose(setup: Setup) -> None:
    setup.move("a", 4.0)
    setup.server.erase("a")
    del setup.poses["a"]
    update, _ = setup.apply()
    assert (update.poses, update.erases) == ([], ["a"])


def test_a_marker_that_was_never_published_is_not_erased(setup: Setup) -> None:
    setup.insert("short")
    setup.server.erase("short")
    assert setup.apply() == []


def test_new_clients_receive_the_full_state_after_each_update(setup: Setup) -> None:
    setup.server._connection_changed(True)
    for number in range(5):
        setup.now += 0.9 * CONNECTING_TIME / 5
        setup.move("a", float(number))
        update, full = setup.apply()
        assert full.seq_num == update.seq_num


def test_the_full_state_is_published_once_a_second_while_markers_move(setup: Setup) -> None:
    setup.now += CONNECTING_TIME + FULL_STATE_PERIOD
    full_states = 0
    for number in range(100):
        setup.now += 0.1 * FULL_STATE_PERIOD
        setup.move("a", float(number))
        update, *full = setup.apply()
        assert [pose.pose.position.x for pose in update.poses] == [number]
        full_states += len(full)
    assert 9 <= full_states <= 11


def test_the_last_poses_are_part_of_a_full_state(setup: Setup) -> None:
    setup.now += CONNECTING_TIME + FULL_STATE_PERIOD
    setup.move("a", 8.0)
    assert len(setup.apply()) == 2
    setup.move("a", 9.0)
    (update,) = setup.apply()
    full, alive = setup.keep_alive()
    assert full.seq_num == alive.seq_num == update.seq_num
    assert full.markers[0].pose.position.x == 9.0
    assert alive.type == InteractiveMarkerUpdate.KEEP_ALIVE
    (alive,) = setup.keep_alive()
    assert alive.poses == alive.markers == alive.erases == []


def test_new_and_erased_markers_are_always_part_of_a_full_state(setup: Setup) -> None:
    setup.now += CONNECTING_TIME
    setup.insert("c")
    assert len(setup.apply()) == 2
    setup.server.erase("c")
    assert len(setup.apply()) == 2


def test_feedback_is_passed_on_between_two_steps(
    setup: Setup, monkeypatch: pytest.MonkeyPatch
) -> None:
    actions: list[Any] = []
    received: list[Any] = []
    handles: Any = SimpleNamespace(receive=received.append)
    monkeypatch.setattr(setup.server, "_post", actions.append)
    monkeypatch.setattr(setup.server, "_handles", handles)
    message = InteractiveMarkerFeedback(
        marker_name="a",
        client_id="/rviz",
        event_type=InteractiveMarkerFeedback.POSE_UPDATE,
        menu_entry_id=3,
    )
    message.header.frame_id = "/map"
    message.pose.position.x = 2.0
    message.pose.orientation.w = 1.0
    setup.now = 123.0
    setup.server._receive_feedback(message)
    assert received == []
    actions.pop()()
    pose = ReceivedPose("map", (2.0, 0.0, 0.0))
    assert received == [Feedback("a", "/rviz", Event.MOVE, 3, pose, 123.0)]
    message.event_type = 200
    message.pose.orientation.w = 0.0
    setup.server._receive_feedback(message)
    actions.pop()()
    assert received[1] == Feedback("a", "/rviz", Event.OTHER, 3, ReceivedPose("map", None), 123.0)
