"""Combined marker topics and the pause topic, used by RViz and the viewer."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import Bool
from std_srvs.srv import Empty
from visualization_msgs.msg import Marker, MarkerArray

from flatland.msg import DebugTopicList

DEBUG = "/flatland_server/debug"
HALL = "{name: hall, map: map.yaml, color: [1, 0, 0, 1]}"


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, write_world: Callable[..., Path]) -> Any:
    world = write_world(
        "[{name: one, model: ball.model.yaml}, {name: two, model: robot.model.yaml}]"
    )
    world.write_text(world.read_text().replace("layers: [", f"layers: [{HALL}, "))
    return module_launcher.server(world, show_viz=True, viz_pub_rate=50)


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
    assert marker_counts(message) == {"hall": 1, "2d": 1}
    assert {marker.type for marker in message.markers if marker.action == Marker.ADD} == {kind}


def test_models_are_added_moved_and_deleted(ros: Any, write_world: Callable[..., Path]) -> None:
    models = ros.topic(f"{DEBUG}/all_models", MarkerArray)
    assert marker_counts(models.next()) == {"one": 1, "two": 1}
    assert ros.spawn("ball.model.yaml", "three", pose=(1, 2, 0)).success
    message = models.until(lambda message: "three" in marker_counts(message))
    (marker,) = (marker for marker in message.markers if marker.ns == "three")
    assert (marker.pose.position.x, marker.pose.position.y) == (1, 2)
    assert marker.header.frame_id == "map"
    assert ros.move("three", (-1, 0, 0)).success
    models.until(lambda m: [k.pose.position.x for k in m.markers if k.ns == "three"] == [-1])
    assert ros.delete("three").success
    message = models.until(lambda message: "three" not in marker_counts(message))
    assert message.markers[0].action == Marker.DELETEALL
    # The deletion is repeated only for a short time, because RViz then recreates all markers.
    models.until(lambda message: message.markers[0].action == Marker.ADD)


def test_combined_topics_are_not_listed(ros: Any) -> None:
    listed = ros.topic(f"{DEBUG}/topics", DebugTopicList).next().topics
    assert {"layer/hall", "layer/2d_3d", "model/one"} <= set(listed)
    assert not [topic for topic in listed if topic.startswith("all_")]


def test_pause_state_is_published(ros: Any) -> None:
    paused = ros.topic("/flatland_server/paused", Bool)
    assert paused.next().data is False
    ros.call("/pause", Empty)
    assert paused.until(lambda message: message.data)
    ros.call("/toggle_pause", Empty)
    assert paused.until(lambda message: not message.data)
    # Only changes are published.
    assert paused.rest() == []


CLIENT = """
import queue
import rospy
from std_msgs.msg import Bool
from std_srvs.srv import Empty

rospy.init_node("client", disable_rostime=True)
pause, resume = rospy.ServiceProxy("/pause", Empty), rospy.ServiceProxy("/resume", Empty)
for _ in range(10):
    received = queue.Queue()
    # The pause was published to all; its end is published with the next tick.
    resume()
    subscriber = rospy.Subscriber("/flatland_server/paused", Bool, lambda m: received.put(m.data))
    while received.get():
        pass
    pause()
    while not received.get():
        pass
    subscriber.unregister()
resume()
"""


def test_late_subscriber_receives_a_pause_right_after_its_first_message(
    ros: Any, launcher: Any
) -> None:
    """The world is paused again before the resumed state was published to all subscribers."""
    paused = ros.topic("/flatland_server/paused", Bool)
    assert paused.next().data is False
    # Subscribers in one process share one connection.
    client = launcher.program(sys.executable, "-c", CLIENT)
    assert client.wait() == 0, client.output
