"""Paired comparison of two sets of runs of the same scenarios and seeds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from flatland.scenarios.columns import COLUMNS, MEASURES, Row
from flatland.scenarios.evidence import identity
from flatland.scenarios.statistics import holm_adjusted, mcnemar_test, wilcoxon_test

SIGNIFICANCE: Final = 0.05
"""Largest p-value of a significant difference."""

RELEVANCE: Final = 0.01
"""Relative difference of means up to which a difference does not matter, however regular it is."""

PRIMARY: Final = "passed"
"""The measure that a comparison is about, tested on its own at the full level."""

_RATES: Final = (PRIMARY, "success")
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
        pairs: Number of distinct pairs of runs, both with a value.
        before: Mean of the first set.
        after: Mean of the second set.
        p_value: Two-sided p-value; adjusted for the number of measures, except that of `passed`.
        verdict: `better`, `worse` or empty, if the difference is not significant, or, except for
            `passed`, at most 1 %.
    """

    measure: str
    pairs: int
    before: float
    after: float
    p_value: float
    verdict: str


@dataclass(frozen=True, slots=True)
class Change:
    """A run that passed in one set and not in the other.

    Attributes:
        scenario: Title of the scenario.
        seed: The seed.
        failures: Why the run did not pass in the set in which it failed.
    """

    scenario: str
    seed: int
    failures: str

    def __str__(self) -> str:
        return f"{self.scenario} seed {self.seed}: {self.failures}"


@dataclass(frozen=True, slots=True)
class Comparison:
    """The comparison of two sets of runs.

    Attributes:
        differences: Differences of all measures.
        lost: Runs that passed in the first set only.
        gained: Runs that passed in the second set only.
        pairs: Number of runs that both sets have.
        distinct: Number of those pairs of which no two are equal.
        only_before: Number of runs that only the first set has.
        only_after: Number of runs that only the second set has.
    """

    differences: Sequence[Difference] = ()
    lost: Sequence[Change] = ()
    gained: Sequence[Change] = ()
    pairs: int = 0
    distinct: int = 0
    only_before: int = 0
    only_after: int = 0

    @property
    def worse(self) -> list[str]:
        """The measures that became significantly worse."""
        return [one.measure for one in self.differences if one.verdict == "worse"]


def compare(before: Iterable[Row], after: Iterable[Row]) -> Comparison:
    """Compares runs with the same scenario and seed.

    `passed` and `success` are compared by the exact test of McNemar, other measures by the
    signed-rank test of Wilcoxon. `passed` is tested on its own; the p-values of all other measures
    are adjusted by the method of Holm. Pairs of equal runs are one pair. Times, paths, energy and
    jerk are compared for runs that have both reached their goals.

    Args:
        before: Rows of one controller.
        after: Rows of one controller, maybe the same one.
    """
    known = {_key(row): row for row in before}
    new = {_key(row): row for row in after}
    pairs = [(known[key], row) for key, row in new.items() if key in known]
    distinct = list({(identity(a), identity(b)): (a, b) for a, b in pairs}.values())
    found: list[tuple[str, list[tuple[float, float]]]] = []
    for measure in _COMPARED:
        values = _values(measure, distinct)
        if values:
            found.append((measure, values))
    p_values = [_p_value(measure, values) for measure, values in found]
    if found:  # The first one is the primary measure.
        p_values[1:] = holm_adjusted(p_values[1:])
    return Comparison(
        [
            _difference(measure, values, p)
            for (measure, values), p in zip(found, p_values, strict=True)
        ],
        [_change(b) for a, b in pairs if a[PRIMARY] and not b[PRIMARY]],
        [_change(a) for a, b in pairs if b[PRIMARY] and not a[PRIMARY]],
        len(pairs),
        len(distinct),
        len(known.keys() - new.keys()),
        len(new.keys() - known.keys()),
    )


def _key(row: Row) -> tuple[str, int]:
    return (row["scenario"], row["seed"])


def _change(failed: Row) -> Change:
    return Change(failed["scenario"], failed["seed"], failed["failures"] or failed["outcome"])


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
    is_relevant = measure == PRIMARY or abs(after - before) > RELEVANCE * max(
        abs(before), abs(after)
    )
    if p <= SIGNIFICANCE and is_relevant:
        is_more = after > before
        verdict = "better" if is_more == (COLUMNS[measure].better == "more") else "worse"
    return Difference(measure, len(values), before, after, p, verdict)
