"""Topics of other nodes in the viewer in the browser."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from queue import Queue
from typing import Any

import numpy as np
import pytest
import rospy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import OccupancyGrid
from nav_msgs.msg import Path as PathMessage
from std_msgs.msg import Float64, String
from tf2_msgs.msg import TFMessage
from waiting import TIMEOUT
from web_client import WebClient

from flatland.web.encoding import GRID, MARKS

NODE = "/flatland_server"
LISTENER = """
bodies: [{name: base, footprints: []}]
plugins: [{type: 'test::Listener', name: listener}]
"""
LISTENER_PLUGIN = """
import flatland
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import OccupancyGrid
from std_msgs.msg import Float64, String


class Listener(flatland.ModelPlugin):
    def on_initialize(self, config):
        received = self.ros.advertise("received", String, latch=True)
        report = lambda message: received.publish(String(message._type))
        self.ros.subscribe("/some_grid", OccupancyGrid, report)
        self.ros.advertise("/move_base_simple/goal", Float64)
"""
BEACON = """
bodies: [{name: mast, footprints: [{type: circle, radius: 0.1, density: 1}]}]
plugins: [{type: ModelTfPublisher, name: tf, publish_tf_world: true, world_frame_id: map}]
"""


class TopicClient(WebClient):
    """A client that decodes the messages about topics.

    Attributes:
        lines: The lines of each topic by its id.
        cells: The cells of each grid by the id of its topic.
    """

    def __init__(self, url: str) -> None:
        self.lines: dict[int, Any] = {}
        self.cells: dict[int, Any] = {}
        super().__init__(url, topics=[])

    def _take_binary(self, data: bytes) -> None:
        super()._take_binary(data)
        if data[0] == MARKS:
            number, lines = struct.unpack_from("<2I", data, 16)
            shown = np.frombuffer(data, "<f4", 5 * lines, 32)
            self.lines[number] = shown.reshape(-1, 5)
            self.cells.pop(number, None)
        elif data[0] == GRID:
            number, width, height = struct.unpack_from("<3I", data, 16)
            cells = np.frombuffer(zlib.decompress(data[44:]), np.int8)
            self.cells[number] = cells.reshape(height, width)

    def last(self, kind: str, **fields: Any) -> dict[str, Any]:
        """Returns the last message of a type with these fields, empty if there is none."""
        found = [
            text for text in self.texts if text["type"] == kind and fields.items() <= text.items()
        ]
        return found[-1] if found else {}

    def topic(self, name: str) -> dict[str, Any]:
        """Waits until a topic is listed, and returns its entry."""

        def entry() -> Any:
            listed = self.last("topics").get("topics", [])
            return next((each for each in listed if each["topic"] == name), None)

        return dict(self.until(f"topic {name}", entry))

    def until_status(self, name: str, status: str) -> None:  # type: ignore[override]
        """Waits for the status of a topic."""
        self.until(f"{name}: {status}", lambda: self.topic(name)["status"] == status)


@pytest.fixture(scope="module")
def url(module_launcher: Any, write_world: Callable[..., Path]) -> str:
    """A node with the viewer on any free port; the frame `mast` is at (-2, -3)."""
    world = write_world(
        "[{name: robot, model: robot.model.yaml, pose: [1, 2, 0]},"
        " {name: beacon, model: beacon.model.yaml, pose: [-2, -3, 0]}]",
        beacon=BEACON,
        listener=LISTENER,
    )
    module_launcher.add_plugins(world.parent, LISTENER_PLUGIN, "listener_plugin")
    server = module_launcher.server(
        world, web=True, web_port=0, web_token="0123456789abcdef", web_view_token="fedcba9876543210"
    )
    return str(server.wait_for_line(r"viewer in the browser: (http://\S+)")[1])


@pytest.fixture
def client(url: str, ros: Any) -> Iterator[TopicClient]:
    with TopicClient(url) as client:
        yield client


@pytest.fixture
def publish(ros_master: Any) -> Iterator[Callable[..., rospy.Publisher]]:
    """Publishes a latched message on a topic until the end of the test."""
    publishers = []

    def publish(name: str, message: Any) -> rospy.Publisher:
        publishers.append(rospy.Publisher(name, type(message), queue_size=1, latch=True))
        publishers[-1].publish(message)
        return publishers[-1]

    yield publish
    for publisher in publishers:
        publisher.unregister()


def stamped(message: Any, frame: str) -> Any:
    message.header.frame_id = frame
    return message


def path(frame: str) -> PathMessage:
    message = stamped(PathMessage(), frame)
    for x in (0, 2):
        each = PoseStamped()
        each.pose.position.x = x
        message.poses.append(each)
    return message


def test_a_path_appears_as_soon_as_its_frame_is_known(
    client: TopicClient, publish: Any, ros: Any
) -> None:
    publish("/plan", path("local"))
    plan = client.topic("/plan")
    assert (plan["type"], plan["drawn_as"], plan["status"]) == ("nav_msgs/Path", "marks", "")
    client.look(topics=["/plan"])
    client.until_status("/plan", 'no transform from "local" to "map"')
    transform = stamped(TransformStamped(child_frame_id="local"), "map")
    transform.transform.translation.y = 3
    transform.transform.rotation.w = 1
    publish("/tf_static", TFMessage([transform]))
    client.until("the path", lambda: len(client.lines.get(plan["id"], ())))
    np.testing.assert_allclose(client.lines[plan["id"]][:, :4], [[0, 3, 2, 3]], atol=1e-5)
    client.until_status("/plan", "")


def test_subscriptions_exist_only_while_a_client_looks(
    client: TopicClient, publish: Any, ros: Any, eventually: Any
) -> None:
    publish("/plan", path("map"))
    publish("/value", Float64(1.5))
    for name in ("/plan", "/value"):
        client.topic(name)

    def subscribed() -> set[str]:
        return ros.registered_now(NODE)["subscribers"] & {"/plan", "/value", "/tf"}

    client.look(topics=[], topic_values=["/value"])
    client.until("a value", lambda: client.last("topic_values", value={"data": 1.5}))
    # The subscriptions for the client of the previous test end asynchronously.
    eventually("the value alone", lambda: subscribed() == {"/value"})
    client.look(topics=["/plan"], topic_values=[])
    eventually("the path", lambda: subscribed() == {"/plan", "/tf"})
    client.close()
    eventually("no subscriptions", lambda: subscribed() == set())


def test_goals_and_initial_poses_are_those_of_rviz(client: TopicClient, ros: Any) -> None:
    received: Queue[Any] = Queue()
    subscribers = [
        rospy.Subscriber("/move_base_simple/goal", PoseStamped, received.put),
        rospy.Subscriber("/r2/initialpose", PoseWithCovarianceStamped, received.put),
    ]
    topics = {
        "goal": ["/move_base_simple/goal"],
        "initial_pose": ["/initialpose", "/r2/initialpose"],
    }
    client.until("the topics", lambda: client.last("topics").get("pose_topics") == topics)
    for purpose, listed in topics.items():
        pose = {"purpose": purpose, "topic": listed[-1], "pose": [1, 2, 0.5]}
        assert client.do("publish_pose", **pose) == {"received": True}
        message = received.get(timeout=TIMEOUT)
        assert message.header.frame_id == "map"
        position = (message.pose if purpose == "goal" else message.pose.pose).position
        assert (position.x, position.y) == (1, 2)
    for subscriber in subscribers:
        subscriber.unregister()


def test_topics_remain_through_a_reset_and_its_undo(client: TopicClient, publish: Any) -> None:
    shown = path("mast")
    publisher = publish("/kept", shown)
    number = client.topic("/kept")["id"]
    client.look(topics=["/kept"], topic_values=["/kept"])
    client.until("the path", lambda: len(client.lines.get(number, ())))
    for request in ("reset", "undo"):
        assert "/clock is set back" in client.do(request)["effect"]
        shown.poses[-1].pose.position.x += 1
        publisher.publish(shown)
        end = shown.poses[-1].pose.position.x - 2
        client.until(f"the path after {request}", lambda end=end: client.lines[number][0, 2] == end)
    assert client.topic("/kept")["status"] == ""


def test_what_a_page_uses_gives_way_to_a_plugin(
    client: TopicClient, publish: Any, ros: Any
) -> None:
    """The page receives grids with a class of its own, and publishes goals of another type."""
    grid = stamped(OccupancyGrid(), "map")
    grid.info.width, grid.info.height, grid.info.resolution = 2, 1, 0.5
    grid.data = [0, 100]
    publisher = publish("/some_grid", grid)
    number = client.topic("/some_grid")["id"]
    client.look(topics=["/some_grid"])
    client.until("the grid", lambda: number in client.cells)
    goal = {"purpose": "goal", "topic": "/move_base_simple/goal", "pose": [1, 2, 0]}
    client.do("publish_pose", **goal)
    answer = ros.spawn("listener.model.yaml", "listener", "listener")
    assert answer.success, answer.message
    assert ros.topic("/listener/received", String).next().data == "nav_msgs/OccupancyGrid"
    error = client.refused("publish_pose", **goal)
    assert "has the type std_msgs/Float64 already, used by" in error
    # The page receives later grids as well.
    grid.data = [100, 0]
    publisher.publish(grid)
    client.until("the next grid", lambda: client.cells[number].tolist() == [[100, 0]])
    ros.delete("listener")
    client.do("publish_pose", **goal)
