"""Paired comparison of two sets of runs of the same scenarios and seeds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from flatland.scenarios.columns import COLUMNS, MEASURES, Row
from flatland.scenarios.statistics import holm_adjusted, mcnemar_test, wilcoxon_test

SIGNIFICANCE: Final = 0.05
"""Largest adjusted p-value of a significant difference."""

RELEVANCE: Final = 0.01
"""Relative difference of means up to which a difference does not matter, however regular it is."""

_RATES: Final = ("passed", "success")
# Only comparable between runs that have reached their goals.
_OF_SUCCESSES: Final = ("time", "path_length", "energy", "jerk", "angular_jerk")
_COMPARED: Final = (
    *_RATES,
    *(
        name
        for name in MEASURES
        if name not in ("goals", "final_distance", "impact_speed") and name not in _RATES
    ),
)


@dataclass(frozen=True, slots=True)
class Difference:
    """The difference of one measure between two sets of runs.

    Attributes:
        measure: Column.
        pairs: Number of runs that both sets have, with a value.
        before: Mean of the first set.
        after: Mean of the second set.
        p_value: Two-sided p-value, adjusted for the number of measures.
        verdict: `better`, `worse` or empty, if the difference is not significant or at most 1 %.
    """

    measure: str
    pairs: int
    before: float
    after: float
    p_value: float
    verdict: str


def compare(before: Iterable[Row], after: Iterable[Row]) -> list[Difference]:
    """Compares all measures of runs with the same scenario and seed.

    `passed` and `success` are compared by the exact test of McNemar, other measures by the
    signed-rank test of Wilcoxon; p-values are adjusted by the method of Holm. Times, paths, energy
    and jerk are compared for runs that have both reached their goals.

    Args:
        before: Rows of one controller.
        after: Rows of one controller, maybe the same one.
    """
    known = {_key(row): row for row in before}
    pairs = [(known[_key(row)], row) for row in after if _key(row) in known]
    found: list[tuple[str, list[tuple[float, float]]]] = []
    for measure in _COMPARED:
        values = _values(measure, pairs)
        if values:
            found.append((measure, values))
    p_values = holm_adjusted([_p_value(measure, values) for measure, values in found])
    return [
        _difference(measure, values, p)
        for (measure, values), p in zip(found, p_values, strict=True)
    ]


def became_worse(differences: Sequence[Difference]) -> list[str]:
    """Returns the measures that became significantly worse."""
    return [one.measure for one in differences if one.verdict == "worse"]


def _key(row: Row) -> tuple[str, int]:
    return (row["scenario"], row["seed"])


def _values(measure: str, pairs: Sequence[tuple[Row, Row]]) -> list[tuple[float, float]]:
    needs_success = measure in _OF_SUCCESSES
    return [
        (float(a[measure]), float(b[measure]))
        for a, b in pairs
        if a[measure] is not None
        and b[measure] is not None
        and (not needs_success or (a["success"] and b["success"]))
    ]


def _p_value(measure: str, values: Sequence[tuple[float, float]]) -> float:
    if measure in _RATES:
        return mcnemar_test(sum(b > a for a, b in values), sum(b < a for a, b in values))
    # Differences of the last bits are those of other compilers, not of controllers.
    return wilcoxon_test([round(b - a, 9) for a, b in values])


def _difference(measure: str, values: Sequence[tuple[float, float]], p: float) -> Difference:
    before = sum(a for a, _ in values) / len(values)
    after = sum(b for _, b in values) / len(values)
    verdict = ""
    is_relevant = abs(after - before) > RELEVANCE * max(abs(before), abs(after))
    if p <= SIGNIFICANCE and is_relevant:
        is_more = after > before
        verdict = "better" if is_more == (COLUMNS[measure].better == "more") else "worse"
    return Difference(measure, len(values), before, after, p, verdict)
