"""Topics of other nodes, with a transport and a graph of the test, and real messages."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest

pytest.importorskip("rospy", reason="ROS is not installed")

from geometry_msgs.msg import Point, PoseStamped, PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import OccupancyGrid, Path
from std_msgs.msg import Float64
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker

from flatland.errors import FlatlandError
from flatland.geometry import quaternion_from_yaw
from flatland.node.foreign_topics import pose_publisher, topics
from flatland.node.foreign_topics.subscriptions import TopicSubscription
from flatland.node.foreign_topics.topics import RosTopics
from flatland.node.values import FrameParents
from flatland.ros.adapters.writer import RosWriter
from flatland.values import Transform
from flatland.web.foreign_topics import Grid, Marks, Topic, TopicDemand, TopicUpdate

SECOND = 10**9
TYPES = {
    "nav_msgs/Path": Path,
    "nav_msgs/OccupancyGrid": OccupancyGrid,
    "map_msgs/OccupancyGridUpdate": SimpleNamespace,
    "visualization_msgs/Marker": Marker,
    "std_msgs/Float64": Float64,
    "geometry_msgs/PoseStamped": PoseStamped,
    "geometry_msgs/PoseWithCovarianceStamped": PoseWithCovarianceStamped,
}


class Clock:
    """The time of the modules under test, which passes while they sleep."""

    def __init__(self) -> None:
        self.now = 1000.0
        self.sleeps = 0
        self.on_sleep: Callable[[], None] = lambda: None

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds
        self.sleeps += 1
        self.on_sleep()


class Graph:
    """The topics of all nodes."""

    pose_topics: ClassVar[Mapping[Any, str]] = {"goal": "goal", "initial_pose": "initialpose"}

    def __init__(self) -> None:
        self.published: dict[str, str] = {}
        self.subscribed: dict[str, tuple[str, frozenset[str]]] = {}
        self.refreshed = 0
        self.time_ns = 5 * SECOND
        self.classes: dict[str, list[type[Any]]] = {kind: [each] for kind, each in TYPES.items()}

    def refresh(self) -> None:
        self.refreshed += 1

    def message_classes(self, kind: str) -> list[type[Any]]:
        return self.classes.get(kind, [])

    def now(self) -> int:
        return self.time_ns


class Endpoint:
    """A subscriber, or a publisher with its messages."""

    def __init__(self, topic: str, message_type: type[Any], callback: Any = None) -> None:
        self.topic = topic
        self.message_type = message_type
        self.receive = callback
        self.closed = False
        self.connections = 0
        self.sent: list[bytes] = []

    def publish(self, message: bytes) -> None:
        self.sent.append(message)

    def close(self) -> None:
        self.closed = True


class Transport:
    """Records the endpoints.

    Attributes:
        refused: Message classes to which nothing can subscribe.
    """

    node_name = "/node"

    def __init__(self) -> None:
        self.opened: list[Endpoint] = []
        self.refused: set[type[Any]] = set()

    def subscribe(self, topic: str, kind: type[Any], callback: Any, *, gives_way: bool) -> Any:
        assert gives_way
        if kind in self.refused:
            raise FlatlandError(f"{topic} has another type than {kind.__name__}")
        self.opened.append(Endpoint(topic, kind, callback))
        return self.opened[-1]

    def advertise(self, topic: str, kind: type[Any], *, gives_way: bool) -> Any:
        assert gives_way
        self.opened.append(Endpoint(topic, kind))
        return self.opened[-1]

    def receivable(self, value_type: type[Any]) -> tuple[type[Any], Any]:
        assert value_type is FrameParents
        return TFMessage, None

    def message_class(self, name: str) -> type[Any]:
        return TYPES[name]

    def resolve(self, name: str) -> str:
        return f"/ns/{name}"

    def writer(self) -> RosWriter:
        return RosWriter()

    def open(self) -> list[str]:
        """Returns the topics of the endpoints that are open."""
        return [each.topic for each in self.opened if not each.closed]

    def last(self, topic: str) -> Endpoint:
        return next(each for each in reversed(self.opened) if each.topic == topic)


class Simulation:
    """A simulation whose world has the transforms of the test.

    Attributes:
        error: Raised instead of a response, None for no error.
        limits: Times for which responses were awaited [s].
    """

    def __init__(self) -> None:
        self.world = SimpleNamespace(transforms={})
        self.error: Exception | None = None
        self.limits: list[float] = []

    def post(self, action: Callable[[], Any]) -> Any:
        def result(timeout: float) -> Any:
            self.limits.append(timeout)
            if self.error is not None:
                raise self.error
            return action()

        return SimpleNamespace(result=result)


class Setup:
    """The topics of other nodes."""

    def __init__(self) -> None:
        self.clock = Clock()
        self.graph, self.transport, self.simulation = Graph(), Transport(), Simulation()
        self.topics = RosTopics(self.transport, self.graph, self.simulation)  # type: ignore[arg-type]

    def update(self, drawn: str = "", inspected: str = "") -> TopicUpdate:
        """Updates with names of topics that are separated by spaces."""
        return self.topics.update(
            TopicDemand(frozenset(drawn.split()), frozenset(inspected.split()))
        )

    def status(self, drawn: str) -> str:
        """Updates with one topic that is drawn, and returns its status."""
        [topic] = [each for each in self.update(drawn).topics if each.name == drawn]
        return topic.status

    def receive(self, topic: str, message: Any) -> None:
        self.transport.last(topic).receive(message)


@pytest.fixture
def setup(monkeypatch: pytest.MonkeyPatch) -> Setup:
    setup = Setup()
    monkeypatch.setattr(topics, "time", setup.clock)
    monkeypatch.setattr(pose_publisher, "time", setup.clock)
    return setup


def path(*xs: float, frame: str = "map") -> Path:
    message = Path()
    message.header.frame_id = frame
    for x in xs:
        each = PoseStamped()
        each.pose.position.x = x
        each.pose.orientation.w = 1.0
        message.poses.append(each)
    return message


def grid(*cells: int) -> OccupancyGrid:
    message = OccupancyGrid(data=cells)
    message.header.frame_id = "map"
    message.info.width, message.info.height, message.info.resolution = len(cells), 1, 0.5
    message.info.origin.orientation.w = 1.0
    return message


def transform(parent: str, child: str, x: float = 0.0) -> TFMessage:
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id = parent
    message.transform.translation.x = x
    message.transform.rotation.w = 1.0
    return TFMessage([message])


def xs(drawing: Any) -> list[float]:
    assert isinstance(drawing, Marks)
    return sorted({round(float(x), 5) for line in drawing.lines for x in line[[0, 2]]})


def test_subscriptions_are_those_that_clients_demand(setup: Setup) -> None:
    setup.graph.published = {"/plan": "nav_msgs/Path", "/value": "std_msgs/Float64"}
    setup.update()
    assert setup.transport.open() == []
    setup.update(inspected="/value /plan")
    assert sorted(setup.transport.open()) == ["/plan", "/value"]
    opened = len(setup.transport.opened)
    setup.update(inspected="/value /plan")
    assert len(setup.transport.opened) == opened
    # A topic that is drawn needs transforms.
    setup.update(drawn="/plan", inspected="/value")
    assert sorted(setup.transport.open()) == ["/plan", "/tf", "/tf_static", "/value"]
    opened = len(setup.transport.opened)
    setup.update(drawn="/plan", inspected="/plan /value")
    assert len(setup.transport.opened) == opened
    setup.update(drawn="/value")
    assert setup.transport.open() == ["/value"]
    setup.update(drawn="/plan")
    setup.topics.suspend()
    assert setup.transport.open() == []
    assert setup.graph.refreshed == 7
    setup.update(drawn="/plan")
    assert sorted(setup.transport.open()) == ["/plan", "/tf", "/tf_static"]
    setup.topics.close()
    assert setup.transport.open() == []
    after = setup.update(drawn="/plan")
    assert (after.topics, after.pose_topics, after.drawings, after.values) == ((), {}, {}, {})
    assert setup.transport.open() == []


def test_topics_are_listed_with_their_status(setup: Setup) -> None:
    setup.graph.published = {
        "/plan": "nav_msgs/Path",
        "/map": "nav_msgs/OccupancyGrid",
        "/value": "std_msgs/Float64",
        "/other": "no_msgs/Thing",
    }
    assert setup.update(drawn="/plan /gone", inspected="/other /late").topics == [
        Topic("/plan", "nav_msgs/Path", "marks", "no message received"),
        Topic("/map", "nav_msgs/OccupancyGrid", "grid", ""),
        Topic("/value", "std_msgs/Float64", "", ""),
        Topic(
            "/other", "no_msgs/Thing", "", "the message package of no_msgs/Thing is not installed"
        ),
        Topic("/gone", "", "", "no publisher"),
        Topic("/late", "", "", "no publisher"),
    ]
    setup.receive("/plan", path(1.0, 2.0))
    del setup.graph.published["/plan"]
    update = setup.update(drawn="/plan")
    assert Topic("/plan", "nav_msgs/Path", "marks", "no publisher") in update.topics
    assert xs(update.drawings["/plan"]) == [1.0, 2.0]


def test_a_topic_with_another_type_than_before_is_subscribed_again(setup: Setup) -> None:
    setup.graph.published = {"/topic": "nav_msgs/Path"}
    setup.update(drawn="/topic")
    setup.graph.published = {"/topic": "visualization_msgs/Marker"}
    setup.update(drawn="/topic")
    [first, second] = [each for each in setup.transport.opened if each.topic == "/topic"]
    assert (first.message_type, first.closed) == (Path, True)
    assert (second.message_type, second.closed) == (Marker, False)
    # A plugin needs the topic with another class of messages.
    second.closed = True
    setup.update(drawn="/topic")
    assert setup.transport.last("/topic") is not second


def test_the_second_class_of_messages_is_used_if_the_first_one_is_refused(setup: Setup) -> None:
    class Plain(Path):
        """A class that a plugin uses."""

    setup.graph.published = {"/plan": "nav_msgs/Path"}
    setup.graph.classes["nav_msgs/Path"] = [Path, Plain]
    setup.transport.refused = {Path}
    assert setup.status("/plan") == "no message received"
    assert setup.transport.last("/plan").message_type is Plain
    setup.topics.suspend()
    setup.transport.refused = {Path, Plain}
    assert setup.status("/plan") == "/plan has another type than Plain"
    assert setup.update(inspected="/plan").values == {}


def test_a_drawing_follows_messages_and_transforms(setup: Setup) -> None:
    setup.graph.published = {"/plan": "nav_msgs/Path"}
    setup.update(drawn="/plan")
    setup.receive("/plan", path(1.0, 2.0, frame="odom"))
    missing = 'no transform from "odom" to "map"'
    removed = setup.update(drawn="/plan")
    assert xs(removed.drawings["/plan"]) == []
    assert removed.topics[0].status == missing
    again = setup.update(drawn="/plan")
    assert (again.drawings, again.topics[0].status) == ({}, missing)
    setup.receive("/tf", transform("map", "odom", 10.0))
    shown = setup.update(drawn="/plan")
    assert (xs(shown.drawings["/plan"]), shown.topics[0].status) == ([11.0, 12.0], "")
    assert setup.update(drawn="/plan").drawings == {}
    setup.receive("/tf_static", transform("map", "odom", 20.0))
    assert xs(setup.update(drawn="/plan").drawings["/plan"]) == [21.0, 22.0]
    # Only the newest message counts.
    setup.receive("/plan", path(3.0, 4.0))
    setup.receive("/plan", path(5.0, 6.0))
    assert xs(setup.update(drawn="/plan").drawings["/plan"]) == [5.0, 6.0]


def test_a_drawing_returns_after_a_transform_was_missing(setup: Setup) -> None:
    """The message and its transform are the same as before, but nothing is shown."""
    setup.graph.published = {"/plan": "nav_msgs/Path"}
    setup.update(drawn="/plan")
    message = path(1.0, 2.0)
    setup.receive("/plan", message)
    assert xs(setup.update(drawn="/plan").drawings["/plan"]) == [1.0, 2.0]
    message.header.frame_id = "lost"
    assert xs(setup.update(drawn="/plan").drawings["/plan"]) == []
    message.header.frame_id = "map"
    assert xs(setup.update(drawn="/plan").drawings["/plan"]) == [1.0, 2.0]


def test_an_invalid_message_removes_the_drawing(setup: Setup) -> None:
    setup.graph.published = {"/map": "nav_msgs/OccupancyGrid", "/plan": "nav_msgs/Path"}
    setup.update(drawn="/map /plan")
    setup.receive("/map", grid(0, 100))
    drawing = setup.update(drawn="/map /plan").drawings["/map"]
    assert isinstance(drawing, Grid)
    assert drawing.cells.tolist() == [[0, 100]]
    invalid = grid(0, 100)
    invalid.data = [1]
    setup.receive("/map", invalid)
    update = setup.update(drawn="/map /plan")
    reason = "a grid of 2 x 1 cells must have that number of values, got 1"
    assert update.topics[0].status == f"invalid message: Flatland File: {reason}"
    assert xs(update.drawings["/map"]) == []
    assert setup.update(drawn="/map /plan").drawings == {}
    setup.receive("/map", grid(0, 100))
    update = setup.update(drawn="/map /plan")
    assert update.topics[0].status == ""
    assert isinstance(update.drawings["/map"], Grid)
    # A message whose conversion fails when it is drawn.
    broken = path(1.0)
    broken.poses = [None]
    setup.receive("/plan", broken)
    update = setup.update(drawn="/map /plan")
    assert update.topics[1].status.startswith("invalid message: ")
    assert xs(update.drawings["/plan"]) == []


def test_all_markers_count_and_all_updates_of_a_grid(setup: Setup, caplog: Any) -> None:
    caplog.set_level(logging.INFO, "flatland")
    setup.graph.published = {
        "/marks": "visualization_msgs/Marker",
        "/map": "nav_msgs/OccupancyGrid",
    }
    setup.update(drawn="/marks /map")
    assert "/map_updates" not in setup.transport.open()
    setup.graph.published["/map_updates"] = "std_msgs/Float64"
    setup.update(drawn="/marks /map")
    assert "/map_updates" not in setup.transport.open()
    setup.graph.published["/map_updates"] = "map_msgs/OccupancyGridUpdate"
    for _ in range(2):
        setup.update(drawn="/marks /map")
        assert setup.transport.open().count("/map_updates") == 1
    for number in range(3):
        marker = Marker(type=Marker.POINTS, id=number, points=[Point(number, 0, 0)])
        marker.header.frame_id = "map"
        marker.pose.orientation.w = marker.scale.x = marker.scale.y = marker.color.a = 1.0
        setup.receive("/marks", marker)
    assert xs(setup.update(drawn="/marks /map").drawings["/marks"]) == [0.0, 1.0, 2.0]
    setup.receive("/map", grid(0, 0, 0))
    for x in range(2):
        part = SimpleNamespace(x=x, y=0, width=1, height=1, data=[100])
        setup.receive("/map_updates", part)
    drawing = setup.update(drawn="/marks /map").drawings["/map"]
    assert isinstance(drawing, Grid)
    assert drawing.cells.tolist() == [[100, 100, 0]]
    setup.update(drawn="/marks")
    assert "/map_updates" not in setup.transport.open()
    # Nothing is updated without the class of its messages, which is logged once.
    setup.transport.refused = {SimpleNamespace}
    for _ in range(2):
        assert setup.status("/map") == "no message received"
    texts = [record.getMessage() for record in caplog.records]
    assert texts == [
        "web viewer: /map is not updated: /map_updates has another type than SimpleNamespace"
    ]
    # A grid whose values alone are shown needs no updates.
    setup.transport.refused = set()
    setup.topics.suspend()
    setup.update(inspected="/map")
    assert setup.transport.open() == ["/map"]


def test_values_are_those_of_the_newest_message_at_a_limited_rate(setup: Setup) -> None:
    setup.graph.published = {"/value": "std_msgs/Float64", "/unknown": "no_msgs/Thing"}

    def value() -> Any:
        return dict(setup.update(inspected="/value /unknown").values)

    assert value() == {}
    for number in (1.0, 2.0):
        setup.receive("/value", Float64(number))
    assert value() == {"/value": {"data": 2.0}}
    setup.receive("/value", Float64(3.0))
    setup.clock.now += 0.19
    assert value() == {}
    setup.clock.now += 0.01
    assert value() == {"/value": {"data": 3.0}}
    setup.clock.now += 0.3
    assert value() == {}
    setup.receive("/value", Float64(4.0))
    assert setup.update(drawn="/value").values == {}  # drawn only


@pytest.mark.parametrize(("keeps_all", "kept"), [(False, 1), (True, 1000)])
def test_messages_that_nobody_takes_are_limited(setup: Setup, keeps_all: bool, kept: int) -> None:
    subscription = TopicSubscription(setup.transport, "/t", Float64, keeps_all=keeps_all)  # type: ignore[arg-type]
    for number in range(1001):
        setup.receive("/t", number)
    assert subscription.take() == list(range(1001 - kept, 1001))
    assert subscription.take() == []
    assert subscription.latest == 1000


# -- transforms ------------------------------------------------------------------------------------


def test_the_transforms_of_the_own_world_are_known_from_the_start(setup: Setup) -> None:
    """A paused world sends none."""
    setup.simulation.world.transforms = {
        "odom": Transform(0, "map", "odom", 1.0, -2.0, math.pi / 2)
    }
    setup.graph.published = {"/plan": "nav_msgs/Path"}
    setup.update(drawn="/plan")
    setup.receive("/plan", path(1.0, 2.0, frame="odom"))
    drawing = setup.update(drawn="/plan").drawings["/plan"]
    assert isinstance(drawing, Marks)
    np.testing.assert_allclose(drawing.lines[:, :4], [[1, -1, 1, 0]], atol=1e-6)
    # The transforms end with their subscription.
    setup.simulation.world.transforms = {}
    setup.topics.suspend()
    setup.update(drawn="/plan")
    setup.receive("/plan", path(1.0, 2.0, frame="odom"))
    assert setup.status("/plan") == 'no transform from "odom" to "map"'
    # They also begin again after another subscriber needs another class of messages.
    setup.receive("/tf", transform("map", "odom", 1.0))
    assert setup.status("/plan") == ""
    setup.transport.last("/tf").closed = True
    setup.update(drawn="/plan")
    assert sorted(setup.transport.open()) == ["/plan", "/tf", "/tf_static"]


@pytest.mark.parametrize("error", [TimeoutError(), FlatlandError("closed")])
def test_a_world_that_does_not_answer_prevents_no_drawing(setup: Setup, error: Exception) -> None:
    setup.simulation.error = error
    setup.graph.published = {"/plan": "nav_msgs/Path"}
    setup.update(drawn="/plan")
    setup.receive("/plan", path(1.0, 2.0))
    assert xs(setup.update(drawn="/plan").drawings["/plan"]) == [1.0, 2.0]
    assert setup.simulation.limits == [1.0]  # A world whose plugin blocks is not waited for.


def test_transforms_that_cannot_be_received_are_a_warning(setup: Setup, caplog: Any) -> None:
    setup.transport.refused = {TFMessage}
    setup.graph.published = {"/plan": "nav_msgs/Path"}
    for _ in range(2):
        setup.update(drawn="/plan")
    assert [(record.levelname, record.getMessage()) for record in caplog.records] == [
        ("WARNING", f"web viewer: transforms are missing: {topic} has another type than TFMessage")
        for topic in ("/tf", "/tf_static")
    ]


# -- poses -----------------------------------------------------------------------------------------


def test_poses_can_be_sent_to_the_default_topics_and_to_those_of_other_nodes(setup: Setup) -> None:
    kinds = ("geometry_msgs/PoseStamped", "geometry_msgs/PoseWithCovarianceStamped")
    setup.graph.subscribed = {
        "/a": (kinds[0], frozenset({"/planner"})),
        "/own": (kinds[0], frozenset({"/node"})),
        "/both": (kinds[0], frozenset({"/node", "/planner"})),
        "/ns/goal": (kinds[0], frozenset({"/planner"})),
        "/b": (kinds[1], frozenset({"/filter"})),
    }
    assert setup.update().pose_topics == {
        "goal": ["/ns/goal", "/a", "/both"],
        "initial_pose": ["/ns/initialpose", "/b"],
    }
    with pytest.raises(FlatlandError, match='no node subscribes to poses on "/b"'):
        setup.topics.publish_pose("goal", "/b", (0.0, 0.0, 0.0))
    assert setup.graph.refreshed == 2


@pytest.mark.parametrize(
    ("kind", "topic"), [("goal", "/ns/goal"), ("initial_pose", "/ns/initialpose")]
)
def test_a_pose_is_sent_as_by_rviz(setup: Setup, kind: Any, topic: str) -> None:
    name = {"goal": "geometry_msgs/PoseStamped"}.get(
        kind, "geometry_msgs/PoseWithCovarianceStamped"
    )
    setup.graph.subscribed = {topic: (name, frozenset({"/one", "/two"}))}
    setup.graph.time_ns = 7 * SECOND + 5

    def connect() -> None:
        setup.transport.opened[0].connections = setup.clock.sleeps

    setup.clock.on_sleep = connect
    assert setup.topics.publish_pose(kind, topic, (1.0, 2.0, 0.5)) is True
    [publisher] = setup.transport.opened
    assert setup.clock.sleeps == 2  # until both are connected
    message = TYPES[name]().deserialize(publisher.sent[0])
    assert publisher.message_type is TYPES[name]
    assert message.header.frame_id == "map"
    assert (message.header.stamp.secs, message.header.stamp.nsecs) == (7, 5)
    pose = message.pose
    if kind == "initial_pose":
        expected = np.zeros((6, 6))
        expected[0, 0] = expected[1, 1] = 0.25
        expected[5, 5] = (math.pi / 12) ** 2
        np.testing.assert_array_equal(np.reshape(pose.covariance, (6, 6)), expected)
        pose = pose.pose
    q = pose.orientation
    assert (pose.position.x, pose.position.y, pose.position.z) == (1.0, 2.0, 0.0)
    assert (q.x, q.y, q.z, q.w) == quaternion_from_yaw(0.5)
    # The topic stays open for the next pose.
    setup.topics.publish_pose(kind, topic, (1.0, 2.0, 0.5))
    assert len(publisher.sent) == 2
    assert (len(setup.transport.opened), setup.clock.sleeps) == (1, 2)
    # It has given way to a plugin.
    publisher.closed = True
    setup.clock.on_sleep = lambda: None
    start = setup.clock.now
    assert setup.topics.publish_pose(kind, topic, (1.0, 2.0, 0.5)) is False
    assert setup.clock.now - start == pytest.approx(2.0, abs=0.011)
    assert len(setup.transport.opened) == 2
    setup.topics.close()
    assert setup.transport.open() == []
