"""Runs the commands of docs/command_line.md and compares their output."""

from __future__ import annotations

import re
import shlex
import sys
from pathlib import Path

import pytest
from flatland_command import main
from forked_workers import CONTEXT
from pages import pattern_of, read_page
from programs import run_program


def run_block(text: str, capsys: pytest.CaptureFixture[str]) -> str:
    """Runs the commands of a block and returns what they print."""
    output = ""
    for line in text.splitlines():
        command, *words = shlex.split(line, comments=True)
        if command == "flatland":
            code = main(*words)
            output += capsys.readouterr().out
        else:
            assert command == "python3"
            code = run_program([sys.executable, *words]).returncode
        assert code == (1 if "# exits with 1" in line else 0), f"{line}\n{output}"
    return output


def test_the_commands_of_the_page_print_what_it_says(checkout, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("flatland.scenarios.workers._CONTEXT", CONTEXT)
    (tmp_path / "worlds").mkdir()
    (tmp_path / "worlds" / "office").symlink_to(checkout / "worlds" / "office")
    output, compared = "", 0
    for block in read_page(checkout / "docs" / "command_line.md"):
        if block.kind == "file":
            Path(block.path).write_text(block.text)
        elif block.kind == "run":
            output = run_block(block.text, capsys)
        elif "-> apt-get" not in block.text:  # that of `flatland doctor` depends on the machine
            assert re.search(pattern_of(block.text), output, re.DOTALL), (
                f"{block.text}\nis not in\n{output}"
            )
            compared += 1
    assert compared == 5


def test_all_commands_and_options_are_described(checkout, capsys):
    page = (checkout / "docs" / "command_line.md").read_text()
    for command in ("check", "info", "show", "run", "view", "test", "new", "doctor"):
        assert f"flatland {command}" in page
    with pytest.raises(SystemExit, match="0"):
        main("run", "--help")
    options = set(re.findall(r"--[a-z][a-z-]+", capsys.readouterr().out))
    assert len(options) > 10
    assert [option for option in options - {"--help"} if option not in page] == []
