"""Observations: the input of a policy, composed of parts."""

from __future__ import annotations

import copy
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np
from gymnasium import spaces

from flatland.checks import check_kind, checked_count, checked_positive
from flatland.geometry import DoubleArray, FloatArray

if TYPE_CHECKING:
    from flatland.gym.situation import Situation

P = TypeVar("P", bound="ObservationPart")

GOAL_SCALE: Final = 10.0  # m


class ObservationPart(ABC):
    """A part of the observation: some numbers between two bounds.

    Attributes:
        name: Key of the part in a dictionary of observations.
        low: Lower bound of all numbers.
        high: Upper bound of all numbers.
        dtype: Type of the numbers in an observation, float32 or uint8; `write` has float32.
    """

    name: str
    low: float = -1.0
    high: float = 1.0
    dtype: type[np.float32 | np.uint8] = np.float32

    @abstractmethod
    def size(self, beams: int) -> int:
        """Returns the number of values for a laser with a given number of beams.

        Raises:
            ValueError: The part does not support this number of beams.
        """

    def shape(self, beams: int) -> tuple[int, ...]:
        """Returns the shape in an observation, by default (size,); that of an image has 3 axes."""
        return (self.size(beams),)

    def prepare(self, situation: Situation) -> None:  # noqa: B027 - most parts need nothing
        """Prepares a copy of the part for an environment.

        Args:
            situation: The state of the agents, before the first episode.

        Raises:
            ValueError: The part cannot be computed.
        """

    @abstractmethod
    def write(self, situation: Situation, out: FloatArray) -> None:
        """Writes the numbers of all agents.

        Args:
            situation: The state of the agents.
            out: Array for the numbers, shape (n, size), float32. It contains those of the previous
                step, except for agents whose episode begins (`situation.steps` is 0).
        """


