"""Rates and means of the runs of each scenario file and controller, with their intervals."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from flatland.scenarios.columns import FAULTS, Row
from flatland.scenarios.evidence import distinct, repetitions
from flatland.scenarios.statistics import bootstrap_interval, wilson_interval

MEANS: Final = ("spl", "time", "path_length", "collisions", "clearance", "jerk", "command_time")
"""The measures of a summary; times and lengths are those of successes."""

_OF_SUCCESSES: Final = ("time", "path_length")
_MOST_NOTES: Final = 10  # scenarios with equal runs that are named below a table


@dataclass(frozen=True, slots=True)
class Estimate:
    """A rate or mean with its 95 % interval; NaN without runs.

    The interval of a mean is NaN for a single run.
    """

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Summary:
    """The runs of some scenarios with one controller.

    Attributes:
        group: Name of the scenario file, or `all`.
        controller: The controller.
        runs: Number of runs.
        errors: Number of runs with an error.
        passed: Share of the distinct runs that met all conditions.
        success: Share of the distinct runs that reached all goals.
        means: Means of `MEANS` of the distinct runs, NaN for one without values.
    """

    group: str
    controller: str
    runs: int
    errors: int
    passed: Estimate
    success: Estimate
    means: dict[str, Estimate]


def group_of(row: Row) -> str:
    """Returns the name of the scenario file of a row."""
    return str(row["scenario"]).partition("/")[0].partition("[")[0]


def summarize(rows: Iterable[Row]) -> list[Summary]:
    """Returns a summary for each scenario file and controller, and for all files together.

    Equal runs count once in rates, means and intervals. Runs with an error have neither passed nor
    succeeded.

    Args:
        rows: The rows, in the order of the summaries.
    """
    all_rows = list(rows)
    groups = list(dict.fromkeys(map(group_of, all_rows)))
    controllers = list(dict.fromkeys(row["controller"] for row in all_rows))
    summaries = [
        _summary(group, controller, [row for row in all_rows if group_of(row) == group])
        for group in groups
        for controller in controllers
    ]
    if len(groups) > 1:
        summaries += [_summary("all", controller, all_rows) for controller in controllers]
    return [summary for summary in summaries if summary.runs]


def _summary(group: str, controller: str, rows: Sequence[Row]) -> Summary:
    made = [row for row in rows if row["controller"] == controller]
    own = distinct(made)
    return Summary(
        group,
        controller,
        len(made),
        sum(row["outcome"] in FAULTS for row in made),
        _rate([row["passed"] for row in own]),
        _rate([row["success"] for row in own]),
        {name: _mean(name, own) for name in MEANS},
    )


def _rate(values: Sequence[bool]) -> Estimate:
    rate = sum(values) / len(values) if values else math.nan
    return Estimate(rate, *wilson_interval(sum(values), len(values)))


def _mean(name: str, rows: Sequence[Row]) -> Estimate:
    values = [
        float(row[name])
        for row in rows
        if row[name] is not None and (row["success"] or name not in _OF_SUCCESSES)
    ]
    mean = sum(values) / len(values) if values else math.nan
    return Estimate(mean, *bootstrap_interval(values))


def repetition_notes(rows: Iterable[Row], most: int = _MOST_NOTES) -> list[str]:
    """Returns the lines below a table about equal runs, none without equal runs.

    Args:
        rows: The rows.
        most: Number of scenarios and controllers that are named.
    """
    found = repetitions(rows)
    if not found:
        return []
    lines = ["equal runs count once in rates, means, intervals and comparisons:"]
    lines += [f"  {one}" for one in found[:most]]
    if len(found) > most:
        lines.append(f"  and {len(found) - most} more, see the report")
    return lines


def summary_table(summaries: Sequence[Summary]) -> str:
    """Returns summaries as a table of text, with intervals."""
    lines = _lines(summaries, intervals=True)
    widths = [max(len(line[column]) for line in lines) for column in range(len(lines[0]))]
    return "\n".join(
        "  ".join(
            text.ljust(width) if column < 2 else text.rjust(width)
            for column, (text, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in lines
    )


def markdown_table(summaries: Sequence[Summary]) -> str:
    """Returns summaries as a table of Markdown, such as the leaderboard of the documentation."""
    head, *lines = _lines(summaries, intervals=False)
    lines = [head, ["---"] * len(head), *lines]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _lines(summaries: Sequence[Summary], *, intervals: bool) -> list[list[str]]:
    """Returns the cells of a table with its head; the interval of `passed` is always shown."""
    head = ["scenarios", "controller", "runs", "passed", "success", "SPL", "time [s]"]
    head += ["collisions", "clearance [m]", "errors"]
    lines = [head]
    for one in summaries:
        means = [
            _shown(one.means[name], digits, intervals)
            for name, digits in (("spl", 2), ("time", 1), ("collisions", 2), ("clearance", 2))
        ]
        rates = [_percent(one.passed, True), _percent(one.success, intervals)]
        controller = one.controller if intervals else f"`{one.controller}`"
        lines.append([one.group, controller, str(one.runs), *rates, *means, str(one.errors)])
    return lines


def _percent(rate: Estimate, interval: bool) -> str:
    text = f"{100 * rate.value:.0f} %"
    return f"{text} ({100 * rate.low:.0f}-{100 * rate.high:.0f})" if interval else text


def _shown(mean: Estimate, digits: int, interval: bool) -> str:
    if math.isnan(mean.value):
        return "-"
    text = f"{mean.value:.{digits}f}"
    if not interval or math.isnan(mean.low):
        return text
    return f"{text} ({mean.low:.{digits}f}-{mean.high:.{digits}f})"
