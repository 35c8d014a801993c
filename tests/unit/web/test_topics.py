"""Topics of other programs: what the server sends of them, and when it asks for them."""

from __future__ import annotations

import json
import struct
import threading
import zlib
from typing import Any

import numpy as np
import pytest
from raw_web_client import RawWebClient
from waiting import wait_until

from flatland.errors import FlatlandError
from flatland.web import WebViewer
from flatland.web.encoding import GRID, MARKS
from flatland.web.foreign_topics import Grid, Marks, Topic, TopicDemand, TopicUpdate

PLAN = Topic("/plan", "Path", "marks")
MAP = Topic("/map", "Grid", "grid", "no message received")
ODOM = Topic("/odom", "Odometry")
POSE_TOPICS = {"goal": ["/goal"], "initial_pose": ["/initialpose"]}


def line(x: float) -> Marks:
    """Returns a line of 1 m at an x coordinate, and a text."""
    none = Marks.none()
    return Marks(
        np.array([[x, 0, x + 1, 0, 0.5]], np.float32),
        np.array([[255, 0, 0, 128]], np.uint8),
        none.triangles,
        none.triangle_colors,
        [(1.0, 2.0, "text ä")],
    )


class Source:
    """Topics whose drawings and values the test sets.

    Attributes:
        demands: What was demanded, and None for each suspension.
        published: The poses that clients have sent.
    """

    def __init__(self) -> None:
        self.demands: list[TopicDemand | None] = []
        self.published: list[Any] = []
        self.topics = [PLAN, MAP, ODOM]
        self.fails = False
        self._lock = threading.Lock()
        self._drawings: dict[str, Any] = {}
        self._values: dict[str, Any] = {}

    def draw(self, **drawings: Any) -> None:
        with self._lock:
            self._drawings.update({f"/{name}": each for name, each in drawings.items()})

    def set_values(self, value: Any) -> None:
        with self._lock:
            self._values["/odom"] = value

    def update(self, demand: TopicDemand) -> TopicUpdate:
        self.demands.append(demand)
        if self.fails:
            raise RuntimeError("broken")
        with self._lock:
            drawings = {n: d for n, d in self._drawings.items() if n in demand.drawn}
            values = {n: v for n, v in self._values.items() if n in demand.inspected}
            for name in drawings:
                del self._drawings[name]
            for name in values:
                del self._values[name]
        return TopicUpdate(self.topics, POSE_TOPICS, drawings, values)  # type: ignore[arg-type]

    def suspend(self) -> None:
        self.demands.append(None)

    def publish_pose(self, kind: str, topic: str, pose: Any) -> bool:
        if topic not in POSE_TOPICS[kind]:
            raise FlatlandError("no such topic")
        self.published.append((kind, topic, pose))
        return kind == "goal"


@pytest.fixture
def source() -> Source:
    return Source()


@pytest.fixture
def url(world: Any, simulation: Any, source: Source, viewer: WebViewer) -> str:
    """Address of a viewer that shows the world and the topics."""
    viewer.add_world(world, "room", simulation, foreign_topics=source)
    return viewer.url


def test_topics_are_listed_for_clients_that_ask_for_them(url, source):
    with RawWebClient(url) as client:
        client.wait("status")
        assert source.demands == []
        client.ask("look", topics=[])
        message = client.wait("topics")
        numbers = [topic.pop("id") for topic in message["topics"]]
        assert len(set(numbers)) == 3
        assert message["topics"] == [
            {"topic": "/plan", "type": "Path", "drawn_as": "marks", "status": ""},
            {"topic": "/map", "type": "Grid", "drawn_as": "grid", "status": "no message received"},
            {"topic": "/odom", "type": "Odometry", "drawn_as": None, "status": ""},
        ]
        assert message["pose_topics"] == POSE_TOPICS
        source.topics = [ODOM]
        changed = client.wait("topics")
        assert [topic["id"] for topic in changed["topics"]] == numbers[2:]
    # Without clients, nothing is subscribed to.
    wait_until("a suspension", lambda: source.demands[-1] is None)


