"""What RViz and the viewer need besides: all markers of a kind on one topic, and the pause."""

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


def shown(message: Any) -> dict[str, int]:
    """How many markers each namespace has, of those that are not taken away."""
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
def test_layers_are_together(ros: Any, topic: str, kind: int) -> None:
    message = ros.topic(f"{DEBUG}/{topic}", MarkerArray).next()
    assert shown(message) == {"hall": 1, "2d": 1}
    assert {marker.type for marker in message.markers if marker.action == Marker.ADD} == {kind}


def test_models_come_move_and_go(ros: Any, write_world: Callable[..., Path]) -> None:
    models = ros.topic(f"{DEBUG}/all_models", MarkerArray)
    assert shown(models.next()) == {"one": 1, "two": 1}
    assert ros.spawn("ball.model.yaml", "three", pose=(1, 2, 0)).success
    message = models.until(lambda message: "three" in shown(message))
    (marker,) = (marker for marker in message.markers if marker.ns == "three")
    assert (marker.pose.position.x, marker.pose.position.y) == (1, 2)
    assert marker.header.frame_id == "map"
    assert ros.move("three", (-1, 0, 0)).success
    models.until(lambda m: [k.pose.position.x for k in m.markers if k.ns == "three"] == [-1])
    assert ros.delete("three").success
    gone = models.until(lambda message: "three" not in shown(message))
    assert gone.markers[0].action == Marker.DELETEALL
    # Deleting all costs RViz the work of making all anew: it is not done for ever.
    models.until(lambda message: message.markers[0].action == Marker.ADD)


def test_list_holds_what_is_on_topics_of_its_own_only(ros: Any) -> None:
    listed = ros.topic(f"{DEBUG}/topics", DebugTopicList).next().topics
    assert {"layer/hall", "layer/2d_3d", "model/one"} <= set(listed)
    assert not [topic for topic in listed if topic.startswith("all_")]


def test_pause_is_told(ros: Any) -> None:
    paused = ros.topic("/flatland_server/paused", Bool)
    assert paused.next().data is False
    ros.call("/pause", Empty)
    assert paused.until(lambda message: message.data)
    ros.call("/toggle_pause", Empty)
    assert paused.until(lambda message: not message.data)
    # A state that lasts is told once.
    assert paused.rest() == []


HASTY = """
import queue
import rospy
from std_msgs.msg import Bool
from std_srvs.srv import Empty

rospy.init_node("hasty", disable_rostime=True)
pause, resume = rospy.ServiceProxy("/pause", Empty), rospy.ServiceProxy("/resume", Empty)
for _ in range(10):
    heard = queue.Queue()
    # All others were told of the pause, and are not yet told of its end.
    resume()
    subscriber = rospy.Subscriber("/flatland_server/paused", Bool, lambda m: heard.put(m.data))
    while heard.get():
        pass
    pause()
    while not heard.get():
        pass
    subscriber.unregister()
resume()
"""


def test_newcomer_hears_of_a_pause_right_after_its_first_message(ros: Any, launcher: Any) -> None:
    """What it was told at first is news to it alone, and the pause is back before all are told."""
    paused = ros.topic("/flatland_server/paused", Bool)
    assert paused.next().data is False
    # Subscribers in one process share one connection.
    hasty = launcher.program(sys.executable, "-c", HASTY)
    assert hasty.wait() == 0, hasty.output
