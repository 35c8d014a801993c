"""Paths of files that commands write: checked before the work, and named as the user named them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from flatland_command import main

OUTPUTS = [
    ("run", "--video", "v.mp4"),
    ("run", "--record", "r.flog"),
    ("run", "--bag", "b.bag"),
    ("run", "--mcap", "m.mcap"),
    ("show", "-o", "p.png"),
    ("show", "-o", "p.pdf"),
    ("test", "--junit", "j.xml"),
]


@pytest.mark.parametrize(("command", "option", "name"), OUTPUTS)
def test_a_missing_folder_is_an_error_before_the_work(
    robot_world: str,
    capsys: Any,
    command: str,
    option: str,
    name: str,
) -> None:
    before = sorted(Path().rglob("*"))
    # The other arguments would be errors, too, or would take hours.
    rest = ["--duration", "1e6"] if command == "run" else []
    file = "nothing.yaml" if command == "test" else robot_world
    for path, reason in ((f"nodir/{name}", "there is no folder nodir"), (f"{name}/", "")):
        if not reason:
            Path(name).mkdir()
            path, reason = name, "it is a folder"
        assert main(command, file, *rest, option, path) == 1
        assert capsys.readouterr().err == f"flatland: cannot write {path}: {reason}\n"
    Path(name).rmdir()
    assert sorted(Path().rglob("*")) == before
