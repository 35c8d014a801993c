"""One row of the benchmark, and the table of all rows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Row:
    """One figure.

    Attributes:
        name: What was measured; the key by which a baseline is compared.
        value: The figure.
        unit: Its unit; `U` is one scan of 1081 beams by `b2World::RayCast`, measured in this run.
        bar: What it should be, None where there is no bar.
        at_least: Whether the bar is a least value; else it is a greatest one.
        note: The same in other units, or how it was measured.
    """

    name: str
    value: float
    unit: str
    bar: float | None = None
    at_least: bool = False
    note: str = ""

    @property
    def ratio(self) -> float | None:
        """The figure as a share of its bar."""
        return None if self.bar is None else self.value / self.bar

    @property
    def met(self) -> bool | None:
        """Whether the bar is met, None without a bar."""
        if self.bar is None:
            return None
        return self.value >= self.bar if self.at_least else self.value <= self.bar


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.4g}"


def format_table(rows: Iterable[Row], baseline: Mapping[str, float]) -> str:
    """Writes rows as a table, with the change against a baseline where there is one."""
    lines = [("", "figure", "bar", "figure/bar", "", "against baseline", "")]
    for row in rows:
        verdict = {True: "met", False: "MISSED", None: ""}[row.met]
        sign = "" if row.bar is None else ("≥ " if row.at_least else "≤ ")
        before = baseline.get(row.name)
        lines.append(
            (
                row.name,
                f"{_number(row.value)} {row.unit}".strip(),
                f"{sign}{_number(row.bar)}",
                _number(row.ratio),
                verdict,
                "" if not before else f"{row.value / before:.3f}",
                row.note,
            )
        )
    if not baseline:
        lines = [line[:5] + line[6:] for line in lines]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
        for line in lines
    )


def as_json(rows: Iterable[Row]) -> list[dict[str, Any]]:
    """Returns rows as plain data."""
    return [{**asdict(row), "ratio": row.ratio, "met": row.met} for row in rows]
