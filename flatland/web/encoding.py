"""Encodes messages of the server, binary ones little endian; see `docs/web_protocol.md`."""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from flatland.geometry import FloatArray

VERSION: Final = 1
EDGES: Final = 1
POSES: Final = 2
SCANS: Final = 3
SAME_BODIES: Final = 4

_HEADER: Final = struct.Struct("<BBHId")
_TWO_COUNTS: Final = struct.Struct("<II")
_COUNT: Final = struct.Struct("<I")

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


def same_bodies_message(world: int, revision: int, time: float, poses: FloatArray) -> bytes:
    """Returns the message of the poses of the bodies of the previous message of poses.

    Args:
        world: Index of the world.
        revision: Revision of the world.
        time: Simulated time [s].
        poses: (x, y, theta) in the world frame [m, rad], shape (n, 3).
    """
    head = _HEADER.pack(SAME_BODIES, VERSION, world, revision, time) + _COUNT.pack(len(poses))
    return head + poses.astype("<f4").tobytes()


def scans_message(world: int, revision: int, time: float, groups: Sequence[bytes]) -> bytes:
    """Returns the message of some scans.

    Args:
        world: Index of the world.
        revision: Revision of the world.
        time: Simulated time [s].
        groups: Scans as returned by `scan_group`.
    """
    head = _HEADER.pack(SCANS, VERSION, world, revision, time) + _COUNT.pack(len(groups))
    return b"".join((head, *groups))


def scan_group(ids: Ids, poses: FloatArray, ranges: FloatArray) -> bytes:
    """Returns the part of `scans_message` with scans of the same number of beams.

    Args:
        ids: Id of each laser, shape (k,).
        poses: (x, y, theta) of each laser at the time of its scan, world frame [m, rad],
            shape (k, 3).
        ranges: Range of each beam [m], shape (k, n).
    """
    counts = _TWO_COUNTS.pack(*ranges.shape)
    columns = (ids.astype("<u4"), poses.astype("<f4"), ranges.astype("<f4"))
    return counts + b"".join([column.tobytes() for column in columns])
