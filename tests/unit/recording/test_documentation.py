"""The programs of docs/reliability.md run as printed."""

from __future__ import annotations

from pathlib import Path

import pytest
from pages import code_blocks

import flatland


def test_the_programs_of_the_documentation_run(
    checkout: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    programs = code_blocks((checkout / "docs" / "reliability.md").read_text(), "python")
    assert len(programs) == 3
    (tmp_path / "worlds").symlink_to(checkout / "worlds")
    monkeypatch.chdir(tmp_path)
    for program in programs:
        exec(program, {"flatland": flatland})
