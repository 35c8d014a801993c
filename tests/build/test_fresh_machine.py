"""Arguments of `tools/fresh_machine.sh`; `make fresh` tests the rest."""

from __future__ import annotations

from pathlib import Path

import pytest
from programs import run_program


@pytest.mark.parametrize(
    "arguments",
    [[], ["trixie"], ["buster", "true"], ["--again"], ["--unknown", "trixie", "true"]],
)
def test_wrong_arguments_result_in_the_usage(checkout: Path, arguments: list[str]) -> None:
    done = run_program([checkout / "tools/fresh_machine.sh", *arguments])
    assert done.returncode == 1
    assert "usage: tools/fresh_machine.sh" in done.stderr
