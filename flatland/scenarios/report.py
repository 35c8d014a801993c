"""The report of a suite: one HTML file without scripts and without other files."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Final

from flatland.output_files import write_text
from flatland.scenarios.columns import COLUMNS, FAULTS, Row
from flatland.scenarios.comparison import Change, Comparison
from flatland.scenarios.episode import Result
from flatland.scenarios.evidence import distinct, repetitions
from flatland.scenarios.pictures import run_picture, strip_plot
from flatland.scenarios.results import SuiteResults
from flatland.scenarios.summary import MEANS, Estimate, Summary, summarize
from flatland.version import VERSION

MAX_PICTURES: Final = 200
"""Runs that are shown with a picture, the worst ones; all others are in the table."""

_PLOTS: Final = ("time", "spl", "clearance", "jerk", "people_distance", "command_time")
_DETAILS: Final = (
    "time",
    "path_length",
    "spl",
    "collisions",
    "collided_with",
    "impact_speed",
    "clearance",
    "jerk",
    "angular_jerk",
    "stuck_time",
    "recoveries",
    "people_distance",
    "intrusions",
    "energy",
    "command_time",
)
_DIGITS: Final = {"spl": 2, "clearance": 2, "collisions": 2, "command_time": 2}


@dataclass(frozen=True, slots=True)
class Report:
    """What a report contains besides the results.

    Attributes:
        command: The command that was run, as a list of words.
        comparisons: Comparisons by title.
    """

    command: Sequence[str] = ()
    comparisons: Mapping[str, Comparison] = field(default_factory=dict)


def write_report(results: SuiteResults, report: Report, path: Path) -> None:
    """Writes the report."""
    style = (files("flatland.scenarios") / "report.css").read_text(encoding="utf-8")
    runs = worst_first(results.results)
    body = [
        _heading(results, report),
        _summary_section(summarize(results.rows), results.rows),
        *(_comparison_section(*item) for item in report.comparisons.items()),
        _plots_section(results),
        _runs_section(results, runs, path.parent),
    ]
    text = (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        '<meta name="color-scheme" content="light dark"><link rel="icon" href="data:,">'
        f"<title>flatland test</title><style>{style}</style></head>\n"
        f"<body><main>{chr(10).join(filter(None, body))}</main></body></html>\n"
    )
    write_text(path, text)


def worst_first(results: Iterable[Result]) -> list[Result]:
    """Returns results in order of quality: errors, failures, then by SPL and clearance."""

    def quality(result: Result) -> tuple[bool, bool, bool, float, float]:
        row = result.row
        clearance = math.inf if row["clearance"] is None else row["clearance"]
        return (
            row["outcome"] not in FAULTS,
            row["passed"],
            row["success"],
            row["spl"] or 0.0,
            clearance,
        )

    return sorted(results, key=quality)


def _heading(results: SuiteResults, report: Report) -> str:
    rows = results.rows
    passed = sum(row["passed"] for row in rows)
    errors = sum(row["outcome"] in FAULTS for row in rows)
    parts = [f"{passed} of {len(rows)} runs passed"]
    if errors:
        parts.append(f"{errors} with an error")
    if results.missing:
        parts.append(f"{results.missing} missing, because the suite was interrupted")
    kind = "good" if passed == len(rows) and not results.missing else "bad"
    command = f"<p><code>{escape(shlex.join(report.command))}</code></p>" if report.command else ""
    return (
        f'<h1>flatland test</h1><p class="verdict {kind}">{", ".join(parts)}</p>{command}'
        f"<p>flatland {escape(VERSION)}</p>"
    )


# -- tables --------------------------------------------------------------------------------


def _summary_section(summaries: Sequence[Summary], rows: Sequence[Row]) -> str:
    head = ["scenarios", "controller", "runs", "errors", "passed", "success"]
    head += [_label(name) for name in MEANS]
    lines = []
    for one in summaries:
        cells = [escape(one.group), escape(one.controller), str(one.runs), str(one.errors)]
        cells += [_rate(one.passed), _rate(one.success)]
        cells += [_mean(one.means[name], _DIGITS.get(name, 1)) for name in MEANS]
        lines.append(cells)
    note = (
        "Rates with 95 % Wilson intervals, means with 95 % bootstrap intervals. Times and paths "
        "are those of the runs that reached all goals."
    )
    equal = repetitions(rows)
    if equal:
        note += " Equal runs count once in rates, means, intervals and comparisons."
    listed = _list("Equal runs", map(str, equal))
    return f"<h2>Summary</h2>{_table(head, lines, 2)}<p>{note}</p>{listed}"


def _comparison_section(title: str, comparison: Comparison) -> str:
    head = ["measure", "pairs", "before", "after", "p", "verdict"]
    lines = []
    for one in comparison.differences:
        verdict = f'<span class="{one.verdict}">{one.verdict}</span>' if one.verdict else ""
        cells = [_label(one.measure), str(one.pairs), f"{one.before:.4g}", f"{one.after:.4g}"]
        lines.append([*cells, f"{one.p_value:.3g}", verdict])
    note = (
        f"{comparison.pairs} pairs of runs of the same scenario and seed, {comparison.distinct} of "
        "them distinct: the exact test of McNemar for rates, the signed-rank test of Wilcoxon for "
        "other measures. The p-values are adjusted by the method of Holm, except for that of "
        "passed, which is tested on its own."
    )
    body = _table(head, lines, 1) if lines else "<p>There are no runs in common.</p>"
    lost = _changes("From pass to fail", comparison.lost)
    gained = _changes("From fail to pass", comparison.gained)
    return f"<h2>{escape(title)}</h2>{lost}{gained}{body}<p>{note}</p>"


def _changes(title: str, changes: Sequence[Change]) -> str:
    return _list(title, map(str, changes), is_open=True)


def _list(title: str, items: Iterable[str], *, is_open: bool = False) -> str:
    """Returns a list of texts that can be folded, with their number; empty without items."""
    lines = [f"<li>{escape(item)}</li>" for item in items]
    if not lines:
        return ""
    state = " open" if is_open else ""
    return (
        f"<details{state}><summary>{escape(title)}: {len(lines)}</summary>"
        f"<ul>{''.join(lines)}</ul></details>"
    )


def _table(head: Sequence[str], lines: Iterable[Sequence[str]], texts: int) -> str:
    """Returns a table whose first columns are texts; cells are HTML."""

    def row(cells: Sequence[str], tag: str) -> str:
        marked = (
            f"<{tag}>{cell}</{tag}>" if number < texts else f'<{tag} class="n">{cell}</{tag}>'
            for number, cell in enumerate(cells)
        )
        return f"<tr>{''.join(marked)}</tr>"

    body = "".join(row(cells, "td") for cells in lines)
    return (
        f'<div class="wide"><table><thead>{row(head, "th")}</thead>'
        f"<tbody>{body}</tbody></table></div>"
    )


def _label(name: str) -> str:
    unit = COLUMNS[name].unit
    text = name.replace("_", " ") if name != "spl" else "SPL"
    return escape(f"{text} [{unit}]" if unit else text)


def _rate(rate: Estimate) -> str:
    share = 100 * rate.value
    return f"{share:.0f} %<br><small>{100 * rate.low:.0f} to {100 * rate.high:.0f}</small>"


def _mean(mean: Estimate, digits: int) -> str:
    if math.isnan(mean.value):
        return "-"
    text = f"{mean.value:.{digits}f}"
    if math.isnan(mean.low):
        return text
    return f"{text}<br><small>{mean.low:.{digits}f} to {mean.high:.{digits}f}</small>"


# -- runs ----------------------------------------------------------------------------------


def _plots_section(results: SuiteResults) -> str:
    rows = distinct(results.rows)
    controllers = list(dict.fromkeys(row["controller"] for row in rows))
    plots = []
    for name in _PLOTS:
        values = {
            controller: [
                (f"{row['scenario']} seed {row['seed']}", float(row[name]))
                for row in rows
                if row["controller"] == controller and row[name] is not None
            ]
            for controller in controllers
        }
        plots.append(strip_plot(name.replace("_", " "), values, COLUMNS[name].unit))
    note = "One dot for each distinct run of a scenario; the line is the mean."
    return f'<h2>All runs</h2><div class="plots">{"".join(plots)}</div><p>{note}</p>'


def _runs_section(results: SuiteResults, runs: Sequence[Result], folder: Path) -> str:
    shown = runs[:MAX_PICTURES]
    cards = "".join(_card(results, result, folder) for result in shown)
    rest = ""
    if len(runs) > len(shown):
        rest = f"<p>The other {len(runs) - len(shown)} runs are in results.csv.</p>"
    note = ""
    if any(result.recording for result in shown):
        command = escape(shlex.join(["flatland", "replay", str(folder), "--view"]))
        note = (
            f"<p><code>{command}</code> shows this report with links that replay the runs in the "
            "viewer. Without it, a link opens the file of the recording.</p>"
        )
    return f'<h2>Runs, the worst ones first</h2>{note}<div class="runs">{cards}</div>{rest}'


def _card(results: SuiteResults, result: Result, folder: Path) -> str:
    row = result.row
    kind = "good" if row["passed"] else "bad"
    title = f"{row['scenario']} · seed {row['seed']}"
    details = "".join(
        f"<dt>{_label(name)}</dt><dd>{escape(_value(row, name))}</dd>"
        for name in _DETAILS
        if row[name] is not None
    )
    failures = f'<p class="bad">{escape(row["failures"])}</p>' if row["failures"] else ""
    return (
        f'<article class="{kind}"><h3>{escape(title)}</h3>'
        f"<p>{escape(row['controller'])}: <b>{escape(row['outcome'])}</b></p>{failures}"
        f"{run_picture(result, results.lines_of(result))}"
        f"<details><summary>Measures</summary><dl>{details}</dl></details>"
        f"{_replay(result, folder)}</article>"
    )


def _replay(result: Result, folder: Path) -> str:
    if not result.recording:
        return ""
    command = shlex.join(["flatland", "replay", str(folder / result.recording), "--view"])
    # When the report is served, this address leads to the viewer.
    link = escape(result.recording, quote=True)
    return f'<p><a href="{link}">Replay</a><br><code>{escape(command)}</code></p>'


def _value(row: Row, name: str) -> str:
    value = row[name]
    return f"{value:.4g}" if isinstance(value, float) else str(value)
