"""Debug markers: one topic per layer and per model, for RViz and the viewer."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from visualization_msgs.msg import MarkerArray

from flatland.entities.layer import Layer
from flatland.entities.model import Model
from flatland.errors import FlatlandError
from flatland.ros.markers.layer_markers import LayerMarkers
from flatland.ros.markers.model_markers import ModelMarkers
from flatland.ros.markers.packed_markers import PackedMarkers
from flatland.ros.message_types import message_class
from flatland.ros.names import UniqueNames, legal_name
from flatland.ros.transport.registrar import Registrar
from flatland.ros.transport.state_topic import StateTopic
from flatland.ros.transport.ticker import Ticker, TickerThread
from flatland.runtime.observer import WorldObserver
from flatland.simulation import Simulation

_LOG = logging.getLogger("flatland")

NAMESPACE: Final = "~debug"
_DebugTopicList = message_class("DebugTopicList")
CLOSE_DELAY: Final = 0.2  # s of wall time between the last message and the end of a topic


@dataclass(frozen=True, slots=True)
class _Entry:
    """A marker topic and its name relative to the namespace."""

    name: str
    topic: StateTopic


class DebugTopics(WorldObserver):
    """Publishes the markers of each layer and each model on a topic of its own.

    Markers are created only for topics with subscribers. A new subscriber receives the current
    state, even if the world is paused.
    """

    def __init__(
        self, registrar: Registrar, simulation: Simulation, rate: float, thread: TickerThread
    ) -> None:
        """Advertises the topics asynchronously; must be called between two steps.

        Args:
            registrar: Registers the topics with the ROS master.
            simulation: Simulation of the world.
            rate: Rate of the markers of each model in wall time [Hz].
            thread: Posts the periodic work.
        """
        self._registrar = registrar
        self._post = simulation.post
        self._world = simulation.world
        self._closed = False
        self._names = UniqueNames()
        self._layers: dict[str, list[_Entry]] = {}
        self._models: dict[str, _Entry] = {}
        self._closing: dict[str, tuple[StateTopic, float]] = {}  # by name, with the closing time
        self._ticker = Ticker("flatland-markers", rate, self._post, self._tick, thread)
        self._topics = self._open("topics", _DebugTopicList, self._topic_list)
        for layer in self._world.layers:
            self._add_layer(layer)
        for model in self._world.models:
            self._add_model(model)
        self._world.add_observer(self)

    def close(self) -> None:
        """Stops publishing; rospy unregisters all topics at shutdown."""
        self._closed = True
        self._ticker.close()

    # -- events of the world ---------------------------------------------------------------

    def layer_changed(self, layer_name: str) -> None:
        """Publishes a layer."""
        if self._closed:
            return
        if layer_name in self._layers:
            for entry in self._layers[layer_name]:
                entry.topic.send()
        else:
            self._add_layer(self._world.layer(layer_name))
            self._topics.send()

    def model_added(self, model: Model) -> None:
        """Advertises the topic of a model."""
        if not self._closed:
            self._add_model(model)
            self._topics.send()

    def model_removed(self, model: Model) -> None:
        """Deletes the markers of a model, and its topic after `CLOSE_DELAY`."""
        entry = self._models.pop(model.name, None)
        if entry is None or self._closed:
            return
        self._names.release(entry.name)
        entry.topic.replace(self._with_time(PackedMarkers.deletion_of_all))
        self._closing[entry.name] = entry.topic, time.monotonic() + CLOSE_DELAY
        self._topics.send()
        self._ticker.wake()

    def _add_layer(self, layer: Layer) -> None:
        markers = LayerMarkers(layer)
        self._layers[layer.name] = [
            self._open_entry("layer", layer.name, "", markers.lines),
            self._open_entry("layer", layer.name, "_3d", markers.walls),
        ]

    def _add_model(self, model: Model) -> None:
        markers = ModelMarkers(model)
        self._models[model.name] = self._open_entry(
            "model", model.name, "", markers.message, lambda _connected: self._ticker.wake()
        )

    # -- topics ----------------------------------------------------------------------------

    def _open_entry(
        self,
        kind: str,
        name: str,
        suffix: str,
        make: Callable[[int], PackedMarkers],
        on_connection: Callable[[bool], None] | None = None,
    ) -> _Entry:
        """Advertises the markers of a layer or a model under an unused legal name."""
        preferred = f"{kind}/{legal_name(name)}{suffix}"
        while True:
            claimed = self._names.claim(preferred)
            if claimed in self._closing:
                topic, _due = self._closing.pop(claimed)
                topic.replace(self._with_time(make))
            else:
                try:
                    topic = self._open(claimed, MarkerArray, self._with_time(make), on_connection)
                except FlatlandError:
                    continue  # A plugin uses the topic for another message type.
            if claimed != f"{kind}/{name}{suffix}":
                _LOG.warning(
                    '%s "%s" is published on topic "%s": '
                    "its name is not a legal ROS name, or is in use",
                    kind,
                    name,
                    topic.topic,
                )
            return _Entry(claimed, topic)

    def _open(
        self,
        name: str,
        message_type: type[Any],
        make: Callable[[], Any],
        on_connection: Callable[[bool], None] | None = None,
    ) -> StateTopic:
        return StateTopic(
            self._registrar,
            f"{NAMESPACE}/{name}",
            message_type,
            make,
            self._post,
            on_connection=on_connection,
        )

    def _with_time(self, make: Callable[[int], PackedMarkers]) -> Callable[[], bytes]:
        return lambda: make(self._world.timekeeper.sim_time_ns).packed

    def _topic_list(self) -> Any:
        layers = [entry for entries in self._layers.values() for entry in entries]
        return _DebugTopicList([entry.name for entry in (*layers, *self._models.values())])

    def _tick(self, now: float) -> bool:
        """Publishes the models and closes the topics of deleted models."""
        for name in [name for name, (_topic, due) in self._closing.items() if due <= now]:
            self._closing.pop(name)[0].close()
        for entry in self._models.values():
            entry.topic.send()
        return bool(self._closing) or any(entry.topic.connected for entry in self._models.values())
