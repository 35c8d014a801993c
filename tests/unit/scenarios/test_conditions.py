from __future__ import annotations

import pytest

from flatland.scenarios.columns import empty_row
from flatland.scenarios.conditions import ConditionError, parse_condition

NOBODY: frozenset[str] = frozenset()


def row(**values):
    return empty_row(("s", "c", 1)) | {"success": True, "outcome": "reached", "time": 10.0} | values


@pytest.mark.parametrize(
    ("text", "values", "failure"),
    [
        ("reached", {}, ""),
        ("reached within 10 s", {}, ""),
        ("reached within 9.5 s", {}, "reached within 9.5 s: time is 10 s"),
        ("reached", {"success": False, "outcome": "stuck"}, "reached: the outcome is stuck"),
        ("no contact", {}, ""),
        ("no contact", {"collided_with": "a b"}, "no contact: contact with a, b"),
        ("no contact with b", {"collided_with": "a"}, ""),
        ("no contact with b", {"collided_with": "a b"}, "no contact with b: contact with b"),
        ("at most 3 recoveries", {"recoveries": 3}, ""),
        ("at most 3 recoveries", {"recoveries": 4}, "at most 3 recoveries: recoveries is 4"),
        ("at least 2 goals", {"goals": 1}, "at least 2 goals: goals is 1"),
        ("clearance > 0.1 m", {"clearance": 0.2}, ""),
        ("clearance>0.1", {"clearance": 0.1}, "clearance>0.1: clearance is 0.1 m"),
        ("clearance > 0.1 m", {"clearance": None}, ""),
        ("spl >= 0.5", {"spl": None}, "spl >= 0.5: spl has no value"),
        ("jerk <= 2 m/s^3", {"jerk": 2.0}, ""),
    ],
)
def test_conditions(text, values, failure):
    assert parse_condition(text).failure(row(**values), NOBODY) == failure


def test_people_are_any_person():
    condition = parse_condition("no  contact with people")
    touched = row(collided_with="box visitor_1")
    assert condition.failure(touched, NOBODY) == ""
    failure = condition.failure(touched, frozenset(["visitor_1", "visitor_2"]))
    assert failure == "no contact with people: contact with visitor_1"


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    [
        ("arrives soon", 'must be a condition such as "reached within 60 s"', ""),
        ("reached within 60", "must be a condition", ""),
        ("clerance > 1", 'there is no measure "clerance"', 'did you mean "clearance"?'),
        ("clearance > 0.1 s", '"clearance" is in m, got the unit "s"', ""),
        ("spl > 0.5 m", '"spl" is a number without a unit', ""),
        ("at most 3 recovery", 'there is no measure "recovery"', 'did you mean "recoveries"?'),
    ],
)
def test_invalid_conditions(text, message, hint):
    with pytest.raises(ConditionError) as caught:
        parse_condition(text)
    assert message in str(caught.value)
    assert caught.value.hint == hint