class Scan(ObservationPart):
    """The scan: ranges divided by the range of the laser, 1 without a hit, 0 if too close.

    With `sectors`, neighbouring beams are combined and the nearest range of each sector is kept.
    With `half`, a range r is observed as r / (r + half): near obstacles, on which the next action
    depends, differ more than distant ones.
    """

    name = "scan"
    low = 0.0

    def __init__(self, sectors: int | None = None, half: float | None = None) -> None:
        """Creates the part.

        Args:
            sectors: Number of sectors, a divisor of the number of beams; None for all beams.
            half: Range that is observed as 0.5 [m]; None for a linear scale.

        Raises:
            ValueError: There is less than 1 sector, or `half` is not positive.
        """
        self.half = None if half is None else checked_positive("half", half, "m")
        self.sectors = None if sectors is None else checked_count("sectors", sectors)

    def size(self, beams: int) -> int:
        """Returns the number of sectors, or of beams."""
        if self.sectors is None:
            return beams
        if beams % self.sectors:
            raise ValueError(f"sectors must divide the {beams} beams of the laser: {self.sectors}")
        return self.sectors

    def write(self, situation: Situation, out: FloatArray) -> None:
        """Writes the scaled ranges."""
        situation.core.write_scans(situation.max_range, self.half or 0.0, out)

    def ranges_of(self, values: DoubleArray, max_range: float, beams: int) -> DoubleArray:
        """Returns the ranges of all beams [m], the inverse of `write`.

        Args:
            values: Observed values, shape (n, size).
            max_range: Range of the laser [m], which is that of a beam without a hit.
            beams: Number of beams of the laser; those of a sector have the same range.

        Returns:
            Ranges, shape (n, beams).
        """
        if self.half is None:
            ranges = values * max_range
        else:
            ranges = self.half * values / np.maximum(1.0 - values, 1e-9)
        ranges = np.where(values < 1.0, np.minimum(ranges, max_range), max_range)
        return np.repeat(ranges, beams // values.shape[1], axis=1)


class Goal(ObservationPart):
    """The goal in the frame of the robot: distance, cosine and sine of the bearing.

    The distance is divided by `scale` and at most 1. If the robot is exactly at the goal, the
    bearing is (0, 0).
    """

    name = "goal"

    def __init__(self, scale: float = GOAL_SCALE) -> None:
        """Creates the part.

        Args:
            scale: Distance that is observed as 1 [m].

        Raises:
            ValueError: `scale` is not positive.
        """
        self.scale = checked_positive("scale", scale, "m")

    def size(self, beams: int) -> int:  # noqa: ARG002 - does not depend on the laser
        """Returns 3."""
        return 3

    def write(self, situation: Situation, out: FloatArray) -> None:
        """Writes the distance and the bearing."""
        situation.core.write_goals(self.scale, out)

    def positions_of(self, values: DoubleArray) -> DoubleArray:
        """Returns the goals (ahead, left) [m], at most `scale` away, the inverse of `write`.

        Args:
            values: Observed values, shape (n, 3).

        Returns:
            Positions in the frame of the robot, shape (n, 2).
        """
        positions: DoubleArray = self.scale * values[:, :1] * values[:, 1:]
        return positions


class Velocity(ObservationPart):
    """Forward speed and yaw rate, divided by the greatest that can be commanded.

    With `sideways`, the sideways velocity is between them, for drives that move sideways.
    """

    name = "velocity"

    def __init__(self, sideways: bool = False) -> None:
        """Creates the part.

        Args:
            sideways: Whether the sideways velocity is observed.

        Raises:
            TypeError: It is no bool.
        """
        check_kind("sideways", sideways, bool, "True or False")
        self.sideways = sideways

    def size(self, beams: int) -> int:  # noqa: ARG002 - does not depend on the laser
        """Returns 2, or 3 with the sideways velocity."""
        return 3 if self.sideways else 2

    def write(self, situation: Situation, out: FloatArray) -> None:
        """Writes the velocities; a robot that is pushed may exceed the bounds, which are kept."""
        forward, sideways, turn = situation.velocity_limits
        if not self.sideways:
            situation.core.write_velocities(forward, turn, out)
            return
        both = np.empty((len(out), 2), np.float32)
        situation.core.write_velocities(forward, turn, both)
        vx, vy, _ = situation.velocities.T
        theta = situation.poses[:, 2]
        out[:, ::2] = both
        out[:, 1] = np.clip((vy * np.cos(theta) - vx * np.sin(theta)) / sideways, -1.0, 1.0)

    def velocities_of(
        self, values: DoubleArray, low: DoubleArray, high: DoubleArray
    ) -> DoubleArray:
        """Returns forward speeds and yaw rates [m/s, rad/s], the inverse of `write`.

        Args:
            values: Observed values, shape (n, 2).
            low: Lowest velocity command, shape (2,).
            high: Highest velocity command, shape (2,).

        Returns:
            Velocities, shape (n, 2).
        """
        velocities: DoubleArray = values * np.maximum(np.abs(low), np.abs(high))
        return velocities


class LastAction(ObservationPart):
    """The action of the last step as numbers, zero at the start of an episode."""

    name = "last_action"

    def __init__(self, numbers: int = 2) -> None:
        """Creates the part.

        Args:
            numbers: Numbers of an action: 2, or 3 for a `HolonomicAction`.

        Raises:
            ValueError: It is not 2 or 3.
        """
        self.numbers = checked_count("numbers", numbers, 2, 3)

    def size(self, beams: int) -> int:  # noqa: ARG002 - does not depend on the laser
        """Returns the number of numbers."""
        return self.numbers

    def prepare(self, situation: Situation) -> None:
        """Checks that actions have as many numbers."""
        if situation.actions.shape[1] != self.numbers:
            raise ValueError(
                f"LastAction({self.numbers}) requires actions of {self.numbers} numbers, got "
                f"{situation.actions.shape[1]}"
            )

    def write(self, situation: Situation, out: FloatArray) -> None:
        """Writes the action."""
        out[:] = situation.actions


class Stacked(ObservationPart):
    """The last values of a part, oldest first; the first ones of an episode are repeated.

    Values are concatenated along the last axis: the channels of an image.
    """

    def __init__(self, part: ObservationPart, count: int) -> None:
        """Creates the part.

        Args:
            part: The part.
            count: Number of observations.

        Raises:
            TypeError: `part` is no part.
            ValueError: `count` is not an integer of at least 1.
        """
        check_kind("part", part, ObservationPart, "an ObservationPart")
        self.part = part
        self.count = checked_count("count", count)
        self.name, self.low, self.high = part.name, part.low, part.high
        self.dtype = part.dtype

    def size(self, beams: int) -> int:
        """Returns the number of all values."""
        return self.count * self.part.size(beams)

    def shape(self, beams: int) -> tuple[int, ...]:
        """Returns the shape of the part, with a longer last axis."""
        *outer, last = self.part.shape(beams)
        return (*outer, self.count * last)

    def prepare(self, situation: Situation) -> None:
        """Prepares the part."""
        self.part = copy.copy(self.part)
        self.part.prepare(situation)
        *outer, last = self.part.shape(situation.ranges.shape[1])
        self._frames = (*outer, self.count, last)

    def write(self, situation: Situation, out: FloatArray) -> None:
        """Drops the oldest values and appends the present ones."""
        n = len(out)
        frames = out.reshape(n, *self._frames).copy()
        newest = frames[..., -1, :].copy()
        self.part.write(situation, newest.reshape(n, -1))  # a view
        frames[..., :-1, :] = frames[..., 1:, :]
        frames[..., -1, :] = newest
        is_first = situation.steps == 0
        frames[is_first] = newest[is_first][..., np.newaxis, :]
        out[:] = frames.reshape(n, -1)


class Observation:
    """Parts in a fixed order, as one array or as a dictionary.

    Attributes:
        parts: The parts.
        as_dict: Whether observations are dictionaries of arrays, by the names of the parts.
    """

    def __init__(self, *parts: ObservationPart, as_dict: bool = False) -> None:
        """Creates the observation.

        Args:
            parts: The parts; `Scan`, `Goal` and `Velocity` if none are given.
            as_dict: Whether observations are dictionaries.

        Raises:
            TypeError: A part is no `ObservationPart`.
            ValueError: Two parts have the same name.
        """
        for part in parts:
            check_kind("each part", part, ObservationPart, "an ObservationPart")
        self.parts = parts or (Scan(), Goal(), Velocity())
        self.as_dict = as_dict
        names = [part.name for part in self.parts]
        if len(set(names)) < len(names):
            raise ValueError(f"the parts of an observation must have different names, got {names}")

    def layout(self, beams: int) -> ObservationLayout:
        """Returns the space and the columns for a laser with a number of beams.

        Raises:
            ValueError: A part cannot be computed from that many beams, or an image is one of
                several parts of an array.
        """
        return ObservationLayout(self, beams)


class ObservationLayout:
    """An observation with its columns in an array of all numbers.

    Attributes:
        space: Space of one observation.
        size: Number of columns.
        blank: An observation of zeros, limited to the bounds, shape (size,), float32.
    """

    def __init__(self, observation: Observation, beams: int) -> None:
        """Assigns the columns.

        Args:
            observation: The parts.
            beams: Number of beams of the laser.
        """
        self._as_dict = observation.as_dict
        self._columns: list[tuple[ObservationPart, slice]] = []
        self._shapes: dict[str, tuple[int, ...]] = {}
        start = 0
        for part in map(copy.copy, observation.parts):
            end = start + part.size(beams)
            self._columns.append((part, slice(start, end)))
            self._shapes[part.name] = part.shape(beams)
            start = end
        self.size = start
        self.blank: FloatArray = np.zeros(self.size, np.float32)
        for part, columns in self._columns:
            self.blank[columns] = min(max(0.0, part.low), part.high)
        # A single part has its own shape; several are concatenated.
        self._single = part if len(self._columns) == 1 and not self._as_dict else None
        boxes: dict[str, spaces.Space[Any]] = {
            part.name: spaces.Box(part.low, part.high, self._shapes[part.name], part.dtype)
            for part, _ in self._columns
        }
        self.space: spaces.Space[Any]
        if self._single is not None:
            self.space = boxes[part.name]
        elif self._as_dict:
            self.space = spaces.Dict(boxes)
        else:
            for name, box in boxes.items():
                if box.shape is None or len(box.shape) > 1 or box.dtype != np.float32:
                    raise ValueError(f"{name} beside other parts requires as_dict=True")
            low, high = np.empty(self.size, np.float32), np.empty(self.size, np.float32)
            for part, columns in self._columns:
                low[columns], high[columns] = part.low, part.high
            self.space = spaces.Box(low, high, dtype=np.float32)

    def prepare(self, situation: Situation) -> None:
        """Prepares all parts.

        Raises:
            ValueError: One cannot be computed.
        """
        for part, _ in self._columns:
            part.prepare(situation)

    def has(self, kind: type[ObservationPart]) -> bool:
        """Returns whether there is a part of a class."""
        return any(isinstance(part, kind) for part, _ in self._columns)

    def find(self, kind: type[P]) -> tuple[P, slice]:
        """Returns the part of a class, with its columns.

        Raises:
            ValueError: There is none.
        """
        for part, columns in self._columns:
            if isinstance(part, kind):
                return part, columns
        raise ValueError(f"the observation must contain {kind.__name__}")

    def select(self, observation: Any, part: ObservationPart, columns: slice) -> FloatArray:
        """Returns the values of a part in one observation or in those of several agents.

        Args:
            observation: As the space describes it.
            part: The part.
            columns: Its columns, as `find` returns them.

        Returns:
            The values, shape (size,) or (n, size).
        """
        values: FloatArray = observation[part.name] if self._as_dict else observation[..., columns]
        return values

    def write(self, situation: Situation, out: FloatArray) -> None:
        """Writes the observations of all agents to `out`, shape (n, size)."""
        for part, columns in self._columns:
            part.write(situation, out[:, columns])

    def present(self, numbers: FloatArray, *, copy: bool = True) -> Any:
        """Returns observations as the space describes them.

        Args:
            numbers: One observation, shape (size,), or several, shape (n, size).
            copy: Whether the result is independent of `numbers`.
        """
        if self._single is not None:
            return self._shaped(self._single, numbers, copy)
        if not self._as_dict:
            return numbers.copy() if copy else numbers
        # The keys of the space are sorted.
        parts = sorted(self._columns, key=lambda column: column[0].name)
        return {
            part.name: self._shaped(part, numbers[..., columns], copy) for part, columns in parts
        }

    def _shaped(self, part: ObservationPart, numbers: FloatArray, copy: bool) -> Any:
        shaped = numbers.reshape(*numbers.shape[:-1], *self._shapes[part.name])
        return shaped.astype(part.dtype, copy=copy)
