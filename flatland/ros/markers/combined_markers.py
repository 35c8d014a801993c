"""All debug markers of a kind on one topic, for clients that cannot follow `~debug/topics`.

RViz's configuration holds fixed topics, while models come and go. These topics bring it all
layers and all models, with no other program between. They are not in `~debug/topics`: whoever
reads that list would show everything twice.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from visualization_msgs.msg import MarkerArray

from flatland.layer import Layer
from flatland.model import Model
from flatland.observer import WorldObserver
from flatland.ros.markers.layer_markers import LayerMarkers
from flatland.ros.markers.model_markers import ModelMarkers
from flatland.ros.markers.packed_markers import JoinedMarkers, PackedMarkers
from flatland.ros.registrar import Registrar
from flatland.ros.ticker import Ticker
from flatland.ros.transport.state_topic import LatchedTopic
from flatland.simulation import Simulation

LAYERS: Final = "~debug/all_layers"
WALLS: Final = "~debug/all_layers_3d"
MODELS: Final = "~debug/all_models"
FAREWELL_TIME: Final = 0.5  # s of wall time for which a deletion is repeated


class CombinedMarkers(WorldObserver):
    """Shows a world on three topics: the lines of all layers, their walls, and all models.

    Markers keep the name of their layer or model as their namespace, so each can be switched on
    and off in RViz.
    """

    def __init__(self, registrar: Registrar, simulation: Simulation, rate: float) -> None:
        """Advertises the topics; between two steps.

        Args:
            registrar: Talks to the ROS master.
            simulation: Whose world to show.
            rate: Messages with the models in a second of wall time [Hz].
        """
        self._world = simulation.world
        self._closed = False
        self._layers: dict[str, LayerMarkers] = {}
        self._models: dict[str, ModelMarkers] = {}
        self._delete_until = 0.0  # time of time.monotonic [s]
        self._ticker = Ticker("flatland-all-markers", rate, simulation.post, self._tick)

        def topic(
            name: str, make: Callable[[], JoinedMarkers], *, ticks: bool = False
        ) -> LatchedTopic:
            return LatchedTopic(
                registrar,
                name,
                MarkerArray,
                make,
                simulation.post,
                on_connection=(lambda _connected: self._ticker.wake()) if ticks else None,
            )

        for layer in self._world.layers:
            self._add_layer(layer)
        for model in self._world.models:
            self.model_added(model)
        self._lines = topic(LAYERS, lambda: self._join_layers(LayerMarkers.lines))
        self._walls = topic(WALLS, lambda: self._join_layers(LayerMarkers.walls))
        self._all_models = topic(MODELS, self._join_models, ticks=True)
        self._world.add_observer(self)

    def close(self) -> None:
        """Leaves topics alone from now on: rospy ends all of them at once at shutdown."""
        self._closed = True
        self._ticker.close()

    # -- what happens in the world ---------------------------------------------------------

    def layer_changed(self, layer_name: str) -> None:
        """Shows the layers anew."""
        if self._closed:
            return
        if layer_name not in self._layers:
            self._add_layer(self._world.layer(layer_name))
        self._lines.send()
        self._walls.send()

    def model_added(self, model: Model) -> None:
        """Shows a model from the next tick on."""
        self._models[model.name] = ModelMarkers(model)

    def model_removed(self, model: Model) -> None:
        """Removes a model's markers with the next tick."""
        self._models.pop(model.name, None)
        # More than once: a client that is slow misses messages.
        self._delete_until = time.monotonic() + FAREWELL_TIME

    def _add_layer(self, layer: Layer) -> None:
        self._layers[layer.name] = LayerMarkers(layer)

    # -- messages --------------------------------------------------------------------------

    def _join_layers(self, make: Callable[[LayerMarkers, int], PackedMarkers]) -> JoinedMarkers:
        # A layer may have lost all its edges: the others' markers are in the message anyway.
        parts = [_deletion(), *(make(each, self._time_ns) for each in self._layers.values())]
        return JoinedMarkers(parts)

    def _join_models(self) -> JoinedMarkers:
        parts = [markers.message(self._time_ns) for markers in self._models.values()]
        if time.monotonic() < self._delete_until:
            parts.insert(0, _deletion())
        return JoinedMarkers(parts)

    @property
    def _time_ns(self) -> int:
        return self._world.timekeeper.sim_time_ns

    def _tick(self, _now: float) -> bool:
        self._all_models.send()
        return self._all_models.connected


def _deletion() -> PackedMarkers:
    markers = PackedMarkers()
    markers.add_deletion_of_all()
    return markers
