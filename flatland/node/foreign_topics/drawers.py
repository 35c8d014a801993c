"""What the messages of a topic look like; one object for each topic that is drawn."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from flatland.geometry import DoubleArray
from flatland.node.frame_tree import FrameTree
from flatland.node.shapes import Shapes
from flatland.web.foreign_topics import Drawing


class Drawer(Protocol):
    """Draws the messages of one topic; called by one thread at a time."""

    @property
    def note(self) -> str:
        """What of the messages is not drawn, for users; empty if all is."""

    def receive(self, message: Any, now: int) -> None:
        """Takes a message, received at a ROS time [ns]."""

    def draw(self, frames: FrameTree, now: int, *, again: bool) -> Drawing | None:
        """Returns the drawing of what was received.

        Args:
            frames: The transforms to the world frame.
            now: ROS time [ns].
            again: Whether to return a drawing that has not changed.

        Returns:
            The drawing, None if there is no message yet or if the drawing has not changed.

        Raises:
            NoTransformError: A frame is not connected to the world frame.
        """


class LatestDrawer:
    """Draws the latest message of a topic.

    Attributes:
        note: Always empty.
    """

    note = ""

    def __init__(self, convert: Callable[[Any], Shapes]) -> None:
        """Creates a drawer without a message.

        Args:
            convert: Returns the shapes of a message with a header, in the frame of the header.
        """
        self._convert = convert
        self._message: Any = None
        self._shapes: Shapes | None = None
        self._matrix: DoubleArray | None = None  # of the last drawing

    def receive(self, message: Any, now: int) -> None:  # noqa: ARG002
        """Replaces the message."""
        self._message, self._shapes = message, None

    def draw(self, frames: FrameTree, now: int, *, again: bool) -> Drawing | None:  # noqa: ARG002
        """Returns the drawing if the message or its transform has changed."""
        if self._message is None:
            return None
        matrix = frames.to_root(self._message.header.frame_id)
        if self._shapes is None:
            self._shapes = self._convert(self._message)
        elif not again and self._matrix is not None and np.array_equal(matrix, self._matrix):
            return None
        self._matrix = matrix
        return self._shapes.projected(matrix)
