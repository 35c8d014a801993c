"""Two versions are compared by the ratios of turns."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture
def turns(checkout: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(checkout / "bench"))
    return importlib.import_module("by_turns")


def test_the_version_that_is_measured_first_changes(turns: ModuleType) -> None:
    order = []

    def measure(name: str, time: float) -> float:
        order.append(name)
        return time

    pairs = turns.by_turns(lambda: measure("this", 1.0), lambda: measure("reference", 2.0), 3)
    assert pairs == [(1.0, 2.0)] * 3
    assert order == ["this", "reference", "reference", "this", "this", "reference"]


def test_a_disturbance_of_both_versions_does_not_change_the_ratio(turns: ModuleType) -> None:
    row = turns.Comparison("row", [(1.0, 2.0), (5.0, 10.0), (3.0, 2.0)])
    assert row.ratios == [0.5, 0.5, 1.5]
    assert row.ratio == 0.5
    assert row.times == (3.0, 2.0)
    assert not row.is_slower


@pytest.mark.parametrize(("time", "is_slower"), [(1.04, False), (1.06, True)])
def test_rows_that_are_slower_are_marked(turns: ModuleType, time: float, is_slower: bool) -> None:
    row = turns.Comparison("row", [(time, 1.0)])
    assert row.is_slower == is_slower
    table = turns.format_comparisons([row], "main").splitlines()
    assert table[0].split()[-5:] == ["this", "main", "ratio", "min", "max"]
    assert table[1].endswith("SLOWER") == is_slower
