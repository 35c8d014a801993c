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
from flatland.ros.transport.master_watch import LimitedTransport

NODE_URI = "http://127.0.0.1:1"


def publish(topic: str, kind: str) -> None:
    rosgraph.Master("/n").registerPublisher(topic, kind, NODE_URI)


def subscribe(node: str, topic: str, kind: str) -> None:
    rosgraph.Master(node).registerSubscriber(topic, kind, NODE_URI)


def test_topics_are_those_of_the_last_response(
    master: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [500.0]
    limits: list[float] = []

    def transport(timeout: float) -> LimitedTransport:
        limits.append(timeout)
        return LimitedTransport(timeout)

    monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: now[0]))
    monkeypatch.setattr(module, "LimitedTransport", transport)
    graph = Graph("/node")
    assert (graph.published, graph.subscribed) == ({}, {})
    for topic, kind in (("/b", "t/B"), ("/a", "t/A"), ("/any", "*")):
        publish(topic, kind)
    for node, topic, kind in (
        *(("/x", "/late", "*"), ("/x", "/b", "t/B"), ("/y", "/b", "t/B"), ("/x", "/a", "t/A")),
    ):
        subscribe(node, topic, kind)
    graph.refresh()
    assert list(graph.published.items()) == [("/a", "t/A"), ("/b", "t/B")]
    assert list(graph.subscribed.items()) == [
        ("/a", ("t/A", frozenset({"/x"}))),
        ("/b", ("t/B", frozenset({"/x", "/y"}))),
        ("/late", ("*", frozenset({"/x"}))),
    ]
    publish("/c", "t/C")
    now[0] += 0.99
    graph.refresh()
    assert "/c" not in graph.published
    now[0] += 0.01
    graph.refresh()
    assert "/c" in graph.published
    now[0] += 1.0
    master.stop()
    graph.refresh()
    assert "/c" in graph.published
    # The next master is not asked before the period is over.
    master.start()
    graph.refresh()
    assert "/c" in graph.published
    now[0] += 1.0
    graph.refresh()
    assert (graph.published, graph.subscribed) == ({}, {})
    assert set(limits) == {2.0}
    assert graph.pose_topics == {"goal": "move_base_simple/goal", "initial_pose": "initialpose"}


def test_classes_of_messages_are_those_of_adapters_first(
    master: Any, monkeypatch: pytest.MonkeyPatch
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


def test_the_time_is_that_of_the_node(master: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rospy, "get_rostime", lambda: rospy.Time(7, 5))
    assert Graph("/node").now() == 7_000_000_005
