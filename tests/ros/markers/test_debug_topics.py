"""Marker topics of a running node and its pause state, as received by a subscriber."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rospy
from raw_subscriber import RawSubscriber
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Bool
from std_srvs.srv import Empty, Trigger
from visualization_msgs.msg import InteractiveMarkerInit, Marker, MarkerArray
from waiting import TIMEOUT

from flatland.msg import DebugTopicList
from flatland.srv import SetAppearance, SetAppearanceRequest

DEBUG = "/flatland_server/debug"
RATE = 20.0  # Hz, model markers

LAYERS = """
layers:
  - {name: 2d, map: map.yaml, color: [0.1, 0.2, 0.3, 0.4]}
  - {name: [hall, alias], map: turned.yaml, properties: {debug: {min_z: -0.5, max_z: 2.5}}}
  - {name: bad heights, map: map.yaml, properties: {debug: {min_z: low}}}
  - {name: growing}
"""
TURNED = "type: line_segments\ndata: walls.dat\nscale: 0.5\norigin: [1, 2, 0.5]\n"
ARM = """
bodies:
  - {name: base, color: [1, 0, 0, 1], footprints: [{type: circle, radius: 0.2, center: [0.1, 0.3],
     density: 1}]}
  - {name: arm, pose: [1, 0, 0], color: [0, 1, 0, 0.75], footprints: [{type: polygon, density: 1,
     points: [[0, 0], [0.5, 0], [0.5, 0.25]]}]}
  - {name: empty, footprints: []}
joints:
  - {name: elbow, type: weld, color: [0, 0, 1, 0.5],
     bodies: [{name: base, anchor: [0.5, 0]}, {name: arm, anchor: [-0.5, 0]}]}
"""
PLUGIN = """
import numpy as np
from std_srvs.srv import Trigger, TriggerResponse
import flatland

class Grow(flatland.WorldPlugin):
    def on_initialize(self, config):
        self.ros.advertise_service("grow", Trigger, self.grow)

    def grow(self, request):
        layer = self.world.layer("growing")
        layer.add_edges(np.array([[0, 0, 1, len(layer.edges)]], np.float32))
        self.world.layer_changed(layer)
        return TriggerResponse(True, "")

