"""Runs the commands `flatland ...` of the pages that contain them, in a folder with the worlds."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from flatland_command import main

_COMMAND = re.compile(r"^flatland ((?:show|check) .*)$", re.MULTILINE)


@pytest.mark.parametrize("page", ["README.md", "docs/drawing.md"])
def test_the_commands_of_a_page_succeed(page, checkout, tmp_path, monkeypatch):
    (tmp_path / "worlds").symlink_to(checkout / "worlds")
    robot = checkout / "worlds" / "simple" / "robot.model.yaml"
    (tmp_path / "robot.model.yaml").symlink_to(robot)
    monkeypatch.chdir(tmp_path)
    commands = _COMMAND.findall((checkout / page).read_text())
    assert commands
    for command in commands:
        assert main(*shlex.split(command, comments=True)) == 0
        for picture in re.findall(r" -o (\S+)", command):
            assert Path(picture).stat().st_size > 0
