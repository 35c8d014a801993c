"""Comparison of two versions that are measured by turns, under the same load of the machine."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from table import aligned

LIMIT = 1.05  # ratio above which a row is marked as slower

Measure = Callable[[], float]
"""Performs a part of the work, and returns the processor time of one operation [s]."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """The times of one row in two versions.

    Attributes:
        name: Name of the row.
        pairs: (time of this version, time of the reference) of each turn [s].
    """

    name: str
    pairs: Sequence[tuple[float, float]]

    @property
    def ratios(self) -> list[float]:
        """The time of this version divided by that of the reference, for each turn, ascending."""
        return sorted(this / reference for this, reference in self.pairs)

    @property
    def ratio(self) -> float:
        """The median of the ratios."""
        return statistics.median(self.ratios)

    @property
    def times(self) -> tuple[float, float]:
        """The median times of this version and of the reference [s]."""
        this, reference = zip(*self.pairs, strict=True)
        return statistics.median(this), statistics.median(reference)

    @property
    def is_slower(self) -> bool:
        """Whether this version is slower than the limit allows."""
        return self.ratio > LIMIT


def by_turns(this: Measure, reference: Measure, turns: int) -> list[tuple[float, float]]:
    """Measures two versions alternately.

    The version that is measured first changes from turn to turn, so that a drift of the machine
    favours none.

    Args:
        this: Measures this version.
        reference: Measures the reference.
        turns: Number of pairs, at least 1.

    Returns:
        The pairs of a `Comparison`.
    """
    pairs = []
    for turn in range(turns):
        if turn % 2:
            second = reference()
            pairs.append((this(), second))
        else:
            first = this()
            pairs.append((first, reference()))
    return pairs


def format_comparisons(rows: Sequence[Comparison], reference: str) -> str:
    """Returns a text table.

    Args:
        rows: The rows.
        reference: Name of the reference.
    """
    lines = [["processor time [µs]", "this", reference, "ratio", "min", "max", ""]]
    for row in rows:
        ratios = row.ratios
        lines.append(
            [
                row.name,
                *(f"{time * 1e6:.1f}" for time in row.times),
                *(f"{ratio:.3f}" for ratio in (row.ratio, ratios[0], ratios[-1])),
                "SLOWER" if row.is_slower else "",
            ]
        )
    return "\n".join(aligned(lines))