"""


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, write_world: Callable[..., Path]) -> Any:
    world = write_world(arm=ARM)
    folder = world.parent
    (folder / "turned.yaml").write_text(TURNED)
    world.write_text(
        f"properties: {{}}\n{LAYERS}\nmodels: []\nplugins: [{{name: grow, type: 'test::Grow'}}]\n"
    )
    module_launcher.add_plugins(folder, PLUGIN, "test_plugin_of_markers")
    return module_launcher.server(world, show_viz=True, viz_pub_rate=RATE)


@pytest.fixture
def arm(ros: Any) -> Any:
    """A model with all kinds of markers, at (3, 1) and rotated by 90 degrees."""
    answer = ros.spawn("arm.model.yaml", "arm", "", (3, 1, math.pi / 2))
    assert answer.success, answer.message
    yield
    ros.call("/resume", Empty)
    ros.delete("arm")


def late_message(ros: Any, name: str, message_type: type[Any] = MarkerArray) -> Any:
    """Returns the first message that a subscriber with a connection of its own receives."""
    with closing(RawSubscriber(ros.master, f"{DEBUG}/{name}", message_type, name="/late")) as late:
        return late.next()


def color(marker: Marker) -> tuple[float, ...]:
    return (marker.color.r, marker.color.g, marker.color.b, marker.color.a)


def scale(marker: Marker) -> tuple[float, ...]:
    return (marker.scale.x, marker.scale.y, marker.scale.z)


def points(marker: Marker) -> list[list[float]]:
    return [[point.x, point.y, point.z] for point in marker.points]


def number_of_points(message: Any) -> int:
    return sum(len(marker.points) for marker in message.markers)


def pose(marker: Marker) -> tuple[float, ...]:
    position, orientation = marker.pose.position, marker.pose.orientation
    assert (position.z, orientation.x, orientation.y) == (0, 0, 0)
    return (position.x, position.y, 2 * math.atan2(orientation.z, orientation.w))


# -- layers --------------------------------------------------------------------------------


def test_layer_as_lines(ros: Any) -> None:
    message = ros.topic(f"{DEBUG}/layer/2d", MarkerArray).next()
    assert message._connection_header["latching"] == "1"
    (marker,) = message.markers
    assert (marker.type, marker.action) == (Marker.LINE_LIST, Marker.ADD)
    assert marker.header.frame_id == "map"
    assert color(marker) == pytest.approx((0.1, 0.2, 0.3, 0.4))
    assert marker.scale.x == 0.03
    assert pose(marker) == (0, 0, 0)
    assert marker.lifetime == rospy.Duration(0)
    corners = [[-5, -5, 0], [5, -5, 0], [5, 5, 0], [-5, 5, 0]]
    lines = [points(marker)[i : i + 2] for i in range(0, 8, 2)]
    assert lines == [[corners[i], corners[(i + 1) % 4]] for i in range(4)]


def test_layer_is_published_once_and_when_it_changes(ros: Any) -> None:
    lines = ros.topic(f"{DEBUG}/layer/growing", MarkerArray)
    walls = ros.topic(f"{DEBUG}/layer/growing_3d", MarkerArray)
    assert lines.next().markers == walls.next().markers == []
    for count in (1, 2):
        assert ros.call("/grow", Trigger).success
        # A new subscriber may get the state before the change twice.
        (line_marker,) = lines.until(lambda m, n=count: number_of_points(m) == 2 * n).markers
        assert points(line_marker)[-1] == [1, count - 1, 0]
        walls.until(lambda m, n=count: number_of_points(m) == 6 * n)
    assert number_of_points(late_message(ros, "layer/growing")) == 4
    # Existing subscribers receive nothing for a late subscriber, or as time passes.
    assert lines.rest() == walls.rest() == []


# -- models --------------------------------------------------------------------------------


def test_model_as_footprints_and_joints(ros: Any, arm: None) -> None:
    del arm
    clock = ros.topic("/clock", Clock).next().clock
    message = ros.topic(f"{DEBUG}/model/arm", MarkerArray).next()
    assert message._connection_header["latching"] == "1"
    markers = message.markers
    assert {marker.header.frame_id for marker in markers} == {"map"}
    assert {marker.action for marker in markers} == {Marker.ADD}
    assert len({(marker.ns, marker.id) for marker in markers}) == 4
    (stamp,) = {marker.header.stamp for marker in markers}
    assert 0 <= (stamp - clock).to_sec() < TIMEOUT
    circle, polygon, lines, cubes = markers

    assert circle.type == Marker.SPHERE_LIST
    assert points(circle) == [pytest.approx([0.1, 0.3, 0.01])]
    assert scale(circle) == pytest.approx((0.4, 0.4, 0.4))
    assert color(circle) == (1, 0, 0, 1)
    assert pose(circle) == pytest.approx((3, 1, math.pi / 2), abs=1e-6)

    assert polygon.type == Marker.LINE_STRIP
    assert scale(polygon)[0] == 0.03
    assert color(polygon) == (0, 1, 0, 0.75)
    assert pose(polygon) == pytest.approx((3, 2, math.pi / 2), abs=1e-6)
    strip = points(polygon)
    assert strip[0] == strip[3]
    assert sorted(strip[:3]) == [[0, 0, 0], [0.5, 0, 0], [0.5, 0.25, 0]]

    origin_a, anchor_a, origin_b, anchor_b = [3, 1, 0], [3, 1.5, 0], [3, 2, 0], [3, 1.5, 0]
    assert (lines.type, cubes.type) == (Marker.LINE_LIST, Marker.CUBE_LIST)
    assert scale(lines)[0] == 0.01
    assert scale(cubes) == (0.03, 0.03, 0.03)
    assert color(lines) == color(cubes) == (0, 0, 1, 0.5)
    assert pose(lines) == pose(cubes) == (0, 0, 0)
    expected = [origin_a, anchor_a, origin_b, anchor_b, anchor_a, anchor_b]
    assert np.array(points(lines)) == pytest.approx(np.array(expected), abs=1e-5)
    expected = [origin_a, anchor_a, origin_b, anchor_b]
    assert np.array(points(cubes)) == pytest.approx(np.array(expected), abs=1e-5)


def test_markers_are_published_while_paused(ros: Any, arm: None) -> None:
    del arm
    topic = ros.topic(f"{DEBUG}/model/arm", MarkerArray)
    ros.call("/pause", Empty)
    # Messages from before the pause may still be on their way; the move is made in the pause.
    assert ros.move("arm", (-2, 0, 0)).success
    moved = topic.until(lambda message: pose(message.markers[0])[0] < 0)
    stamp = moved.markers[0].header.stamp
    assert {message.markers[0].header.stamp for message in topic.take(3)} == {stamp}
    topic.close()
    assert ros.move("arm", (-3, 0, 0)).success  # without subscribers
    assert pose(late_message(ros, "model/arm").markers[0])[0] == pytest.approx(-3)


# -- added and deleted models, list of topics, names --------------------------------------

LAYER_TOPICS = [
    f"layer/{name}{suffix}"
    for name in ("2d", "hall", "bad_heights", "growing")
    for suffix in ("", "_3d")
]


def test_topics_are_listed(ros: Any) -> None:
    topics = ros.topic(f"{DEBUG}/topics", DebugTopicList)
    first = topics.next()
    assert (first.topics, first._connection_header["latching"]) == (LAYER_TOPICS, "1")
    assert ros.spawn("ball.model.yaml", "one").success
    # A new subscriber may get the state before the change twice.
    message = topics.until(lambda message: message.topics != LAYER_TOPICS)
    assert message.topics == [*LAYER_TOPICS, "model/one"]
    assert ros.spawn("ball.model.yaml", "two").success
    assert topics.next().topics == [*LAYER_TOPICS, "model/one", "model/two"]
    listed = late_message(ros, "topics", DebugTopicList).topics
    assert listed == [*LAYER_TOPICS, "model/one", "model/two"]
    assert ros.delete("one").success
    assert topics.next().topics == [*LAYER_TOPICS, "model/two"]
    assert ros.delete("two").success
    assert topics.next().topics == LAYER_TOPICS
    assert topics.rest() == []
    assert set(ros.types()) >= {f"{DEBUG}/{name}" for name in LAYER_TOPICS}


def test_deleted_model_deletes_its_markers_and_its_topic(ros: Any, eventually: Any) -> None:
    assert ros.spawn("ball.model.yaml", "one").success
    topic = ros.topic(f"{DEBUG}/model/one", MarkerArray)
    topic.next()
    assert ros.delete("one").success
    message = topic.until(lambda message: message.markers[0].action == Marker.DELETEALL)
    assert len(message.markers) == 1
    assert message.markers[0].header.frame_id == "map"
    eventually("end of the topic", lambda: not topic.connected)
    eventually(
        "its end at the master",
        lambda: f"{DEBUG}/model/one" not in ros.registered_now()["publishers"],
    )
    assert topic.rest() == []


# -- combined topics, used by RViz and the viewer ------------------------------------------


def marker_counts(message: Any) -> dict[str, int]:
    """Returns the number of markers in each namespace after all deletions of a message."""
    namespaces: dict[str, int] = {}
    for marker in message.markers:
        if marker.action == Marker.DELETEALL:
            namespaces.clear()
        elif marker.action == Marker.ADD:
            namespaces[marker.ns] = namespaces.get(marker.ns, 0) + 1
    return namespaces


@pytest.mark.parametrize(
    ("topic", "kind"), [("all_layers", Marker.LINE_LIST), ("all_layers_3d", Marker.TRIANGLE_LIST)]
)
def test_layers_are_on_one_topic(ros: Any, topic: str, kind: int) -> None:
    message = ros.topic(f"{DEBUG}/{topic}", MarkerArray).next()
    # The other layer has no walls before one of the tests above.
    assert marker_counts(message).items() >= {"2d": 1, "hall": 1, "bad heights": 1}.items()
    assert {marker.type for marker in message.markers if marker.action == Marker.ADD} == {kind}


def test_pause_state_is_published(ros: Any) -> None:
    paused = ros.topic("/flatland_server/paused", Bool)
    assert paused.next().data is False
    ros.call("/pause", Empty)
    assert paused.until(lambda message: message.data)
    ros.call("/toggle_pause", Empty)
    assert paused.until(lambda message: not message.data)
    # Only changes are published.
    assert paused.rest() == []


def test_markers_and_handles_follow_the_appearance(ros: Any, arm: None) -> None:
    del arm
    blue = (0.0, 0.0, 1.0, 0.75)
    markers = ros.topic(f"{DEBUG}/model/arm", MarkerArray)
    combined = ros.topic(f"{DEBUG}/all_models", MarkerArray)
    handles = ros.topic("/interactive_model_markers/update_full", InteractiveMarkerInit)
    request = SetAppearanceRequest(model="arm", body="base", color=blue)
    answer = ros.call("/set_appearance", SetAppearance, request)
    assert (answer.success, answer.message) == (True, "")
    assert request.visible == SetAppearanceRequest.KEEP
    request = SetAppearanceRequest(model="arm", body="arm", visible=SetAppearanceRequest.HIDE)
    assert ros.call("/set_appearance", SetAppearance, request).success
    bodies = (Marker.SPHERE_LIST, Marker.LINE_STRIP)

    def colors(markers: Any) -> list[Any]:
        return [color(marker) for marker in markers if marker.type in bodies]

    markers.until(lambda message: colors(message.markers) == [blue])
    combined.until(lambda message: colors(message.markers) == [blue])
    # Behind the name of the model are the outlines of its bodies.
    handles.until(
        lambda message: (
            [color(each) for each in message.markers[0].controls[-1].markers[1:]] == [blue]
        )
    )
