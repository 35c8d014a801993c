"""Debug markers of all layers and of all models on fixed topics.

The configuration of RViz contains fixed topics, while models are added and deleted. These topics
are not listed in `~debug/topics`; otherwise, clients that follow the list would display everything
twice.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Final

from flatland.node.markers.layer_markers import LayerMarkers
from flatland.node.markers.model_markers import ModelMarkers
from flatland.node.markers.packed_markers import NewWriter, PackedMarkers, join
from flatland.node.transport import StateTopic

LAYERS: Final = "all_layers"
WALLS: Final = "all_layers_3d"
MODELS: Final = "all_models"
DELETION_TIME: Final = 0.5  # s of wall time during which a deletion is repeated

Make = Callable[[int], bytes]
"""Returns a serialized MarkerArray; the argument is the stamp, simulated time [ns]."""


OpenTopic = Callable[[str, Make, bool], StateTopic]
"""Advertises a topic; the last argument is whether `send_models` publishes on it periodically."""


class CombinedMarkers:
    """Publishes the markers of a world on three topics: layers as lines, layers as walls, models.

    The namespace of a marker is the name of its layer or model, so that RViz can
    hide each layer and model individually.
    """

    def __init__(
        self,
        layers: Mapping[str, LayerMarkers],
        models: Mapping[str, ModelMarkers],
        open_topic: OpenTopic,
        writer: NewWriter,
    ) -> None:
        """Advertises the topics.

        Args:
            layers: Markers of all layers by name; may change.
            models: Markers of all models by name; may change.
            open_topic: Advertises a topic in the namespace of the debug topics.
            writer: Creates the writer of a message.
        """
        self._writer = writer
        self._layers = layers
        self._models = models
        self._delete_until = 0.0  # s, time.monotonic
        self._lines = open_topic(LAYERS, partial(self._join_layers, LayerMarkers.lines), False)
        self._walls = open_topic(WALLS, partial(self._join_layers, LayerMarkers.walls), False)
        self._all_models = open_topic(MODELS, self._join_models, True)

    def send_layers(self) -> None:
        """Publishes all layers."""
        self._lines.send()
        self._walls.send()

    def send_models(self) -> bool:
        """Publishes all models; returns whether the topic has subscribers."""
        self._all_models.send()
        return self._all_models.connected

    def delete_models(self) -> None:
        """Deletes markers of removed models with the messages of the next `DELETION_TIME`."""
        # A slow client may miss messages, so that a single deletion is not enough.
        self._delete_until = time.monotonic() + DELETION_TIME

    def _join_layers(
        self, make: Callable[[LayerMarkers, int], PackedMarkers], time_ns: int
    ) -> bytes:
        # A layer may have lost all edges and with them its marker, so that all are deleted first.
        parts = [make(layer, time_ns) for layer in self._layers.values()]
        return join([PackedMarkers.deletion_of_all(self._writer), *parts], self._writer)

    def _join_models(self, time_ns: int) -> bytes:
        parts = [markers.message(time_ns) for markers in self._models.values()]
        if time.monotonic() < self._delete_until:
            parts.insert(0, PackedMarkers.deletion_of_all(self._writer))
        return join(parts, self._writer)
