"""Maps of layers that the node publishes, as `map_server` does, and that it receives."""

from __future__ import annotations

import logging
import threading
from concurrent.futures import Future
from typing import Any, Final

from flatland.entities.layer import Layer
from flatland.errors import FlatlandError
from flatland.maps.occupancy_grid import GridSource, layer_grid
from flatland.node.transport import CallError, Transport
from flatland.node.values import MapMetadata, PublishedMap
from flatland.runtime.observer import WorldObserver
from flatland.simulation import Simulation
from flatland.values import OccupancyGrid
from flatland.world import World

_LOG = logging.getLogger("flatland")

MAP_TOPIC: Final = "map"
METADATA_TOPIC: Final = "map_metadata"
SERVICE: Final = "static_map"


class PublishedLayer(WorldObserver):
    """Latched topics and a service with the occupancy grid of one layer.

    The grid is created when the first subscriber connects or the service is first called, in a
    separate thread, and kept until the map is replaced; the simulation does not wait for it.
    """

    def __init__(
        self, transport: Transport, world: World, layer_name: str, frame_id: str, resolution: float
    ) -> None:
        """Advertises the topics and the service asynchronously.

        Args:
            transport: Publishes and serves.
            world: The world.
            layer_name: Name of the layer.
            frame_id: Frame of the map.
            resolution: Size of a cell [m]; only for a layer that has no image.

        Raises:
            FlatlandError: The layer does not exist or has no map, the map file is invalid, or a
                plugin has a topic or service of the same name.
        """
        layer = world.layer(layer_name)
        topic = transport.resolve(MAP_TOPIC)
        if layer.map_topic and transport.resolve(layer.map_topic) == topic:
            raise FlatlandError(
                f'layer "{layer_name}" cannot be published on the topic that it is received from, '
                f"{topic}"
            )
        self._layer, self._params, self._resolution = layer, world.params, resolution
        self._version = layer.map_version
        # A layer that waits for its map has none to publish yet.
        self._grid = None if _is_waiting(layer) else layer_grid(layer, world.params, resolution)
        self._timekeeper = world.timekeeper
        self._layer_name = layer_name
        self._frame_id = frame_id
        self._loaded: tuple[GridSource, PublishedMap] | None = None
        self._loading = threading.Lock()  # held while the grid is created
        self._publishing = threading.Lock()  # held while it is published, so that the last one wins
        self._requested = False
        self._map, self._convert_map = transport.values(
            MAP_TOPIC, PublishedMap, latch=True, on_connection=self._on_connection
        )
        self._metadata, self._convert_metadata = transport.values(
            METADATA_TOPIC, MapMetadata, latch=True, on_connection=self._on_connection
        )
        transport.serve(SERVICE, "nav_msgs/GetMap", self._serve)
        world.add_observer(self)

    def layer_changed(self, layer_name: str) -> None:
        """Publishes the map of the layer again if it has been replaced."""
        layer = self._layer
        if layer_name != layer.name or layer.map_version == self._version:
            return  # A plugin has added walls, which are not part of the map.
        self._version = layer.map_version
        try:
            grid = None if _is_waiting(layer) else layer_grid(layer, self._params, self._resolution)
        except FlatlandError as error:
            _LOG.error("cannot publish the map: %s", error)
            grid = None
        self._grid = grid
        if self._requested and grid is not None:
            self._start_publishing()

    def _on_connection(self, connected: bool) -> None:
        """Publishes the map once, for the first subscriber; called in any thread."""
        if connected and not self._requested:
            self._requested = True
            if self._grid is not None:  # Otherwise, it is published as soon as there is one.
                self._start_publishing()

    def _start_publishing(self) -> None:
        threading.Thread(target=self._publish, name="flatland-map", daemon=True).start()

    def _publish(self) -> None:
        try:
            with self._publishing:
                value = self._load()
                self._metadata.publish(self._convert_metadata(value))
                self._map.publish(self._convert_map(value))
        except Exception as error:
            # The next subscriber causes another attempt.
            self._requested = False
            is_known = isinstance(error, FlatlandError)
            _LOG.error("cannot publish the map: %s", error, exc_info=None if is_known else error)

    def _serve(self, _request: Any) -> dict[str, Any]:
        try:
            return {"map": self._load()}
        except FlatlandError as error:
            raise CallError(str(error)) from error

    def _load(self) -> PublishedMap:
        """Returns the map; creates it in the first call.

        Raises:
            FlatlandError: The image of the layer cannot be read.
        """
        with self._loading:
            source = self._grid
            if source is None:
                raise FlatlandError(f'layer "{self._layer_name}" has no map')
            if self._loaded is None or self._loaded[0] is not source:
                grid = source.load()
                stamp = self._timekeeper.sim_time_ns
                self._loaded = source, PublishedMap(stamp, grid, self._frame_id)
                height, width = grid.cells.shape
                _LOG.info(
                    'publishing layer "%s" as a map of %d x %d cells of %g m',
                    self._layer_name,
                    width,
                    height,
                    grid.resolution,
                )
            return self._loaded[1]


def _is_waiting(layer: Layer) -> bool:
    """Returns whether a layer has not received its map yet."""
    return bool(layer.map_topic) and layer.grid is None and not layer.map_path


def receive_layers(transport: Transport, simulation: Simulation) -> None:
    """Subscribes to the topics from which layers receive their maps."""
    for layer in simulation.world.layers:
        if layer.map_topic:
            _receive_layer(transport, simulation, layer.name, layer.map_topic)


def _receive_layer(transport: Transport, simulation: Simulation, name: str, topic: str) -> None:
    message_type, convert = transport.receivable(OccupancyGrid)

    def receive(message: Any) -> None:
        world = simulation.world
        try:
            grid = convert(message)
            store = world.source.convert_grid_ahead(grid)
        except FlatlandError as error:
            _log_failure(name, topic, error)
            return
        set_map = world.source.inputs.using(store)(world.set_layer_map)
        done = simulation.post(lambda: set_map(name, grid))
        done.add_done_callback(lambda done: _log_result(name, topic, grid, done))

    transport.subscribe(topic, message_type, receive)


def _log_result(name: str, topic: str, grid: OccupancyGrid, done: Future[None]) -> None:
    error = done.exception()
    if error is not None:
        _log_failure(name, topic, error)
        return
    rows, columns = grid.cells.shape
    _LOG.info('Layer "%s": map of %d x %d cells from topic "%s"', name, columns, rows, topic)


def _log_failure(name: str, topic: str, error: BaseException) -> None:
    text = error.text_with_hint if isinstance(error, FlatlandError) else repr(error)
    _LOG.error('Layer "%s": cannot use the map of topic "%s": %s', name, topic, text)
