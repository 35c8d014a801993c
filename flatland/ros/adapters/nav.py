"""Values as messages of `nav_msgs`."""

import math
from typing import Any

import numpy as np
from nav_msgs.msg import MapMetaData
from nav_msgs.msg import OccupancyGrid as GridMessage
from nav_msgs.msg import Odometry as OdometryMessage

from flatland.errors import MapFileError
from flatland.geometry import yaw_from_quaternion
from flatland.node.values import MapMetadata, PublishedMap
from flatland.ros.adapters import convert, packing, register_built_in
from flatland.ros.message_types import with_arrays
from flatland.values import OccupancyGrid, Odometry


def odometry(value: Odometry) -> bytes:
    """Serializes an `Odometry`."""
    return b"".join(
        (
            packing.header(value.stamp, value.frame_id),
            packing.text(value.child_frame_id),
            packing.pose(*value.pose),
            packing.covariance(value.pose_covariance, 6),
            packing.twist(value.twist),
            packing.covariance(value.twist_covariance, 6),
        )
    )


ArrayGrid: Any = with_arrays(GridMessage)


def map_metadata(value: MapMetadata) -> MapMetaData:
    """Converts the metadata of a map."""
    grid = value.grid
    height, width = grid.cells.shape
    return MapMetaData(
        convert.time(value.stamp), grid.resolution, width, height, convert.pose(*grid.origin)
    )


def published_map(value: PublishedMap) -> Any:
    """Converts a map."""
    return ArrayGrid(
        convert.header(value.stamp, value.frame_id),
        map_metadata(value),
        value.grid.cells.reshape(-1),
    )


def received_grid(message: Any) -> OccupancyGrid:
    """Converts a grid, whose frame is taken as the world frame.

    Raises:
        MapFileError: The number of cells differs from the metadata.
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


register_built_in(Odometry, OdometryMessage, serialize=odometry)
register_built_in(MapMetadata, MapMetaData, to_message=map_metadata)
register_built_in(PublishedMap, GridMessage, to_message=published_map)
register_built_in(OccupancyGrid, ArrayGrid, from_message=received_grid)
