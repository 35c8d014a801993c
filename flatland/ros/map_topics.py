"""Publishes the map of a layer as `map_server` does: `map`, `map_metadata`, `static_map`."""

from __future__ import annotations

import logging
import threading
from typing import Any, Final

import numpy as np
import rospy
from nav_msgs.msg import MapMetaData
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.srv import GetMap, GetMapResponse

from flatland.entities.layer import Layer
from flatland.errors import FlatlandError
from flatland.maps.occupancy_grid import GridSource, layer_grid
from flatland.ros.adapters import convert
from flatland.ros.names import sendable_text
from flatland.ros.transport.publisher import Publisher
from flatland.ros.transport.registrar import Registrar
from flatland.ros.transport.service import Service
from flatland.runtime.observer import WorldObserver
from flatland.world import World

_LOG = logging.getLogger("flatland")

MAP_TOPIC: Final = "map"
METADATA_TOPIC: Final = "map_metadata"
SERVICE: Final = "static_map"


class MapTopics(WorldObserver):
    """Latched topics and a service with the occupancy grid of one layer.

    The grid is created when the first subscriber connects or the service is first called, in a
    separate thread, and kept until the map is replaced; the simulation does not wait for it.
    """

    def __init__(
        self, registrar: Registrar, world: World, layer_name: str, frame_id: str, resolution: float
    ) -> None:
        """Advertises the topics and the service asynchronously.

        Args:
            registrar: Registers the topics and the service with the ROS master.
            world: The world.
            layer_name: Name of the layer.
            frame_id: Frame of the map.
            resolution: Size of a cell [m]; only for a layer that has no image.

        Raises:
            FlatlandError: The layer does not exist or has no map, the map file is invalid, or a
                plugin has a topic or service of the same name.
        """
        layer = world.layer(layer_name)
        if layer.map_topic and rospy.resolve_name(layer.map_topic) == rospy.resolve_name(MAP_TOPIC):
            raise FlatlandError(
                f'layer "{layer_name}" cannot be published on the topic that it is received from, '
                f"{rospy.resolve_name(MAP_TOPIC)}"
            )
        self._layer, self._params, self._resolution = layer, world.params, resolution
        self._version = layer.map_version
        # A layer that waits for its map has none to publish yet.
        self._grid = None if _is_waiting(layer) else layer_grid(layer, world.params, resolution)
        self._timekeeper = world.timekeeper
        self._layer_name = layer_name
        self._frame_id = frame_id
        self._loaded: tuple[GridSource, OccupancyGridMessage] | None = None
        self._loading = threading.Lock()  # held while the grid is created
        self._publishing = threading.Lock()  # held while it is published, so that the last one wins
        self._requested = False
        self._map = Publisher(
            registrar,
            MAP_TOPIC,
            OccupancyGridMessage,
            latch=True,
            on_connection=self._on_connection,
        )
        self._metadata = Publisher(
            registrar, METADATA_TOPIC, MapMetaData, latch=True, on_connection=self._on_connection
        )
        Service(registrar, SERVICE, GetMap, self._serve)
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
            threading.Thread(target=self._publish, name="flatland-map", daemon=True).start()

    def _on_connection(self, connected: bool) -> None:
        """Publishes the map once, for the first subscriber; called in a rospy thread."""
        if connected and not self._requested:
            self._requested = True
            if self._grid is None:
                return  # It is published as soon as there is one.
            threading.Thread(target=self._publish, name="flatland-map", daemon=True).start()

    def _publish(self) -> None:
        try:
            with self._publishing:
                message = self._load()
                self._metadata.publish(message.info)
                self._map.publish(message)
        except Exception as error:
            # The next subscriber causes another attempt.
            self._requested = False
            is_known = isinstance(error, FlatlandError)
            _LOG.error("cannot publish the map: %s", error, exc_info=None if is_known else error)

    def _serve(self, _request: Any) -> GetMapResponse:
        try:
            return _PackedGetMapResponse(self._load())
        except FlatlandError as error:
            raise rospy.ServiceException(sendable_text(str(error))) from error

    def _load(self) -> OccupancyGridMessage:
        """Returns the map; creates it in the first call.

        Raises:
            FlatlandError: The image of the layer cannot be read.
        """
        with self._loading:
            source = self._grid
            if source is None:
                raise FlatlandError(f'layer "{self._layer_name}" has no map')
            if self._loaded is None or self._loaded[0] is not source:
                self._loaded = source, self._make_message(source)
            return self._loaded[1]

    def _make_message(self, source: GridSource) -> OccupancyGridMessage:
        grid = source.load()
        stamp = self._timekeeper.sim_time_ns
        height, width = grid.cells.shape
        info = MapMetaData(
            convert.time(stamp), grid.resolution, width, height, convert.pose(*grid.origin)
        )
        _LOG.info(
            'publishing layer "%s" as a map of %d x %d cells of %g m',
            self._layer_name,
            width,
            height,
            grid.resolution,
        )
        return _PackedOccupancyGrid(
            convert.header(stamp, self._frame_id), info, grid.cells.reshape(-1)
        )


def _is_waiting(layer: Layer) -> bool:
    """Returns whether a layer has not received its map yet."""
    return bool(layer.map_topic) and layer.grid is None and not layer.map_path


class _PackedOccupancyGrid(OccupancyGridMessage):  # type: ignore[misc]
    """A map whose cells are an int8 array; the default serialization copies each cell in Python."""

    __slots__ = OccupancyGridMessage.__slots__  # genpy reads the field names from here

    def serialize(self, buff: Any) -> None:
        """Serializes the message; called by rospy."""
        self.serialize_numpy(buff, np)


class _PackedGetMapResponse(GetMapResponse):  # type: ignore[misc]
    """A response with a packed map."""

    __slots__ = GetMapResponse.__slots__

    def serialize(self, buff: Any) -> None:
        """Serializes the message; called by rospy."""
        self.serialize_numpy(buff, np)
