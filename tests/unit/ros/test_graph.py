"""What the ROS master knows about topics."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("rospy", reason="ROS is not installed")

import genpy.message
import rosgraph
import rospy
from nav_msgs.msg import OccupancyGrid, Path

from flatland.ros import graph as module
from flatland.ros.graph import Graph

URI = "http://robot:11311"


class Master:
    """A master that responds with `state` and `types`, or with an error."""

    def __init__(self) -> None:
        self.state: Any = [[], [], []]
        self.types: list[list[str]] = []
        self.error: Exception | None = None
        self.asked = 0
        self.open = 0
        self.limits: list[float] = []

    def proxy(self, uri: str, transport: Any) -> Any:
        assert uri == URI
        self.limits.append(transport._timeout)
        return self

    def __enter__(self) -> Any:
        self.open += 1
        return self

    def __exit__(self, *_: object) -> None:
        self.open -= 1

    def calls(self, master: Any) -> Any:
        assert master is self
        names: list[str] = []

        class Calls:
            def getSystemState(self, caller: str) -> None:  # noqa: N802
                names.append(f"state for {caller}")

            def getTopicTypes(self, caller: str) -> None:  # noqa: N802
                names.append(f"types for {caller}")

            def __call__(calls: Any) -> Any:  # noqa: N805
                assert names == ["state for /node", "types for /node"]
                self.asked += 1
                if self.error is not None:
                    raise self.error
                return [[1, "", self.state], [1, "", self.types]]

        return Calls()


@pytest.fixture
def master(monkeypatch: pytest.MonkeyPatch) -> Master:
    master = Master()
    monkeypatch.setattr(rosgraph, "get_master_uri", lambda: URI)
    monkeypatch.setattr(module, "ServerProxy", master.proxy)
    monkeypatch.setattr(module, "MultiCall", master.calls)
    return master


def test_topics_are_those_of_the_last_response(
    master: Master, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [500.0]
    monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: now[0]))
    graph = Graph("/node")
    assert (graph.published, graph.subscribed) == ({}, {})
    master.state = [
        [["/b", ["/n"]], ["/a", ["/n"]], ["/any", ["/n"]], ["/unknown", ["/n"]]],
        [["/b", ["/x", "/y"]], ["/a", ["/x"]], ["/late", ["/z"]]],
        [["/service", ["/n"]]],
    ]
    master.types = [["/a", "t/A"], ["/b", "t/B"], ["/any", "*"]]
    graph.refresh()
    assert list(graph.published.items()) == [("/a", "t/A"), ("/b", "t/B")]
    assert list(graph.subscribed.items()) == [
        ("/a", ("t/A", frozenset({"/x"}))),
        ("/b", ("t/B", frozenset({"/x", "/y"}))),
        ("/late", ("*", frozenset({"/z"}))),
    ]
    before = graph.published
    now[0] += 0.99
    graph.refresh()
    assert master.asked == 1
    now[0] += 0.01
    master.error = OSError("refused")
    graph.refresh()
    graph.refresh()
    assert master.asked == 2
    assert graph.published is before
    now[0] += 1.0
    master.error, master.state = None, [[], [], []]
    graph.refresh()
    assert (graph.published, graph.subscribed) == ({}, {})
    assert set(master.limits) == {2.0}
    assert master.open == 0
    assert graph.pose_topics == {"goal": "move_base_simple/goal", "initial_pose": "initialpose"}


def test_classes_of_messages_are_those_of_adapters_first(
    master: Master, monkeypatch: pytest.MonkeyPatch
) -> None:
    graph = Graph("/node")
    assert graph.message_classes("nav_msgs/Path") == [Path]
    with_arrays, plain = graph.message_classes("nav_msgs/OccupancyGrid")
    assert plain is OccupancyGrid
    assert with_arrays is not plain
    assert issubclass(with_arrays, plain)
    for unknown in ("no_such_msgs/Thing", "nav_msgs/Thing", "nav_msgs"):
        assert graph.message_classes(unknown) == []
    monkeypatch.setattr(genpy.message, "get_message_class", lambda _: None)
    assert graph.message_classes("nav_msgs/Path") == [Path]


def test_the_time_is_that_of_the_node(master: Master, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rospy, "get_rostime", lambda: rospy.Time(7, 5))
    assert Graph("/node").now() == 7_000_000_005
