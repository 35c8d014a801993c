"""Names that may be meant, and short lists of many names."""

from __future__ import annotations

import pytest

from flatland.suggestions import did_you_mean, listed


@pytest.mark.parametrize(
    ("count", "text"),
    [
        (0, "none"),
        (1, "r0"),
        (5, "r0, r1, r2, r3, r4"),
        (6, "r0, r1, r2, r3, r4 and 1 more"),
        (600, "r0, r1, r2, r3, r4 and 595 more"),
    ],
)
def test_a_list_has_five_names_and_the_number_of_the_others(count: int, text: str) -> None:
    assert listed(f"r{number}" for number in range(count)) == text


def test_similar_names_are_found_among_many() -> None:
    names = [f"crate{number}" for number in range(5000)] + ["robot_left", "robot_right"]
    assert did_you_mean("Robot-left", names, "models") == 'did you mean "robot_left"?'
    assert did_you_mean("crate4999x", names, "models").startswith('did you mean "crate4999"')
    unlike = "models: crate0, crate1, crate2, crate3, crate4 and 4997 more"
    assert did_you_mean("?!", names, "models") == unlike
    assert did_you_mean("?!", names) == ""
