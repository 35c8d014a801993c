"""The programs of docs/reliability.md run as printed."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import flatland


def test_the_programs_of_the_documentation_run(
    checkout: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = (checkout / "docs" / "reliability.md").read_text()
    programs = re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    assert len(programs) == 3
    (tmp_path / "worlds").symlink_to(checkout / "worlds")
    monkeypatch.chdir(tmp_path)
    for program in programs:
        exec(program, {"flatland": flatland})
