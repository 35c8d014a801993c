"""The transforms of the last seconds, for the place of a robot at a time."""

from __future__ import annotations

import bisect
import math
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from flatland.geometry import quaternion_from_yaw
from flatland.node.foreign_topics.trees import nanoseconds_of
from flatland.node.frame_tree import FrameTree, NoTransformError, transform
from flatland.node.stamps import stamp
from flatland.node.values import WORLD_FRAME
from flatland.timekeeper import NANOSECONDS
from flatland.values import Transform

KEPT: Final = 3.0
"""Simulated time for which transforms are kept, unless periods are long [s]."""
_PERIODS: Final = 2  # of commands for which transforms are kept, if they are longer than that time


@dataclass(frozen=True, slots=True)
class _Sample:
    """A transform to a parent frame at a ROS time [ns]: (x, y, z) [m], quaternion (x, y, z, w)."""

    stamp: int
    parent: str
    position: tuple[float, ...]
    quaternion: tuple[float, ...]


class TransformHistory:
    """Transforms with their times; methods are safe from any thread.

    Attributes:
        kept: Simulated time for which transforms are kept [s].
    """

    def __init__(self) -> None:
        """Creates a history without transforms."""
        self.kept = KEPT
        self._lock = threading.Lock()
        self._samples: dict[str, list[_Sample]] = {}  # of each frame, in the order of their times
        self._static: dict[str, _Sample] = {}

    def keep_periods(self, period: float) -> None:
        """Keeps transforms for some periods of commands, if this is longer.

        Args:
            period: The period [s].
        """
        self.kept = max(KEPT, _PERIODS * period)

    def add(self, transforms: Sequence[Transform]) -> None:
        """Adds transforms of the own world."""
        with self._lock:
            for each in transforms:
                rotation = quaternion_from_yaw(each.yaw, each.roll)
                position = (each.x, each.y, 0.0)
                self._add(each.child, _Sample(stamp(each.stamp), each.parent, position, rotation))

    def add_message(self, message: Any, *, is_static: bool = False) -> None:
        """Adds the transforms of a `tf2_msgs/TFMessage`, unless a number is not finite.

        Args:
            message: The message, of ROS 1 or ROS 2.
            is_static: Whether they are valid at all times.
        """
        with self._lock:
            for each in message.transforms:
                p, q = each.transform.translation, each.transform.rotation
                position, quaternion = (p.x, p.y, p.z), (q.x, q.y, q.z, q.w)
                if not all(map(math.isfinite, (*position, *quaternion))):
                    continue
                # Frames of other versions of ROS have a leading slash.
                parent, child = each.header.frame_id.lstrip("/"), each.child_frame_id.lstrip("/")
                time_ns = nanoseconds_of(each.header.stamp)
                sample = _Sample(time_ns, parent, position, quaternion)
                if is_static:
                    self._static[child] = sample
                else:
                    self._add(child, sample)

    def position(self, frame: str, time_ns: int) -> tuple[float, float] | None:
        """Returns the position of a frame in the map [m]; None if it is not known.

        Args:
            frame: The frame.
            time_ns: ROS time. Between two times, transforms are interpolated; they are not
                extrapolated.
        """
        tree = FrameTree(WORLD_FRAME)
        seen: set[str] = set()
        with self._lock:
            # The map need not be the root.
            for name in (frame, WORLD_FRAME):
                while name not in seen and (found := self._at(name, time_ns)) is not None:
                    seen.add(name)
                    tree.set(found.parent, name, transform(found.position, found.quaternion))
                    name = found.parent
        try:
            x, y = tree.to_root(frame)[:2, 3].tolist()
        except NoTransformError:
            return None
        return (x, y)

    def _add(self, frame: str, sample: _Sample) -> None:
        samples = self._samples.setdefault(frame, [])
        index = bisect.bisect_left(samples, sample.stamp, key=_stamp)
        if index < len(samples) and samples[index].stamp == sample.stamp:
            return  # The own transforms are received as well.
        samples.insert(index, sample)
        oldest = samples[-1].stamp - round(self.kept * NANOSECONDS)
        del samples[: bisect.bisect_left(samples, oldest, key=_stamp)]

    def _at(self, frame: str, time_ns: int) -> _Sample | None:
        """Returns the transform of a frame at a time, None if there is none."""
        if frame in self._static:
            return self._static[frame]
        samples = self._samples.get(frame, [])
        index = bisect.bisect_left(samples, time_ns, key=_stamp)
        if index == len(samples):
            return None
        after = samples[index]
        if after.stamp == time_ns:
            return after
        if index == 0:
            return None
        before = samples[index - 1]
        if before.parent != after.parent:
            return before
        share = (time_ns - before.stamp) / (after.stamp - before.stamp)
        # A rotation has two quaternions, of which the nearer one is taken; the mean of quaternions
        # has the right axis, and for the small rotations between two times the right angle.
        dot = sum(map(math.prod, zip(before.quaternion, after.quaternion, strict=True)))
        nearer = share if dot >= 0 else -share
        return _Sample(
            time_ns,
            before.parent,
            _mix(before.position, after.position, 1 - share, share),
            _mix(before.quaternion, after.quaternion, 1 - share, nearer),
        )


def _stamp(sample: _Sample) -> int:
    return sample.stamp


def _mix(
    a: Sequence[float], b: Sequence[float], a_share: float, b_share: float
) -> tuple[float, ...]:
    return tuple(a_share * x + b_share * y for x, y in zip(a, b, strict=True))
