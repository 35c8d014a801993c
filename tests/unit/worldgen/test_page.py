"""The commands and the program of docs/random_worlds.md."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest
from flatland_command import main
from pages import code_blocks


@pytest.fixture
def page(checkout: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """The text of the page; the current folder is empty."""
    monkeypatch.chdir(tmp_path)
    return (checkout / "docs" / "random_worlds.md").read_text()


def test_the_commands_succeed(page: str, capsys: pytest.CaptureFixture[str]) -> None:
    [commands] = code_blocks(page, "bash")
    for line in commands.splitlines():
        program, *words = shlex.split(line)
        assert program == "flatland"
        assert main(*words) == 0, capsys.readouterr().err


def test_the_program_runs(page: str, capsys: pytest.CaptureFixture[str]) -> None:
    [program] = code_blocks(page, "python")
    names: dict[str, object] = {}
    exec(compile(program, "random_worlds.md", "exec"), names)
    assert capsys.readouterr().out.startswith("(400, 600) (")
    assert len(names["poses"]) == 20  # type: ignore[arg-type]
