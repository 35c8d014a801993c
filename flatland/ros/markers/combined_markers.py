"""Debug markers of all layers and of all models on fixed topics.

The configuration of RViz contains fixed topics, while models are added and deleted. These topics
are not listed in `~debug/topics`; otherwise, clients that follow the list would display everything
twice.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from visualization_msgs.msg import MarkerArray

from flatland.entities.layer import Layer
from flatland.entities.model import Model
from flatland.ros.markers.layer_markers import LayerMarkers
from flatland.ros.markers.model_markers import ModelMarkers
from flatland.ros.markers.packed_markers import JoinedMarkers, PackedMarkers
from flatland.ros.transport.registrar import Registrar
from flatland.ros.transport.state_topic import StateTopic
from flatland.ros.transport.ticker import Ticker, TickerThread
from flatland.runtime.observer import WorldObserver
from flatland.simulation import Simulation

LAYERS: Final = "~debug/all_layers"
WALLS: Final = "~debug/all_layers_3d"
MODELS: Final = "~debug/all_models"
DELETION_TIME: Final = 0.5  # s of wall time during which a deletion is repeated


class CombinedMarkers(WorldObserver):
    """Publishes the markers of a world on three topics: layers as lines, layers as walls, models.

    The namespace of a marker is the name of its layer or model, so that each can be hidden
    individually in RViz.
    """

    def __init__(
        self, registrar: Registrar, simulation: Simulation, rate: float, thread: TickerThread
    ) -> None:
        """Advertises the topics asynchronously; must be called between two steps.

        Args:
            registrar: Registers the topics with the ROS master.
            simulation: Simulation of the world.
            rate: Rate of the model markers in wall time [Hz].
            thread: Posts the periodic work.
        """
        self._world = simulation.world
        self._closed = False
        self._layers: dict[str, LayerMarkers] = {}
        self._models: dict[str, ModelMarkers] = {}
        self._delete_until = 0.0  # s, time.monotonic
        self._ticker = Ticker("flatland-all-markers", rate, simulation.post, self._tick, thread)

        def topic(
            name: str, make: Callable[[], JoinedMarkers], *, periodic: bool = False
        ) -> StateTopic:
            return StateTopic(
                registrar,
                name,
                MarkerArray,
                lambda: make().packed,
                simulation.post,
                on_connection=(lambda _connected: self._ticker.wake()) if periodic else None,
            )

        for layer in self._world.layers:
            self._add_layer(layer)
        for model in self._world.models:
            self.model_added(model)
        self._lines = topic(LAYERS, lambda: self._join_layers(LayerMarkers.lines))
        self._walls = topic(WALLS, lambda: self._join_layers(LayerMarkers.walls))
        self._all_models = topic(MODELS, self._join_models, periodic=True)
        self._world.add_observer(self)

    def close(self) -> None:
        """Stops publishing; rospy unregisters all topics at shutdown."""
        self._closed = True
        self._ticker.close()

    # -- events of the world ---------------------------------------------------------------

    def layer_changed(self, layer_name: str) -> None:
        """Publishes all layers."""
        if self._closed:
            return
        if layer_name not in self._layers:
            self._add_layer(self._world.layer(layer_name))
        self._lines.send()
        self._walls.send()

    def model_added(self, model: Model) -> None:
        """Adds the markers of a model to the next message."""
        self._models[model.name] = ModelMarkers(model)

    def model_removed(self, model: Model) -> None:
        """Removes the markers of a model from the next message."""
        self._models.pop(model.name, None)
        # A slow client may miss messages, so that a single deletion is not enough.
        self._delete_until = time.monotonic() + DELETION_TIME

    def _add_layer(self, layer: Layer) -> None:
        self._layers[layer.name] = LayerMarkers(layer)

    # -- messages --------------------------------------------------------------------------

    def _join_layers(self, make: Callable[[LayerMarkers, int], PackedMarkers]) -> JoinedMarkers:
        # Delete all first: a layer may have lost all its edges and with them its marker.
        parts = [
            PackedMarkers.deletion_of_all(),
            *(make(each, self._time_ns) for each in self._layers.values()),
        ]
        return JoinedMarkers(parts)

    def _join_models(self) -> JoinedMarkers:
        parts = [markers.message(self._time_ns) for markers in self._models.values()]
        if time.monotonic() < self._delete_until:
            parts.insert(0, PackedMarkers.deletion_of_all())
        return JoinedMarkers(parts)

    @property
    def _time_ns(self) -> int:
        return self._world.timekeeper.sim_time_ns

    def _tick(self, _now: float) -> bool:
        self._all_models.send()
        return self._all_models.connected
