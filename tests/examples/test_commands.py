"""Runs the commands `flatland ...` of the pages that contain them, in a folder with the worlds."""

from __future__ import annotations

import os
import re

import pytest

_COMMAND = re.compile(r"^flatland (?:show|check) .*$", re.MULTILINE)
PAGES = ["README.md", "docs/drawing.md"]


@pytest.mark.parametrize("page", PAGES)
def test_the_commands_of_a_page_succeed(page, checkout, environment, tmp_path, run_command):
    (tmp_path / "worlds").symlink_to(checkout / "worlds")
    robot = checkout / "worlds" / "simple" / "robot.model.yaml"
    (tmp_path / "robot.model.yaml").symlink_to(robot)
    # With a new home, matplotlib would build its font cache for each command.
    environment = {**environment, "HOME": os.environ["HOME"]}
    commands = _COMMAND.findall((checkout / page).read_text())
    assert commands
    for command in commands:
        run_command(["bash", "-c", command], environment, tmp_path)
        for picture in re.findall(r" -o (\S+)", command):
            assert (tmp_path / picture).stat().st_size > 0
