"""Debug markers for RViz and the viewer: one topic per layer and per model, and combined topics."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from flatland.entities.layer import Layer
from flatland.entities.model import Model
from flatland.errors import FlatlandError
from flatland.node.markers.combined_markers import CombinedMarkers, Make
from flatland.node.markers.layer_markers import LayerMarkers
from flatland.node.markers.model_markers import ModelMarkers
from flatland.node.markers.packed_markers import PackedMarkers
from flatland.node.names import UniqueNames, legal_name
from flatland.node.ticker import Ticker, TickerThread
from flatland.node.transport import MARKERS, StateTopic, Transport
from flatland.node.values import DebugTopicNames
from flatland.runtime.observer import WorldObserver
from flatland.simulation import Simulation

_LOG = logging.getLogger("flatland")

NAMESPACE: Final = "~debug"
CLOSE_DELAY: Final = 0.2  # s of wall time between the last message and the end of a topic


@dataclass(frozen=True, slots=True)
class _Entry:
    """A marker topic and its name relative to the namespace."""

    name: str
    topic: StateTopic


class DebugTopics(WorldObserver):
    """Publishes the markers of each layer and each model on separate and on combined topics.

    Markers are created only for topics with subscribers. A new subscriber receives the current
    state, even if the world is paused.
    """

    def __init__(
        self, transport: Transport, simulation: Simulation, rate: float, thread: TickerThread
    ) -> None:
        """Advertises the topics asynchronously; must be called between two steps.

        Args:
            transport: Publishes the topics.
            simulation: Simulation of the world.
            rate: Rate of the markers of each model in wall time [Hz].
            thread: Posts the periodic work.
        """
        self._transport = transport
        self._post = simulation.post
        self._world = simulation.world
        self._closed = False
        self._names = UniqueNames()
        self._layer_markers: dict[str, LayerMarkers] = {}
        self._model_markers: dict[str, ModelMarkers] = {}
        self._layers: dict[str, list[_Entry]] = {}
        self._models: dict[str, _Entry] = {}
        self._closing: dict[str, tuple[StateTopic, float]] = {}  # by name, with the closing time
        self._ticker = Ticker("flatland-markers", rate, self._post, self._tick, thread)
        self._topics = transport.state_of(
            f"{NAMESPACE}/topics", DebugTopicNames, self._topic_names, self._post
        )
        for layer in self._world.layers:
            self._add_layer(layer)
        for model in self._world.models:
            self._add_model(model)
        self._combined = CombinedMarkers(
            self._layer_markers, self._model_markers, self._open_markers, transport.writer
        )
        self._world.add_observer(self)

    def close(self) -> None:
        """Stops publishing; all topics are closed at shutdown."""
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
        self._combined.send_layers()

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
        del self._model_markers[model.name]
        self._combined.delete_models()
        self._names.release(entry.name)
        entry.topic.replace(
            self._with_time(
                lambda time_ns: (
                    PackedMarkers.deletion_of_all(self._transport.writer, time_ns).packed
                )
            )
        )
        self._closing[entry.name] = entry.topic, time.monotonic() + CLOSE_DELAY
        self._topics.send()
        self._ticker.wake()

    def _add_layer(self, layer: Layer) -> None:
        markers = self._layer_markers[layer.name] = LayerMarkers(layer, self._transport.writer)
        self._layers[layer.name] = [
            self._open_entry("layer", layer.name, "", lambda ns: markers.lines(ns).packed),
            self._open_entry("layer", layer.name, "_3d", lambda ns: markers.walls(ns).packed),
        ]

    def _add_model(self, model: Model) -> None:
        markers = self._model_markers[model.name] = ModelMarkers(model, self._transport.writer)
        self._models[model.name] = self._open_entry(
            "model", model.name, "", lambda ns: markers.message(ns).packed, periodic=True
        )

    # -- topics ----------------------------------------------------------------------------

    def _open_entry(
        self,
        kind: str,
        name: str,
        suffix: str,
        make: Make,
        *,
        periodic: bool = False,
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
                    topic = self._open_markers(claimed, make, periodic)
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

    def _open_markers(self, name: str, make: Make, periodic: bool) -> StateTopic:
        return self._transport.advertise_state(
            f"{NAMESPACE}/{name}",
            self._transport.message_class(MARKERS),
            self._with_time(make),
            self._post,
            (lambda _connected: self._ticker.wake()) if periodic else None,
        )

    def _with_time(self, make: Make) -> Callable[[], bytes]:
        return lambda: make(self._world.timekeeper.sim_time_ns)

    def _topic_names(self) -> DebugTopicNames:
        layers = [entry for entries in self._layers.values() for entry in entries]
        return DebugTopicNames(entry.name for entry in (*layers, *self._models.values()))

    def _tick(self, now: float) -> bool:
        """Publishes the models and closes the topics of deleted models."""
        for name in [name for name, (_topic, due) in self._closing.items() if due <= now]:
            self._closing.pop(name)[0].close()
        for entry in self._models.values():
            entry.topic.send()
        connected = self._combined.send_models()
        connected = connected or any(entry.topic.connected for entry in self._models.values())
        return connected or bool(self._closing)
