"""The targets of `make fuzz` with their own inputs, and a short form of the random calls."""

from __future__ import annotations

from pathlib import Path

import pytest
from fuzz_targets import TARGETS
from physics_calls import RandomCalls

FUZZ = Path(__file__).parents[1] / "fuzz"
CORPUS = FUZZ / "corpus"
INPUTS = sorted(CORPUS.glob("*/*"))


def test_every_target_has_inputs() -> None:
    assert {path.parent.name for path in INPUTS} == set(TARGETS)


@pytest.mark.parametrize("path", INPUTS, ids=[f"{p.parent.name}-{p.name}" for p in INPUTS])
def test_an_input_raises_documented_errors_only(path: Path) -> None:
    TARGETS[path.parent.name](path.read_bytes())


def test_random_calls_of_the_physics_engine_leave_it_consistent() -> None:
    """Sequences with extreme numbers, with joints, and with ordinary numbers only."""
    sequences = [RandomCalls(seed) for seed in range(16)]
    for sequence in sequences:
        sequence.run(300)
    assert {sequence.extremes for sequence in sequences} == {0.0, 0.02, 0.2}
    assert 300 < sum(sequence.errors for sequence in sequences) < 2500
    assert sum(sequence.hook_calls for sequence in sequences) > 10
