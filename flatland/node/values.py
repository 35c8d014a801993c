"""Values that the node publishes and receives; `flatland.values` has the values of plugins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Final

from flatland.geometry import DoubleArray, Pose
from flatland.values import Transform

if TYPE_CHECKING:
    from flatland.values import OccupancyGrid

WORLD_FRAME: Final = "map"
"""Frame of the world in debug markers, interactive markers and model states."""


class Transforms(tuple[Transform, ...]):
    """The transforms of one step."""

    __slots__ = ()


class DebugTopicNames(tuple[str, ...]):
    """The names of the topics of debug markers, relative to their namespace."""

    __slots__ = ()


class FrameParents(dict[str, str]):
    """The parent of each frame in a message of transforms, without leading slashes."""


@dataclass(frozen=True, slots=True)
class ReceivedPose:
    """A pose that another node has sent.

    Attributes:
        frame_id: Its frame, without a leading slash.
        pose: (x, y, theta) [m, rad]; None if a number is not finite or there is no rotation.
    """

    frame_id: str
    pose: Pose | None


@dataclass(frozen=True, slots=True, eq=False)
class StampedModelStates:
    """The states of models.

    Attributes:
        stamp: Simulated time [ns].
        frame_id: Frame of the poses and velocities.
        names: Name of each model.
        namespaces: Namespace of each model.
        poses: (x, y, theta) of the first bodies [m, rad], shape (n, 3).
        velocities: (vx, vy, omega) of the origins of the same bodies [m/s, rad/s], shape (n, 3).
    """

    stamp: int
    frame_id: str
    names: Sequence[str]
    namespaces: Sequence[str]
    poses: DoubleArray
    velocities: DoubleArray


@dataclass(frozen=True, slots=True, eq=False)
class MapMetadata:
    """The size and place of a map.

    Attributes:
        stamp: Simulated time at which the map was created [ns].
        grid: The map.
    """

    stamp: int
    grid: OccupancyGrid


@dataclass(frozen=True, slots=True, eq=False)
class PublishedMap(MapMetadata):
    """A map.

    Attributes:
        frame_id: Frame of the map.
    """

    frame_id: str


class Level(IntEnum):
    """The level of a status, as in `diagnostic_msgs/DiagnosticStatus`."""

    OK = 0
    WARN = 1
    ERROR = 2


@dataclass(frozen=True, slots=True)
class Status:
    """The status of a part of the node.

    Attributes:
        name: Name of the part.
        level: The level.
        text: Summary.
        values: Texts by name.
    """

    name: str
    level: Level
    text: str
    values: dict[str, str]


class Diagnostics(tuple[Status, ...]):
    """The status of each part of the node; the stamp is the ROS time."""

    __slots__ = ()
