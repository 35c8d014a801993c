"""Encodes messages of the server: JSON, and little-endian binary; see `docs/web_protocol.md`."""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from flatland.geometry import DoubleArray, FloatArray, Pose
from flatland.web.foreign_topics import Cells, Marks
from flatland.web.scan_codes import codes_of, has_codes

VERSION: Final = 1
EDGES: Final = 1
POSES: Final = 2
SCANS: Final = 3
SAME_BODIES: Final = 4
COMPACT_SCANS: Final = 5
MARKS: Final = 6
GRID: Final = 7

_HEADER: Final = struct.Struct("<BBHId")
_TWO_COUNTS: Final = struct.Struct("<II")
_COUNT: Final = struct.Struct("<I")
_THREE_COUNTS: Final = struct.Struct("<III")
_GRID: Final = struct.Struct("<II4f")

Ids = npt.NDArray[np.uint32]


class Head(NamedTuple):
    """Header of a binary message.

    Attributes:
        world: Index of the world.
        revision: Revision of the world.
        time: Simulated time [s].
    """

    world: int
    revision: int
    time: float

    def packed(self, kind: int) -> bytes:
        """Returns the header of a message of a kind."""
        return _HEADER.pack(kind, VERSION, *self)


def text_message(message: dict[str, Any]) -> str:
    """Returns a text message as JSON without spaces."""
    return json.dumps(message, separators=(",", ":"))


def edges_message(head: Head, layer: int, edges: FloatArray) -> bytes:
    """Returns the message of all edges of a layer.

    Args:
        head: Header.
        layer: Index of the layer.
        edges: (x1, y1, x2, y2) in the world frame [m], shape (n, 4).
    """
    counts = _TWO_COUNTS.pack(layer, len(edges))
    return head.packed(EDGES) + counts + edges.astype("<f4").tobytes()


def poses_message(head: Head, poses: FloatArray, ids: Ids | None = None) -> bytes:
    """Returns the message of the poses of some bodies.

    Args:
        head: Header.
        poses: (x, y, theta) in the world frame [m, rad], shape (n, 3).
        ids: Ids of the bodies, shape (n,); None for the bodies of the previous message of poses.
    """
    start = head.packed(SAME_BODIES if ids is None else POSES) + _COUNT.pack(len(poses))
    columns = b"" if ids is None else ids.astype("<u4").tobytes()
    return start + columns + poses.astype("<f4").tobytes()


def scans_message(head: Head, groups: Sequence[bytes], *, compact: bool = False) -> bytes:
    """Returns the message of some scans.

    Args:
        head: Header.
        groups: Groups of scans, returned by `scan_group` or by `compact_scan_group`.
        compact: Whether the groups are those of `compact_scan_group`.
    """
    kind = COMPACT_SCANS if compact else SCANS
    return b"".join((head.packed(kind), _COUNT.pack(len(groups)), *groups))


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


def compact_scan_group(
    ids: Ids, poses: FloatArray, ranges: FloatArray, range_max: DoubleArray
) -> bytes:
    """Returns the part of a compact `scans_message` with scans of the same number of beams.

    Args:
        ids: Id of each laser, shape (k,).
        poses: (x, y, theta) of each laser at the time of its scan, world frame [m, rad],
            shape (k, 3).
        ranges: Range of each beam [m], shape (k, n).
        range_max: Maximum range of each laser [m], shape (k,); all of them have codes, or none,
            see `has_codes`.
    """
    columns: list[npt.NDArray[Any]] = [ids.astype("<u4"), poses.astype("<f4")]
    if has_codes(range_max.max()):
        codes, resolutions = codes_of(ranges, range_max)
        columns += [resolutions.astype("<f4"), codes.astype("<u2")]
        bits = 16
    else:
        columns.append(ranges.astype("<f4"))
        bits = 32
    data = b"".join([column.tobytes() for column in columns])
    padding = bytes(-len(data) % 4)
    return _THREE_COUNTS.pack(*ranges.shape, bits) + data + padding


def topic_message(head: Head, kind: int, topic: int, content: bytes) -> bytes:
    """Returns the message of a drawing of a topic.

    Args:
        head: Header.
        kind: `MARKS` or `GRID`.
        topic: Number of the topic in the message `topics`.
        content: Returned by `marks_content` or `grid_content`.
    """
    return head.packed(kind) + _COUNT.pack(topic) + content


def marks_content(marks: Marks) -> bytes:
    """Encodes the marks of a topic."""
    texts = json.dumps(list(marks.texts), separators=(",", ":")).encode() if marks.texts else b""
    return b"".join(
        (
            _THREE_COUNTS.pack(len(marks.lines), len(marks.triangles), len(texts)),
            marks.lines.astype("<f4").tobytes(),
            marks.triangles.astype("<f4").tobytes(),
            marks.line_colors.tobytes(),
            marks.triangle_colors.tobytes(),
            texts,
        )
    )


def compressed_cells(cells: Cells) -> bytes:
    """Compresses the cells of a grid, row by row; does not hold the GIL."""
    return zlib.compress(np.ascontiguousarray(cells).data, 1)


def grid_content(pose: Pose, resolution: float, shape: tuple[int, ...], compressed: bytes) -> bytes:
    """Encodes a grid.

    Args:
        pose: Pose of the corner of the first cell in the world frame [m, rad].
        resolution: Length of a cell [m].
        shape: Number of rows and columns.
        compressed: The cells, returned by `compressed_cells`.
    """
    height, width = shape
    return _GRID.pack(width, height, *pose, resolution) + compressed
