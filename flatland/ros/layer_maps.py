"""Maps of layers that ROS nodes provide: the service `set_layer_map`, and layers with a topic."""

from __future__ import annotations

import logging
import math
from concurrent.futures import Future
from typing import Any, Final

import numpy as np
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage

from flatland.entities.layer import Layer
from flatland.errors import FlatlandError, MapFileError
from flatland.geometry import yaw_from_quaternion
from flatland.maps.occupancy_grid import OccupancyGrid
from flatland.ros.message_types import service_class
from flatland.ros.service_calls import CallError, ServiceCalls
from flatland.ros.transport.service import Service
from flatland.ros.transport.subscriber import Subscriber

_LOG = logging.getLogger("flatland")

SERVICE: Final = "set_layer_map"
_SERVICE_CLASS: Final = service_class("SetLayerMap")


class _ArrayGrid(OccupancyGridMessage):  # type: ignore[misc]
    """A grid whose cells are an array; by default, each cell is a Python object."""

    __slots__ = OccupancyGridMessage.__slots__

    def deserialize(self, data: bytes) -> Any:
        """Deserializes the message; called by rospy."""
        return self.deserialize_numpy(data, np)


class _ArrayRequest(_SERVICE_CLASS._request_class):  # type: ignore[misc, name-defined]
    """A request whose cells are an array."""

    __slots__ = _SERVICE_CLASS._request_class.__slots__

    def deserialize(self, data: bytes) -> Any:
        """Deserializes the request; called by rospy."""
        return self.deserialize_numpy(data, np)


class _ArrayService(_SERVICE_CLASS):  # type: ignore[misc, valid-type]
    """The service with such requests."""

    _request_class = _ArrayRequest


class LayerMaps:
    """Replaces the maps of layers on behalf of other nodes."""

    def __init__(self, calls: ServiceCalls) -> None:
        """Advertises the service, and subscribes to the topics of layers, asynchronously.

        Args:
            calls: Carries out the calls.

        Raises:
            FlatlandError: A plugin has a service of the same name.
        """
        self._calls = calls
        self._world = calls.simulation.world
        for layer in self._world.layers:
            if layer.map_topic:
                self._subscribe(layer)
        Service(calls.registrar, SERVICE, _ArrayService, self._serve)

    def _serve(self, request: Any) -> tuple[bool, str]:
        has_grid = len(request.grid.data) > 0
        if has_grid == bool(request.map_path):
            return False, "exactly one of map_path and grid must be given"
        try:
            source = grid_of(request.grid) if has_grid else request.map_path
            self._calls.carry_out(lambda: self._world.set_layer_map(request.layer, source))
        except CallError as error:
            return False, str(error)
        except FlatlandError as error:
            return False, error.text_with_hint
        return True, ""

    def _subscribe(self, layer: Layer) -> None:
        name, topic = layer.name, layer.map_topic

        def receive(message: Any) -> None:
            try:
                grid = grid_of(message)
            except FlatlandError as error:
                _log_failure(name, topic, error)
                return
            done = self._calls.simulation.post(lambda: self._world.set_layer_map(name, grid))
            done.add_done_callback(lambda done: _log_result(name, topic, grid, done))

        Subscriber(self._calls.registrar, topic, _ArrayGrid, receive)


def grid_of(message: Any) -> OccupancyGrid:
    """Converts a `nav_msgs/OccupancyGrid`, whose frame is taken as that of the world.

    Raises:
        MapFileError: The number of cells is not that of the metadata.
    """
    info = message.info
    cells = np.asarray(message.data, np.int8)
    if len(cells) != info.width * info.height:
        raise MapFileError(
            f"a grid of {info.width} x {info.height} cells must have that number of values, "
            f"got {len(cells)}"
        )
    position, rotation = info.origin.position, info.origin.orientation
    quaternion = (rotation.x, rotation.y, rotation.z, rotation.w)
    # Many publishers do not set the rotation at all.
    yaw = yaw_from_quaternion(*quaternion) if any(quaternion) else 0.0
    return OccupancyGrid(
        (position.x, position.y, yaw),
        # The message has single precision: 0.05 would be 0.05000000074505806 otherwise.
        _shortest(info.resolution),
        cells.reshape(info.height, info.width),
    )


def _shortest(resolution: float) -> float:
    """Returns the shortest decimal number that is equal in single precision."""
    return float(str(np.float32(resolution))) if math.isfinite(resolution) else resolution


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
