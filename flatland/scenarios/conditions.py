"""The grammar of what must hold in a scenario.

    condition := "reached" ["within" NUMBER "s"]
               | "no contact" ["with" NAME]
               | ("at most" | "at least") NUMBER MEASURE
               | MEASURE ("<" | "<=" | ">" | ">=") NUMBER [UNIT]

A MEASURE is a number of the table of runs, such as `clearance` or `recoveries`; a UNIT must be that
of the measure. NAME is a model, a layer, or `people` for any person.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from flatland.config import hints
from flatland.scenarios.columns import MEASURES, Column

_COMPARISONS: Final[dict[str, Callable[[float, float], bool]]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
_NUMBER: Final = r"([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))"
_REACHED: Final = re.compile(rf"reached(?: within {_NUMBER} ?s)?")
_CONTACT: Final = re.compile(r"no contact(?: with (\S+))?")
_COUNT: Final = re.compile(rf"at (most|least) {_NUMBER} (\w+)")
_COMPARISON: Final = re.compile(rf"(\w+) ?(<=|>=|<|>) ?{_NUMBER}(?: ?(\S+))?")
_FORMS: Final = (
    '"reached within 60 s", "no contact", "no contact with people", "at most 3 recoveries" or '
    '"clearance > 0.1 m"'
)


class ConditionError(ValueError):
    """A condition is invalid.

    Attributes:
        hint: What probably helps.
    """

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.hint = hint


@dataclass(frozen=True, slots=True)
class Condition:
    """Something that must hold at the end of a run.

    Attributes:
        text: The condition as written.
        measure: Column that is compared.
        comparison: `<`, `<=`, `>` or `>=`, or `without` for a list of names that must not contain
            `limit`, or anything if that is empty.
        limit: The number, or the name.
        needs_success: Whether the run must also reach all of its goals.
    """

    text: str
    measure: str
    comparison: str
    limit: float | str
    needs_success: bool = False

    def failure(self, row: Mapping[str, Any], people: frozenset[str]) -> str:
        """Returns why a run does not meet the condition, empty if it does.

        Args:
            row: The values of the run by column.
            people: Names of all people of the run.
        """
        if self.needs_success and not row["success"]:
            return f"{self.text}: the outcome is {row['outcome']}"
        if isinstance(self.limit, str):
            touched = (row["collided_with"] or "").split()
            wrong = [
                name
                for name in touched
                if self.limit in ("", name) or (self.limit == "people" and name in people)
            ]
            return f"{self.text}: contact with {', '.join(wrong)}" if wrong else ""
        value = row[self.measure]
        if value is None:
            if not MEASURES[self.measure].far:
                return f"{self.text}: {self.measure} has no value"
            value = math.inf
        if _COMPARISONS[self.comparison](value, self.limit):
            return ""
        return f"{self.text}: {self.measure} is {_shown(value, MEASURES[self.measure])}"


def parse_condition(text: str) -> Condition:
    """Returns the condition of a text.

    Raises:
        ConditionError: The text is not a condition.
    """
    words = " ".join(text.split())
    if found := _REACHED.fullmatch(words):
        limit = math.inf if found[1] is None else float(found[1])
        return Condition(words, "time", "<=", limit, needs_success=True)
    if found := _CONTACT.fullmatch(words):
        return Condition(words, "collided_with", "without", found[1] or "")
    if found := _COUNT.fullmatch(words):
        comparison = {"most": "<=", "least": ">="}[found[1]]
        return Condition(words, _measure(found[3]).name, comparison, float(found[2]))
    if found := _COMPARISON.fullmatch(words):
        column = _measure(found[1])
        unit = found[4]
        if unit is not None and unit != column.unit:
            expected = f"in {column.unit}" if column.unit else "a number without a unit"
            raise ConditionError(
                f'the measure "{column.name}" is {expected}, got the unit "{unit}"'
            )
        return Condition(words, column.name, found[2], float(found[3]))
    raise ConditionError(f'must be a condition such as {_FORMS}, got "{text}"')


def _measure(name: str) -> Column:
    if name not in MEASURES:
        raise ConditionError(
            f'there is no measure "{name}"', hints.did_you_mean(name, MEASURES, "measures")
        )
    return MEASURES[name]


def _shown(value: float, column: Column) -> str:
    return f"{value:.4g} {column.unit}".rstrip()
