"""Topics of other programs, which the viewer shows beside the world; independent of ROS.

A program that is connected to such topics, as the node is, implements `ForeignTopics` and passes
it to `WebViewer.add_world`. The server asks it repeatedly for what has changed, and only while a
client looks.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from flatland.geometry import FloatArray, Pose

Colors = npt.NDArray[np.uint8]
Cells = npt.NDArray[np.int8]
PoseKind = Literal["goal", "initial_pose"]
"""What a pose of a client means to a navigation."""


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic that clients can show or inspect.

    Attributes:
        name: Name of the topic.
        type: Name of its message type, for users.
        drawn_as: `marks` or `grid`; empty if only its values can be inspected.
        status: Why a topic that is shown or inspected has nothing to show; empty otherwise.
    """

    name: str
    type: str
    drawn_as: Literal["marks", "grid", ""] = ""
    status: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Marks:
    """Lines, areas and texts of a topic in the world frame.

    Attributes:
        lines: (x1, y1, x2, y2, width) [m], shape (n, 5); the width 0 is that of a thin line. Ends
            are round, so that a line without length is a disc.
        line_colors: (r, g, b, a) of each line, shape (n, 4). The opacity 0 stands for the colour
            that the page uses for the topic.
        triangles: (x1, y1, x2, y2, x3, y3) [m], shape (m, 6).
        triangle_colors: The same as `line_colors`, shape (m, 4).
        texts: (x, y, text) [m] of each text.
    """

    lines: FloatArray
    line_colors: Colors
    triangles: FloatArray
    triangle_colors: Colors
    texts: Sequence[tuple[float, float, str]] = ()

    @classmethod
    def none(cls) -> Marks:
        """Returns no marks, which remove what was shown of a topic."""
        colors = np.zeros((0, 4), np.uint8)
        return cls(np.zeros((0, 5), np.float32), colors, np.zeros((0, 6), np.float32), colors)


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """A grid of cells in the world frame.

    Attributes:
        pose: Pose of the corner of the first cell in the world frame [m, rad].
        resolution: Length of a cell [m].
        cells: -1 for unknown, 0 for free to 100 for occupied, rows along y, shape (height, width).
            The contents of an array never change.
    """

    pose: Pose
    resolution: float
    cells: Cells


Drawing: TypeAlias = Marks | Grid


@dataclass(frozen=True, slots=True)
class TopicDemand:
    """What clients look at.

    Attributes:
        drawn: Names of the topics that are drawn.
        inspected: Names of the topics whose values are shown.
    """

    drawn: frozenset[str] = frozenset()
    inspected: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True, eq=False)
class TopicUpdate:
    """What has changed since the previous update.

    Attributes:
        topics: All topics that exist or are demanded.
        pose_topics: For each kind of pose the topics to which it can be sent, the default first.
        drawings: New drawings by topic.
        values: New values as JSON by topic.
    """

    topics: Sequence[Topic] = ()
    pose_topics: Mapping[PoseKind, Sequence[str]] = field(default_factory=dict)
    drawings: Mapping[str, Drawing] = field(default_factory=dict)
    values: Mapping[str, Any] = field(default_factory=dict)


class ForeignTopics(Protocol):
    """Connects the viewer with topics of other programs; called in helper threads of the server."""

    def update(self, demand: TopicDemand) -> TopicUpdate:
        """Subscribes to exactly the topics that are demanded, and returns what has changed.

        One call at a time. The first update after a topic was not demanded contains its latest
        drawing as soon as there is one.
        """

    def suspend(self) -> None:
        """Unsubscribes from all topics until the next update; never during an update."""

    def publish_pose(self, kind: PoseKind, topic: str, pose: Pose) -> bool:
        """Publishes a pose in the world frame.

        Args:
            kind: What the pose means.
            topic: One of the topics of this kind in the last update.
            pose: (x, y, theta) [m, rad].

        Returns:
            Whether the topic has a subscriber.

        Raises:
            FlatlandError: The topic is not one of this kind.
        """
