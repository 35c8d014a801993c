"""Serialization of messages in the format of DDS: CDR of version 1, little-endian."""

from __future__ import annotations

import struct
from functools import lru_cache
from typing import Any, Final

from flatland.node.adapters.writer import LAYOUTS, Writer
from flatland.node.stamps import stamp as message_stamp
from flatland.ros2 import ros_time
from flatland.timekeeper import NANOSECONDS

ENCAPSULATION: Final = b"\0\1\0\0"
"""Begin of each message: plain CDR, little-endian."""
_COUNT: Final = struct.Struct("<I")
_TIME: Final = struct.Struct("<iI")
_PADDING: Final = tuple(map(bytes, range(8)))
_CACHED_TEXTS: Final = 4096  # frames and names of a large world


@lru_cache(_CACHED_TEXTS)
def _text(value: str) -> bytes:
    data = value.encode()
    return _COUNT.pack(len(data) + 1) + data + b"\0"


class CdrWriter(Writer):
    """Writes a message of ROS 2."""

    def __init__(self) -> None:
        """Begins a message."""
        self.data = bytearray(ENCAPSULATION)

    def align(self, size: int) -> None:
        """Pads the message to a multiple of `size` bytes, a power of two up to 8."""
        self.data += _PADDING[(len(ENCAPSULATION) - len(self.data)) & (size - 1)]

    def pack(self, code: str, *values: Any) -> None:
        """Writes up to 16 numbers of one type, without their count."""
        size = LAYOUTS[code][1].size
        if size > 1:
            self.align(size)
        self.data += LAYOUTS[code][len(values)].pack(*values)

    def stamp(self, seconds: int, nanoseconds: int) -> int:
        """Writes a stamp."""
        self.align(4)
        self.data += _TIME.pack(seconds, nanoseconds)
        return len(self.data) - _TIME.size

    def time(self, time_ns: int) -> None:
        """Writes the stamp of a simulated time [ns] without a header."""
        self.stamp(*divmod(message_stamp(time_ns), NANOSECONDS))

    def now(self) -> int:
        """Returns the current ROS time [ns]."""
        return ros_time.now()

    def text(self, value: str) -> None:
        """Writes a string."""
        self.align(4)
        self.data += _text(value)

    def range_end(self) -> None:
        """Writes an unknown variance."""
        self.pack("f", 0.0)

    def marker_end(self, text: str) -> None:
        """Writes no texture, the text and an empty mesh.

        Each marker of an array begins four bytes after a multiple of eight, so that arrays can be
        joined: the format of the texture, which has no meaning without a texture, is padding.
        """
        start = len(self.data)
        for padding in ("", "    "):
            del self.data[start:]
            self.text("")  # texture_resource
            self.stamp(0, 0)
            self.text("")  # frame of the texture
            self.text(padding)  # its format
            self.count(0)  # its data
            self.count(0)  # uv_coordinates
            self.text(text)
            self.text("")  # mesh_resource
            self.text("")  # name of the file of the mesh
            self.count(0)  # its data
            self.pack("B", 0)  # mesh_use_embedded_materials
            self.align(4)
            if len(self.data) % 8 == 0:  # after the encapsulation of 4 bytes
                return
