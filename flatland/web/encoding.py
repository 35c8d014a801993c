"""Encodes messages of the server, binary ones little endian; see `docs/web_protocol.md`."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable, Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from flatland.geometry import FloatArray, Pose

VERSION: Final = 1
EDGES: Final = 1
POSES: Final = 2
SCANS: Final = 3

NO_HIT: Final = 0xFFFF
MAX_FRACTION: Final = 0xFFFE  # stands for `range_max`

_HEADER: Final = struct.Struct("<BBHId")
_TWO_COUNTS: Final = struct.Struct("<II")
_COUNT: Final = struct.Struct("<I")

Numbers = npt.NDArray[np.uint16]
Ids = npt.NDArray[np.uint32]


def text_message(message: dict[str, Any]) -> str:
    """Returns a text message as JSON without spaces."""
    return json.dumps(message, separators=(",", ":"))


def edges_message(world: int, revision: int, time: float, layer: int, edges: FloatArray) -> bytes:
    """Returns the message of all edges of a layer.

    Args:
        world: Index of the world.
        revision: Revision of the world.
        time: Simulated time [s].
        layer: Index of the layer.
        edges: (x1, y1, x2, y2) in the world frame [m], shape (n, 4).
    """
    head = _HEADER.pack(EDGES, VERSION, world, revision, time) + _TWO_COUNTS.pack(layer, len(edges))
    return head + edges.astype("<f4").tobytes()


def poses_message(world: int, revision: int, time: float, ids: Ids, poses: FloatArray) -> bytes:
    """Returns the message of the poses of some bodies.

    Args:
        world: Index of the world.
        revision: Revision of the world.
        time: Simulated time [s].
        ids: Ids of the bodies, shape (n,).
        poses: (x, y, theta) in the world frame [m, rad], shape (n, 3).
    """
    head = _HEADER.pack(POSES, VERSION, world, revision, time) + _COUNT.pack(len(ids))
    return head + ids.astype("<u4").tobytes() + poses.astype("<f4").tobytes()


def scans_message(
    world: int, revision: int, time: float, count: int, parts: Iterable[bytes]
) -> bytes:
    """Returns the message of some scans.

    Args:
        world: Index of the world.
        revision: Revision of the world.
        time: Simulated time [s].
        count: Number of scans.
        parts: Parts of `ScanParts`.
    """
    head = _HEADER.pack(SCANS, VERSION, world, revision, time) + _COUNT.pack(count)
    return b"".join((head, *parts))


def quantized(ranges: FloatArray, range_max: FloatArray) -> Numbers:
    """Converts ranges to fractions of the maximum range.

    Args:
        ranges: Ranges of scans with the same number of beams [m], shape (k, n): NaN, inf or the
            maximum range for no hit, -inf for a hit that is too close.
        range_max: Maximum range of each scan [m], shape (k,).

    Returns:
        Range as a fraction of the maximum range, from 0 to `MAX_FRACTION`, or `NO_HIT`;
        shape (k, n).
    """
    scaled = ranges * (np.float32(MAX_FRACTION) / range_max)[:, np.newaxis]
    is_hit = ranges < range_max[:, np.newaxis]  # False for NaN
    np.maximum(scaled, 0.0, out=scaled)
    scaled += 0.5
    scaled[~is_hit] = NO_HIT
    return scaled.astype("<u2")


class ScanParts:
    """The parts of `scans_message` for scans with the same number of beams.

    Attributes:
        all: The parts of all scans, one after the other.
    """

    def __init__(self, ids: Sequence[int], poses: Sequence[Pose], fractions: Numbers) -> None:
        """Encodes scans.

        Args:
            ids: Id of each laser.
            poses: (x, y, theta) of each laser at the time of its scan, world frame [m, rad].
            fractions: Ranges as returned by `quantized`, shape (k, n).
        """
        count = fractions.shape[1]
        padded = count + count % 2  # The parts that follow are aligned to 4 bytes.
        rows = np.zeros(
            len(ids),
            [("id", "<u4"), ("beams", "<u4"), ("pose", "<f4", 3), ("ranges", "<u2", padded)],
        )
        rows["id"], rows["beams"], rows["pose"] = ids, count, poses
        rows["ranges"][:, :count] = fractions
        self.all = rows.tobytes()
        self._size = rows.itemsize

    def __getitem__(self, index: int) -> bytes:
        """Returns the part of one scan."""
        return self.all[index * self._size : (index + 1) * self._size]
