"""Serialized message parts: headers, texts, poses, velocities, covariances.

The functions return what `genpy` writes, without creating a Python object for each part.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from flatland.geometry import Pose, quaternion_from_yaw
from flatland.node.clock import stamp as clock_stamp
from flatland.timekeeper import NANOSECONDS

COUNT: Final = struct.Struct("<I")
_HEADER: Final = struct.Struct("<3I")
_POSE: Final = struct.Struct("<7d")
_TWIST: Final = struct.Struct("<6d")
_FLOAT64: Final = np.dtype("<f8")
_FLOAT32: Final = np.dtype("<f4")
_CACHED_TEXTS: Final = 4096  # frames and names of a large world


@lru_cache(_CACHED_TEXTS)
def text(value: str) -> bytes:
    """Returns a serialized string."""
    data = value.encode()
    return COUNT.pack(len(data)) + data


def texts(values: Sequence[str]) -> bytes:
    """Returns a serialized list of strings."""
    return COUNT.pack(len(values)) + b"".join(map(text, values))


def stamp(time_ns: int) -> bytes:
    """Returns the serialized beginning of a header: the sequence number 0 and the stamp.

    Args:
        time_ns: Simulated time [ns].
    """
    return _HEADER.pack(0, *divmod(clock_stamp(time_ns), NANOSECONDS))


def header(time_ns: int, frame_id: str) -> bytes:
    """Returns a serialized header; the publisher sets the sequence number.

    Args:
        time_ns: Simulated time [ns].
        frame_id: The frame.
    """
    return stamp(time_ns) + text(frame_id)


def pose(x: float, y: float, yaw: float, roll: float = 0.0) -> bytes:
    """Returns the serialized position (x, y, 0) and the rotation by `roll`, then `yaw` [rad]."""
    return _POSE.pack(x, y, 0.0, *quaternion_from_yaw(yaw, roll))


def twist(velocity: Pose) -> bytes:
    """Returns the serialized planar velocity (vx, vy, omega)."""
    linear_x, linear_y, angular_z = velocity
    return _TWIST.pack(linear_x, linear_y, 0.0, 0.0, 0.0, angular_z)


def covariance(matrix: npt.NDArray[Any], size: int) -> bytes:
    """Returns a serialized square matrix in row-major order.

    Args:
        matrix: The covariance.
        size: Number of rows and columns.

    Raises:
        ValueError: The matrix has another number of elements.
    """
    if matrix.size != size * size:
        raise ValueError(f"a covariance has {size * size} elements, got {matrix.size}")
    return doubles(matrix)


def doubles(numbers: npt.NDArray[Any]) -> bytes:
    """Returns numbers as float64 in row-major order, without their count."""
    if numbers.dtype is not _FLOAT64:
        numbers = numbers.astype(_FLOAT64)
    return numbers.tobytes()


def float_array(numbers: npt.NDArray[Any]) -> bytes:
    """Returns a serialized array of float32 of variable length, with its count."""
    if numbers.dtype is not _FLOAT32:
        numbers = numbers.astype(_FLOAT32)
    return COUNT.pack(numbers.size) + numbers.tobytes()