def test_marks_and_grids_are_sent_when_they_have_changed(url, source):
    cells = np.array([[0, 100, -1], [5, 6, 7]], np.int8)
    with RawWebClient(url) as client:
        client.ask("look", topics=["/plan", "/map"])
        listed = {each["topic"]: each["id"] for each in client.wait("topics")["topics"]}
        source.draw(plan=line(3))
        content = marks = client.wait(MARKS).payload
        assert struct.unpack_from("<3I", content) == (listed["/plan"], 1, 0)
        assert struct.unpack_from("<5f", content, 16) == (3, 0, 4, 0, 0.5)
        assert content[36:40] == bytes([255, 0, 0, 128])
        assert json.loads(content[40:]) == [[1, 2, "text ä"]]
        for pose in ((1.0, 2.0, 0.5), (1.0, 3.0, 0.5)):
            source.draw(map=Grid(pose, 0.25, cells))
            content = client.wait(GRID).payload
            assert struct.unpack_from("<3I4f", content) == (listed["/map"], 3, 2, *pose, 0.25)
            sent = np.frombuffer(zlib.decompress(content[28:]), np.int8)
            np.testing.assert_array_equal(sent, cells.ravel())
        # A client that looks later receives the latest drawings, and only those it looks at.
        with RawWebClient(url, look=False) as late:
            late.ask("look", worlds=[0], topics=["/plan"])
            assert late.wait(MARKS).payload == marks
            source.draw(plan=line(5))
            late.wait(MARKS)
            assert [each for each in late.received if getattr(each, "kind", 0) == GRID] == []
            # So does one that shows a topic again.
            client.wait(MARKS)
            client.ask("look", topics=["/map"])
            client.ask("look", topics=["/map", "/plan"])
            assert struct.unpack_from("<f", client.wait(MARKS).payload, 16) == (5,)
            # And one that was in the background.
            client.ask("look", hidden=True)
            client.ask("look", hidden=False)
            assert struct.unpack_from("<f", client.wait(MARKS).payload, 16) == (5,)


def test_values_are_sent_to_those_who_inspect_a_topic(url, source, world):
    with RawWebClient(url) as client, RawWebClient(url) as other:
        other.ask("look", topics=[])
        client.ask("look", topics=[], topic_values=["/odom"])
        source.set_values({"x": 1.5})
        message = client.wait("topic_values")
        assert (message["topic"], message["value"]) == ("/odom", {"x": 1.5})
        assert 0 <= message["time"] <= world.time
        source.topics = [ODOM]
        assert [m for m in other.receive_until("topics") if m_type(m) == "topic_values"] == []
        last = source.demands[-1]
        assert last == TopicDemand(frozenset(), frozenset(["/odom"]))


def m_type(message: Any) -> Any:
    return message["type"] if isinstance(message, dict) else message.kind


def test_a_failure_does_not_end_the_topics(client, source, caplog):
    source.fails = True
    client.ask("look", topics=[])
    wait_until("an error", lambda: "topics cannot be shown" in caplog.text)
    client.wait("status")
    source.fails = False
    client.wait("topics")


def test_poses_are_published(client, source):
    goal = {"purpose": "goal", "topic": "/goal", "pose": [1, 2, 0.5]}
    assert client.ask("publish_pose", **goal) == {"received": True}
    initial = {**goal, "purpose": "initial_pose", "topic": "/initialpose"}
    assert client.ask("publish_pose", **initial) == {"received": False}
    assert client.reply("publish_pose", **{**goal, "topic": "/x"})["error"] == "no such topic"
    assert source.published == [
        ("goal", "/goal", (1, 2, 0.5)),
        ("initial_pose", "/initialpose", (1, 2, 0.5)),
    ]


def test_a_program_without_topics_lists_none_and_publishes_none(world, simulation, viewer):
    viewer.add_world(world, "room", simulation)
    with RawWebClient(viewer.url) as client:
        client.ask("look", topics=[], topic_values=["/odom"])
        goal = {"purpose": "goal", "topic": "/goal", "pose": [1, 2, 0.5]}
        assert "not connected" in client.reply("publish_pose", **goal)["error"]
        client.wait("status")
        assert "topics" not in [m_type(message) for message in client.received]
