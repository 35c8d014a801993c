"""The targets of `make fuzz` with their own inputs, and a short form of the random calls."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from fuzz_targets import TARGETS
from physics_calls import CallError, RandomCalls
from programs import run_program

from flatland.physics import PhysicsBody, PhysicsWorld

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


def raise_undocumented(*_: object) -> None:
    raise RuntimeError("not documented")


# The defects below replace these methods.
set_pose, destroy = PhysicsBody.set_pose, PhysicsBody.destroy


def move_and_raise(body: PhysicsBody, *_: float) -> None:
    set_pose(body, 3.25, 0.5, 0.125)
    raise ValueError("half done")


def destroy_more(body: PhysicsBody) -> None:
    destroy(body)
    body.world.create_body("static", (0, 0, 0))


@pytest.mark.parametrize(
    ("owner", "name", "defect", "text"),
    [
        (PhysicsWorld, "find_new_contacts", raise_undocumented, "RuntimeError: not documented"),
        (PhysicsBody, "set_pose", move_and_raise, "changed something and raised"),
        (PhysicsBody, "destroy", destroy_more, "leaves .* objects, not"),
    ],
)
def test_the_random_calls_find_a_defect(
    monkeypatch: pytest.MonkeyPatch,
    owner: type,
    name: str,
    defect: Callable[..., object],
    text: str,
) -> None:
    monkeypatch.setattr(owner, name, defect)
    with pytest.raises(CallError, match=text):
        RandomCalls(3).run(300)


def fuzz(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Runs the program of `make fuzz`, without atheris."""
    support = str(FUZZ.parent / "support")
    path = os.pathsep.join([str(FUZZ.parents[1]), support, os.environ.get("PYTHONPATH", "")])
    return run_program(
        [sys.executable, str(FUZZ / "run.py"), *arguments], env={**os.environ, "PYTHONPATH": path}
    )


def test_the_program_prints_a_line_for_each_target() -> None:
    result = fuzz("--duration", "0.1", "physics")
    assert result.returncode == 0, result.stdout + result.stderr
    assert result.stdout.startswith("physics ")
    assert " sequences of 300 calls" in result.stdout
