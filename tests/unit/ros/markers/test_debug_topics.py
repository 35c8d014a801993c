"""The topics of debug markers, which the test ticks and whose messages it reads."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("visualization_msgs", reason="ROS is not installed")

from visualization_msgs.msg import Marker, MarkerArray

from flatland.errors import FlatlandError
from flatland.node.markers import combined_markers, debug_topics
from flatland.node.markers.combined_markers import DELETION_TIME
from flatland.node.markers.debug_topics import CLOSE_DELAY, DebugTopics
from flatland.node.values import DebugTopicNames
from flatland.ros.adapters.writer import RosWriter

BALL = "bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]"
WORLD = """
properties: {}
layers: [{name: 2d, map: map.yaml}, {name: empty}]
models:
  - {name: a, model: ball.model.yaml, pose: [20, 0, 0]}
  - {name: ä, model: ball.model.yaml, pose: [30, 0, 0]}
"""


class Topic:
    """A topic whose messages are kept.

    Attributes:
        sent: The markers of each message, or the names of topics.
        changed: Called when a subscriber has connected or disconnected; None for no function.
    """

    def __init__(self, name: str, make: Callable[[], Any], changed: Any) -> None:
        self.topic = name
        self.make = make
        self.changed = changed
        self.connected = False
        self.closed = False
        self.sent: list[Any] = []

    def send(self) -> None:
        message = self.make()
        if isinstance(message, bytes):
            message = MarkerArray().deserialize(message).markers
        self.sent.append(message)

    def replace(self, make: Callable[[], Any]) -> None:
        self.make = make
        self.send()

    def close(self) -> None:
        self.closed = True


class Setup:
    """Debug topics, whose ticks and time are those of the test.

    Attributes:
        topics: Topics by name, without the namespace.
        used: Names that plugins use for other types of messages.
    """

    def __init__(self, files: Any, monkeypatch: pytest.MonkeyPatch) -> None:
        files.write("ball.model.yaml", BALL)
        files.write_map("map", ["###", "#.#", "###"])
        self.world = files.load(WORLD)
        self.now = 100.0
        self.topics: dict[str, Topic] = {}
        self.used: set[str] = set()
        self.woken = 0
        self.ticker: tuple[Any, ...] = ()
        self.ticker_closed = False
        clock = SimpleNamespace(monotonic=lambda: self.now)
        monkeypatch.setattr(debug_topics, "time", clock)
        monkeypatch.setattr(combined_markers, "time", clock)
        monkeypatch.setattr(debug_topics, "Ticker", self._ticker)
        simulation: Any = SimpleNamespace(world=self.world, post="post")
        transport: Any = self
        thread: Any = "thread"
        self.debug = DebugTopics(transport, simulation, 30.0, thread)

    def _ticker(self, *arguments: Any) -> Any:
        self.ticker = arguments
        return SimpleNamespace(wake=self._wake, close=lambda: setattr(self, "ticker_closed", True))

    def _wake(self) -> None:
        self.woken += 1

    # -- the transport

    def writer(self) -> RosWriter:
        return RosWriter()

    def message_class(self, name: str) -> str:
        return name

    def state_of(self, name: str, kind: type[Any], make: Any, post: str) -> Topic:
        assert (kind, post) == (DebugTopicNames, "post")
        return self._open(name, make, None)

    def advertise_state(self, name: str, kind: str, make: Any, post: str, changed: Any) -> Topic:
        assert (kind, post) == ("visualization_msgs/MarkerArray", "post")
        return self._open(name, make, changed)

    def _open(self, name: str, make: Any, changed: Any) -> Topic:
        name = name.removeprefix("~debug/")
        if name in self.used:
            raise FlatlandError("another type")
        self.topics[name] = Topic(name, make, changed)
        return self.topics[name]

    # -- the topics

    def names(self) -> list[str]:
        """Returns the names in the last message of the list of topics."""
        return list(self.topics["topics"].sent[-1])

    def tick(self, seconds: float = 0.0) -> bool:
        self.now += seconds
        return self.debug._tick(self.now)

    def sent(self, name: str) -> int:
        return len(self.topics[name].sent)


@pytest.fixture
def setup(files: Any, monkeypatch: pytest.MonkeyPatch) -> Setup:
    return Setup(files, monkeypatch)


def namespaces(markers: list[Marker]) -> set[str]:
    return {marker.ns for marker in markers if marker.action == Marker.ADD}


def test_each_layer_and_model_has_topics_of_its_own(
    setup: Setup, caplog: pytest.LogCaptureFixture
) -> None:
    layers = ["layer/2d", "layer/2d_3d", "layer/empty", "layer/empty_3d"]
    models = ["model/a", "model/_"]
    combined = ["all_layers", "all_layers_3d", "all_models"]
    assert list(setup.topics) == ["topics", *layers, *models, *combined]
    assert list(setup.topics["topics"].make()) == [*layers, *models]
    assert setup.ticker == ("flatland-markers", 30.0, "post", setup.debug._tick, "thread")
    warnings = [each for each in caplog.get_records("setup") if each.levelname == "WARNING"]
    assert [record.getMessage() for record in warnings] == [
        'model "ä" is published on topic "model/_": its name is not a legal ROS name, or is in use'
    ]
    # Only the markers of models are published periodically.
    periodic = {name for name, topic in setup.topics.items() if topic.changed is not None}
    assert periodic == {*models, "all_models"}
    for name in periodic:
        setup.topics[name].changed(True)
    assert setup.woken == 3


def test_markers_have_the_current_time(setup: Setup) -> None:
    setup.world.step(3)
    for topic in list(setup.topics.values())[1:]:
        topic.send()
        stamps = {marker.header.stamp.to_nsec() for marker in topic.sent[0]}
        assert stamps - {0} in ({15_000_000}, set())
    topics = setup.topics
    assert namespaces(topics["layer/2d"].sent[0]) == {"2d"}
    assert [marker.type for marker in topics["layer/2d"].sent[0]] == [Marker.LINE_LIST]
    assert [marker.type for marker in topics["layer/2d_3d"].sent[0]] == [Marker.TRIANGLE_LIST]
    assert topics["layer/empty"].sent[0] == []
    assert namespaces(topics["model/a"].sent[0]) == {"a"}
    for name, kind in (("all_layers", Marker.LINE_LIST), ("all_layers_3d", Marker.TRIANGLE_LIST)):
        # A layer may have lost its walls, so that all markers are deleted first.
        first, *others = topics[name].sent[0]
        assert first.action == Marker.DELETEALL
        assert [(marker.ns, marker.type) for marker in others] == [("2d", kind)]
    assert namespaces(topics["all_models"].sent[0]) == {"a", "ä"}
    assert all(marker.action == Marker.ADD for marker in topics["all_models"].sent[0])


def test_models_are_published_while_there_are_subscribers(setup: Setup) -> None:
    for name in ("model/a", "model/_", "all_models"):
        before = setup.sent(name)
        setup.topics[name].connected = True
        assert setup.tick()
        assert setup.sent(name) == before + 1
        setup.topics[name].connected = False
    assert not setup.tick()
    setup.topics["layer/2d"].connected = True
    assert not setup.tick()
    assert setup.sent("layer/2d") == 0


def test_a_layer_is_published_when_it_changes(setup: Setup) -> None:
    setup.world.layer("empty").add_edges([(0.0, 0.0, 1.0, 0.0)])
    setup.debug.layer_changed("empty")
    for name in ("layer/empty", "layer/empty_3d"):
        assert namespaces(setup.topics[name].sent[-1]) == {"empty"}
    for name in ("all_layers", "all_layers_3d"):
        assert namespaces(setup.topics[name].sent[-1]) == {"2d", "empty"}
    assert setup.sent("layer/2d") == setup.sent("topics") == 0


def test_a_new_layer_gets_topics(setup: Setup) -> None:
    layer = setup.debug._layers.pop("empty")
    for entry in layer:
        setup.debug._names.release(entry.name)
    setup.debug.layer_changed("empty")
    layers = ["layer/2d", "layer/2d_3d", "layer/empty", "layer/empty_3d"]
    assert setup.names() == [*layers, "model/a", "model/_"]
    assert setup.sent("all_layers") == 1


def test_a_new_model_gets_a_topic(setup: Setup) -> None:
    setup.world.spawn_model("ball.model.yaml", "b", pose=(0.0, 5.0, 0.0))
    assert setup.names()[-3:] == ["model/a", "model/_", "model/b"]
    setup.topics["model/b"].send()
    assert namespaces(setup.topics["model/b"].sent[0]) == {"b"}
    setup.tick()
    assert namespaces(setup.topics["all_models"].sent[-1]) == {"a", "ä", "b"}


def test_a_name_that_a_plugin_uses_is_avoided(
    setup: Setup, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.clear()
    setup.used = {"model/b"}
    setup.world.spawn_model("ball.model.yaml", "b", pose=(0.0, 5.0, 0.0))
    name = setup.names()[-1]
    assert name.startswith("model/b")
    assert name != "model/b"
    assert f'model "b" is published on topic "{name}"' in caplog.text


def test_the_markers_of_a_deleted_model_are_deleted_before_its_topic_ends(setup: Setup) -> None:
    setup.tick()
    topic = setup.topics["model/a"]
    woken = setup.woken
    setup.world.delete_model("a")
    assert [marker.action for marker in topic.sent[-1]] == [Marker.DELETEALL]
    assert "model/a" not in setup.names()
    assert setup.woken == woken + 1
    assert setup.tick(CLOSE_DELAY - 0.01)
    assert not topic.closed
    first, *others = setup.topics["all_models"].sent[-1]
    assert first.action == Marker.DELETEALL
    assert {marker.ns for marker in others} == {"ä"}
    assert not setup.tick(0.02)
    assert topic.closed
    # A slow client may have missed messages: the deletion is repeated for some time.
    setup.tick(DELETION_TIME - CLOSE_DELAY - 0.02)
    assert setup.topics["all_models"].sent[-1][0].action == Marker.DELETEALL
    setup.tick(0.02)
    assert setup.topics["all_models"].sent[-1][0].action == Marker.ADD


def test_a_model_that_returns_at_once_keeps_its_topic(setup: Setup) -> None:
    topic = setup.topics["model/a"]
    setup.world.delete_model("a")
    setup.world.spawn_model("ball.model.yaml", "a", pose=(0.0, 5.0, 0.0))
    assert setup.topics["model/a"] is topic
    assert namespaces(topic.sent[-1]) == {"a"}
    setup.tick(2 * CLOSE_DELAY)
    assert not topic.closed
    assert setup.names()[-1] == "model/a"


def test_nothing_is_published_after_the_end(setup: Setup) -> None:
    setup.debug.close()
    assert setup.ticker_closed
    opened = list(setup.topics)
    setup.world.spawn_model("ball.model.yaml", "b", pose=(0.0, 5.0, 0.0))
    setup.world.delete_model("a")
    setup.world.layer("empty").add_edges([(0.0, 0.0, 1.0, 0.0)])
    setup.debug.layer_changed("empty")
    assert list(setup.topics) == opened
    assert all(topic.sent == [] for topic in setup.topics.values())
