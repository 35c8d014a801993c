"""Serialization of messages without Python objects for their parts."""

from __future__ import annotations

import struct
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from flatland.geometry import Pose, quaternion_from_yaw
from flatland.node.stamps import stamp as message_stamp
from flatland.timekeeper import NANOSECONDS

FLOAT32: Final = np.dtype("<f4")
FLOAT64: Final = np.dtype("<f8")
UINT32: Final = np.dtype("<u4")
INT8: Final = np.dtype("i1")
BOOL: Final = np.dtype(bool)


LAYOUTS: Final = {
    code: [struct.Struct(f"<{count}{code}") for count in range(17)] for code in "bBHiIQfd"
}
"""The little-endian layouts of up to 16 numbers of one type, by its code in `struct`."""


class Writer(ABC):
    """Writes the fields of one message, in the order of its definition.

    The formats of ROS 1 and of ROS 2 differ in headers, texts and padding.

    Attributes:
        data: The bytes written so far.
    """

    data: bytearray

    @abstractmethod
    def align(self, size: int) -> None:
        """Pads the message so that a number of `size` bytes can follow."""

    @abstractmethod
    def stamp(self, seconds: int, nanoseconds: int) -> int:
        """Writes the part of a `std_msgs/Header` before the frame.

        Returns:
            Where the stamp begins in `data` [bytes].
        """

    @abstractmethod
    def time(self, time_ns: int) -> None:
        """Writes the stamp of a simulated time [ns] without a header."""

    @abstractmethod
    def now(self) -> int:
        """Returns the current ROS time of the node [ns]."""

    @abstractmethod
    def text(self, value: str) -> None:
        """Writes a string."""

    @abstractmethod
    def range_end(self) -> None:
        """Writes what follows the reading in `sensor_msgs/Range`."""

    @abstractmethod
    def marker_end(self, text: str) -> None:
        """Writes what follows the colours in `visualization_msgs/Marker`."""

    def header(self, time_ns: int, frame_id: str) -> None:
        """Writes a `std_msgs/Header`.

        Args:
            time_ns: Simulated time [ns].
            frame_id: The frame.
        """
        self.stamp(*divmod(message_stamp(time_ns), NANOSECONDS))
        self.text(frame_id)

    @abstractmethod
    def pack(self, code: str, *values: Any) -> None:
        """Writes up to 16 numbers of one type, without their count.

        Args:
            code: The type, one of `LAYOUTS`.
            values: The numbers.

        Raises:
            struct.error: A value is not a number, or does not fit the type.
        """

    def count(self, count: int) -> None:
        """Writes the number of items of an array that follows."""
        self.pack("I", count)

    def numbers(self, values: npt.NDArray[Any], kind: np.dtype[Any] = FLOAT64) -> None:
        """Writes the numbers of an array in row-major order, without their count."""
        if values.size:
            self.align(kind.itemsize)
            if values.dtype is not kind:
                values = values.astype(kind)
            self.data += values.tobytes()

    def array(self, values: npt.NDArray[Any], kind: np.dtype[Any] = FLOAT64) -> None:
        """Writes an array of numbers of variable length, with its count."""
        self.pack("I", values.size)
        self.numbers(values, kind)

    def texts(self, values: Sequence[str]) -> None:
        """Writes a list of strings."""
        self.count(len(values))
        for value in values:
            self.text(value)

    def orientation(self, yaw: float, roll: float = 0.0) -> None:
        """Writes the quaternion of the rotation by `roll`, then `yaw` [rad]."""
        self.pack("d", *quaternion_from_yaw(yaw, roll))

    def pose(self, x: float, y: float, yaw: float, roll: float = 0.0) -> None:
        """Writes the position (x, y, 0) and the rotation by `roll`, then `yaw` [rad]."""
        self.pack("d", x, y, 0.0, *quaternion_from_yaw(yaw, roll))

    def stamped_pose(
        self,
        time_ns: int,
        frame_id: str,
        child: str,
        x: float,
        y: float,
        yaw: float,
        roll: float = 0.0,
    ) -> None:
        """Writes a header, the id of the child frame, and its pose as `pose` does."""
        self.header(time_ns, frame_id)
        self.text(child)
        self.pose(x, y, yaw, roll)

    def twist(self, velocity: Pose) -> None:
        """Writes the planar velocity (vx, vy, omega)."""
        linear_x, linear_y, angular_z = velocity
        self.pack("d", linear_x, linear_y, 0.0, 0.0, 0.0, angular_z)

    def covariance(self, matrix: npt.NDArray[Any], size: int) -> None:
        """Writes a square matrix in row-major order.

        Args:
            matrix: The covariance.
            size: Number of rows and columns.

        Raises:
            ValueError: The matrix has another number of elements.
        """
        if matrix.size != size * size:
            raise ValueError(f"a covariance has {size * size} elements, got {matrix.size}")
        self.numbers(matrix)
