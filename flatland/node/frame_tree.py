"""The newest transforms of all frames, to draw in the world what other nodes publish."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from flatland.geometry import DoubleArray

_MAX_FRAMES: Final = 10_000


class NoTransformError(Exception):
    """Two frames are not connected."""


def transform(
    position: Sequence[float], quaternion: Sequence[float] = (0.0, 0.0, 0.0, 1.0)
) -> DoubleArray:
    """Returns a transform as a matrix.

    Args:
        position: (x, y, z) [m].
        quaternion: (x, y, z, w), of any length; zero stands for no rotation, as in messages whose
            rotation was not set.

    Returns:
        Matrix of shape (4, 4), from coordinates of the frame to those of its parent.
    """
    matrix = np.eye(4)
    matrix[:3, 3] = position
    x, y, z, w = map(float, quaternion)  # of Python, which does not warn of infinities
    square = x * x + y * y + z * z + w * w
    if square > 0:
        s = 2.0 / square
        matrix[:3, :3] = (
            (1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)),
            (s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)),
            (s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)),
        )
    return matrix


class FrameTree:
    """The newest transform of each frame to its parent; methods are safe from any thread.

    Unlike TF, it keeps no history: what is drawn is transformed by the newest transforms.
    """

    def __init__(self, root: str) -> None:
        """Creates a tree without transforms.

        Args:
            root: Frame to which `to_root` transforms.
        """
        self._root = root
        self._parents: dict[str, tuple[str, DoubleArray]] = {}

    def set(self, parent: str, child: str, matrix: DoubleArray) -> None:
        """Replaces the transform of a frame, unless a number is not finite.

        Args:
            parent: The parent frame.
            child: The frame; a leading slash of both names is ignored.
            matrix: From coordinates of the frame to those of the parent, shape (4, 4).
        """
        parent, child = parent.lstrip("/"), child.lstrip("/")
        known = child in self._parents or len(self._parents) < _MAX_FRAMES
        if known and np.isfinite(matrix).all():
            self._parents[child] = (parent, matrix)

    def clear(self) -> None:
        """Removes all transforms."""
        self._parents = {}

    def to_root(self, frame: str) -> DoubleArray:
        """Returns the transform from a frame to the root, shape (4, 4).

        Raises:
            NoTransformError: The frames are not connected; the text names both.
        """
        frame = frame.lstrip("/")
        top, matrix = self._to_top(frame)
        if top == self._root:
            return matrix
        root_top, root_matrix = self._to_top(self._root)
        if top != root_top:
            if not frame:
                raise NoTransformError("the message names no frame")
            raise NoTransformError(f'no transform from "{frame}" to "{self._root}"')
        from_top: DoubleArray = np.linalg.inv(root_matrix)
        return from_top @ matrix

    def _to_top(self, frame: str) -> tuple[str, DoubleArray]:
        """Returns the last ancestor of a frame, or the root, and the transform to it."""
        matrix = np.eye(4)
        seen: set[str] = set()
        while frame != self._root or not seen:
            found = self._parents.get(frame)
            if found is None or frame in seen:
                break
            seen.add(frame)
            frame = found[0]
            matrix = found[1] @ matrix
        return frame, matrix
