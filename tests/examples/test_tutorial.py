"""Follows docs/write_a_plugin.md: writes its files, runs its commands and compares their output."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from pages import Block, Shell, follow, joined, read_page
from waiting import BUILD_TIMEOUT

_NOT_IN_THE_PAGE = {"README.md"}


@pytest.fixture(scope="module")
def blocks(checkout: Path) -> list[Block]:
    return read_page(checkout / "docs" / "write_a_plugin.md")


def test_the_page_contains_the_example_package(blocks, example):
    files: dict[str, str] = {}
    for block in blocks:
        if block.kind == "file":
            files[block.path] = block.text
        elif block.kind == "part":
            files[block.path] = joined(files[block.path], block.text)
    shipped = {
        str(path.relative_to(example)): path.read_text()
        for path in example.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert sorted(files) == sorted(set(shipped) - _NOT_IN_THE_PAGE)
    for path, text in files.items():
        assert text == shipped[path], f"{path} differs from the page"


@pytest.mark.ros
@pytest.mark.build
@pytest.mark.timeout(BUILD_TIMEOUT)
def test_the_commands_of_the_page_print_the_documented_output(
    blocks, ros_environment, tmp_path, start
):
    for program in ("catkin_make", "rospack"):
        if shutil.which(program, path=ros_environment["PATH"]) is None:
            pytest.skip(f"{program} is not installed")
    follow(blocks, Shell(ros_environment, tmp_path), start)
