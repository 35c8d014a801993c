"""The viewer in the browser beside ROS: both control the same node."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from programs import run_program
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Bool
from std_srvs.srv import Empty
from web_client import WebClient

from flatland.srv import GetModelStates

PORT_LINE = r"viewer in the browser: (http://\S+)"


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    return write_world("[{name: robot, model: robot.model.yaml, pose: [1, 2, 0]}]")


@pytest.fixture(scope="module")
def server(module_launcher: Any, world: Path) -> Any:
    """A node with the viewer on any free port."""
    return module_launcher.server(
        world, web=True, web_port=0, if_blocked="refuse", model_path=world.parent
    )


@pytest.fixture(scope="module")
def url(server: Any) -> str:
    return str(server.wait_for_line(PORT_LINE)[1])


@pytest.fixture
def client(url: str, ros: Any) -> Iterator[WebClient]:
    with WebClient(url) as client:
        yield client
        client.do("resume")


def model_poses(ros: Any) -> dict[str, tuple[float, float, float]]:
    """Returns the poses of all models."""
    states = ros.call("/get_model_states", GetModelStates, []).states
    found = [(pose.x, pose.y, pose.theta) for pose in states.pose]
    return dict(zip(states.name, found, strict=True))


def test_the_page_shows_the_world_of_the_node(client: WebClient, url: str, ros: Any) -> None:
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/", url)
    assert client.pose("robot") == pytest.approx((1, 2, 0))
    before = client.status()["time"]
    client.until("time", lambda: client.status()["time"] > before)
    status = client.status()
    assert (status["paused"], status["rate"], status["lockstep"]) == (False, 200, False)
    assert ros.move("robot", (-1, 0.5, 1)).success
    client.until("move", lambda: client.pose("robot") == pytest.approx((-1, 0.5, 1), abs=1e-5))
    assert ros.move("robot", (1, 2, 0)).success


def test_pause_and_resume_agree_with_the_services(client: WebClient, ros: Any) -> None:
    paused = ros.topic("/flatland_server/paused", Bool)
    assert not paused.until(lambda message: not message.data).data
    client.do("pause")
    paused.until(lambda message: message.data)
    ros.call("/resume", Empty)
    client.until_status(paused=False)
    ros.call("/pause", Empty)
    client.until_status(paused=True)
    client.do("resume")
    paused.until(lambda message: not message.data)


def test_models_are_spawned_moved_and_deleted_as_by_the_services(
    client: WebClient, ros: Any
) -> None:
    files = {each["label"]: each["path"] for each in client.do("files")}
    ball = next(path for label, path in files.items() if "ball" in label)
    client.do("spawn", file=ball, name="ball", pose=[0, -2, 0])
    assert client.pose("ball") == pytest.approx((0, -2, 0))
    assert "ball" in model_poses(ros)
    # The parameters of the node apply to both.
    number = client.model("ball")["id"]
    assert "overlaps" in client.refused("move", model=number, pose=[1, 2, 0])
    assert "already exists" in client.refused("spawn", file=ball, name="robot", pose=[3, 3, 0])
    assert "model_path" in client.refused("spawn", file="/etc/passwd", name="x", pose=[3, 3, 0])
    client.do("move", model=number, pose=[0, -3, math.pi / 2])
    assert model_poses(ros)["ball"] == pytest.approx((0, -3, math.pi / 2))
    client.do("delete", model=number)
    client.until("deletion", lambda: "ball" not in client.worlds[0]["models"])
    assert "ball" not in model_poses(ros)


def test_page_and_topic_drive_the_same_command(client: WebClient, ros: Any) -> None:
    truth = ros.topic("/odometry/ground_truth", Odometry)
    robot = client.model("robot")
    (command,) = robot["commands"]
    client.do("drive", model=robot["id"], command=command, linear=[0.5, 0], angular=0)
    truth.until(lambda message: message.twist.twist.linear.x == pytest.approx(0.5))
    # Without further messages, the robot stops: here, as if the key had got stuck.
    truth.until(lambda message: message.twist.twist.linear.x == 0)
    twist = Twist()
    twist.linear.x = -0.25
    ros.publisher("/cmd_vel", Twist).publish(twist)
    truth.until(lambda message: message.twist.twist.linear.x == pytest.approx(-0.25))
    # A stop by the page ends the command of the topic too.
    client.do("drive", model=robot["id"], command=command, linear=[0, 0], angular=0)
    truth.until(lambda message: message.twist.twist.linear.x == 0)


def test_a_drag_in_rviz_and_one_on_the_page_share_the_pause(client: WebClient, ros: Any) -> None:
    from visualization_msgs.msg import InteractiveMarkerFeedback as Feedback

    handles = ros.publisher("/interactive_model_markers/feedback", Feedback)
    drag = Feedback(client_id="rviz", marker_name="robot", event_type=Feedback.MOUSE_DOWN)
    drag.header.frame_id = "map"
    drag.pose.position.x, drag.pose.position.y, drag.pose.orientation.w = 1, 2, 1
    handles.publish(drag)
    client.until_status(paused=True)
    client.do("hold", model=client.model("robot")["id"])
    # RViz stops sending feedback, which ends its drag; the page still holds the model.
    drag.event_type = Feedback.MOUSE_UP
    drag.pose.position.x = -2
    handles.publish(drag)
    client.until("release", lambda: client.pose("robot")[0] == pytest.approx(-2))
    assert client.until_status(paused=True)["paused"]
    client.do("release", model=client.model("robot")["id"])
    client.until_status(paused=False)


def test_earlier_states_set_the_clock_back_and_keep_topics_connected(
    client: WebClient, ros: Any
) -> None:
    truth = ros.topic("/odometry/ground_truth", Odometry)
    clock = ros.topic("/clock", Clock)
    client.look(history=True)

    def moments() -> list[dict[str, Any]]:
        found = [text for text in client.texts if text["type"] == "history"]
        return found[-1]["moments"] if found else []

    client.until("two moments", lambda: len(moments()) >= 2)
    first = moments()[0]
    before = client.status()["time"]
    assert "/clock is set back" in client.do("visit", moment=first["moment"])["effect"]
    clock.until(lambda message: message.clock.to_sec() == pytest.approx(first["time"], abs=1e-9))
    assert client.until_status(paused=True)["paused"]
    client.until("newest", lambda: moments()[-1]["label"] == "before going back")
    client.do("visit", moment=moments()[-1]["moment"])
    client.do("resume")
    clock.until(lambda message: message.clock.to_sec() > before)
    truth.until(lambda message: message.header.stamp.to_sec() > before)

    assert "/clock is set back" in client.do("reset")["effect"]
    clock.until(lambda message: message.clock.to_sec() < before)
    truth.until(lambda message: message.header.stamp.to_sec() < before)
    client.do("undo")
    clock.until(lambda message: message.clock.to_sec() > before)
    truth.until(lambda message: message.header.stamp.to_sec() > before)


# -- the start of the viewer -----------------------------------------------------------------


def test_a_restarted_simulator_is_shown_at_the_same_address(
    module_launcher: Any, server: Any, url: str, world: Path
) -> None:
    """The last test of this file: it ends the server."""
    with WebClient(url) as client:
        # The new node has the name of the first one, which ends, and takes its port.
        second = module_launcher.start(world_path=world, web=True, web_port=urlsplit(url).port)
        with pytest.raises(ConnectionError):
            client.until("the end of the connection", lambda: False)
    assert server.wait() == 1
    (line,) = (line for line in server.lines if "[FATAL]" in line)
    assert re.search(
        r'another node has taken the name "/flatland_server" on the ROS master at \S+: this one '
        r"ends$",
        line,
    )
    assert second.wait_for_line(PORT_LINE)[1] == url
    with WebClient(url) as client:
        assert client.pose("robot") == pytest.approx((1, 2, 0))
    assert second.stop() == 0
    assert "Traceback" not in server.output + second.output


def test_without_the_viewer_its_modules_are_not_imported() -> None:
    """They take longer to import than a small world to load."""
    code = (
        "import sys, flatland.ros.node, flatland.node.services, flatland.node.browser_viewer\n"
        "print(sorted(m for m in sys.modules if m in ('aiohttp', 'flatland.web')))"
    )
    done = run_program([sys.executable, "-c", code], check=True)
    assert done.stdout.strip() == "[]"
