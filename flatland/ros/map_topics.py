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

from flatland.errors import FlatlandError
from flatland.maps.occupancy_grid import layer_grid
from flatland.ros.adapters import convert
from flatland.ros.names import sendable_text
from flatland.ros.transport.publisher import Publisher
from flatland.ros.transport.registrar import Registrar
from flatland.ros.transport.service import Service
from flatland.world import World

_LOG = logging.getLogger("flatland")

MAP_TOPIC: Final = "map"
METADATA_TOPIC: Final = "map_metadata"
SERVICE: Final = "static_map"


class MapTopics:
    """Latched topics and a service with the occupancy grid of one layer.

    The grid is created when the first subscriber connects or the service is first called, in a
    separate thread, and kept from then on; the simulation does not wait for it.
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
        self._grid = layer_grid(layer, world.params, resolution)
        self._timekeeper = world.timekeeper
        self._layer_name = layer_name
        self._frame_id = frame_id
        self._message: OccupancyGridMessage | None = None
        self._loading = threading.Lock()  # held while the grid is created
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

    def _on_connection(self, connected: bool) -> None:
        """Publishes the map once, for the first subscriber; called in a rospy thread."""
        if connected and not self._requested:
            self._requested = True
            threading.Thread(target=self._publish, name="flatland-map", daemon=True).start()

    def _publish(self) -> None:
        try:
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
            if self._message is None:
                self._message = self._make_message()
            return self._message

    def _make_message(self) -> OccupancyGridMessage:
        grid = self._grid.load()
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
