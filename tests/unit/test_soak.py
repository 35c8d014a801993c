"""Short runs of `make soak`."""

from __future__ import annotations

import importlib.util
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture(scope="module")
def soak(checkout: Path) -> Iterator[ModuleType]:
    """The module `bench/soak.py`."""
    sys.path.insert(0, str(checkout / "bench"))
    try:
        spec = importlib.util.spec_from_file_location("soak", checkout / "bench" / "soak.py")
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules["soak"] = module
        spec.loader.exec_module(module)
        yield module
    finally:
        sys.path.remove(str(checkout / "bench"))
        sys.modules.pop("soak", None)


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"memory": 110.0}, "memory grows from 100.0 to 110.0 MB"),
        ({"threads": 4}, r"threads vary: \[3, 4\]"),
        ({"descriptors": 9}, "descriptors vary"),
        ({"bodies": 7}, "bodies vary"),
        ({"fixtures": 7}, "fixtures vary"),
        ({"joints": 7}, "joints vary"),
    ],
)
def test_growth_is_found(soak: ModuleType, change: dict[str, float], fault: str) -> None:
    usual = {
        "memory": 100.0,
        "threads": 3,
        "descriptors": 8,
        "bodies": 6,
        "fixtures": 6,
        "joints": 0,
    }
    steady = [soak.Sample(**usual)] * 30
    assert soak.growth(steady) == []
    faults = soak.growth([*steady, soak.Sample(**{**usual, **change})])
    assert len(faults) == 1
    assert re.search(fault, faults[0])


def test_changes_in_the_first_tenth_are_ignored(soak: ModuleType) -> None:
    first = soak.Sample(50.0, 1, 3, 1, 1, 1)
    assert soak.growth([first, first, *[soak.Sample(100.0, 3, 8, 6, 6, 0)] * 18]) == []


def test_descriptors_of_a_node_may_vary_but_not_grow(soak: ModuleType) -> None:
    varying = [soak.Sample(100.0, 3, 40 + number % 7) for number in range(40)]
    assert soak.growth(varying) == []
    growing = [soak.Sample(100.0, 3, 40 + 3 * number) for number in range(40)]
    assert soak.growth(growing) == ["descriptors grow from 103 to 157"]
