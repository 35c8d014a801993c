"""Rows and table of the results."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Row:
    """The result of one measurement.

    Attributes:
        name: Name of the measurement.
        value: Measured value.
        unit: Unit of the value; `U` is the time of one scan of 1081 beams with
            `b2World::RayCast`, measured in the same run.
        bar: Limit of the value, None for no limit.
        at_least: Whether the bar is a lower limit; otherwise it is an upper limit.
        note: The value in other units, or conditions of the measurement.
    """

    name: str
    value: float
    unit: str
    bar: float | None = None
    at_least: bool = False
    note: str = ""

    @property
    def ratio(self) -> float | None:
        """The value divided by the bar, None without a bar."""
        return None if self.bar is None else self.value / self.bar

    @property
    def met(self) -> bool | None:
        """Whether the value is within its limit, None without a bar."""
        if self.bar is None:
            return None
        return bool(self.value >= self.bar if self.at_least else self.value <= self.bar)


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.4g}"


def format_table(rows: Iterable[Row]) -> str:
    """Returns rows as a text table."""
    lines = [("", "value", "bar", "value/bar", "", "")]
    for row in rows:
        verdict = {True: "met", False: "MISSED", None: ""}[row.met]
        sign = "" if row.bar is None else ("≥ " if row.at_least else "≤ ")
        lines.append(
            (
                row.name,
                f"{_number(row.value)} {row.unit}".strip(),
                f"{sign}{_number(row.bar)}",
                _number(row.ratio),
                verdict,
                row.note,
            )
        )
    return "\n".join(aligned(lines))


def aligned(lines: Sequence[Sequence[str]]) -> Iterator[str]:
    """Yields lines whose cells are padded to the widths of their columns."""
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    for line in lines:
        cells = (cell.ljust(width) for cell, width in zip(line, widths, strict=True))
        yield "  ".join(cells).rstrip()


def as_json(rows: Iterable[Row]) -> list[dict[str, Any]]:
    """Returns rows as JSON-compatible data."""
    return [{**asdict(row), "ratio": row.ratio, "met": row.met} for row in rows]
