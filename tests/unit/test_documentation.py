"""Checks the first page of the documentation, and that pages and reference are complete."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from pages import code_blocks

import flatland
from flatland.plugin_api.manifest import INCLUDED_PACKAGE
from flatland.plugin_api.registry import PluginRegistry


@pytest.fixture(scope="module")
def docs(checkout: Path) -> Path:
    """The folder of the documentation."""
    return checkout / "docs"


def listed_files(entry: Any) -> Iterator[str]:
    """Yields all pages of the table of contents."""
    if isinstance(entry, dict):
        for key, value in entry.items():
            if key in ("file", "root"):
                yield value
            else:
                yield from listed_files(value)
    elif isinstance(entry, list):
        for item in entry:
            yield from listed_files(item)


def test_the_site_contains_all_pages(docs, checkout):
    listed = list(listed_files(yaml.safe_load((docs / "toc.yml").read_text())))
    assert len(listed) == len(set(listed))
    pages = [*docs.rglob("*.md"), *docs.rglob("*.rst"), *(checkout / "examples").rglob("*.md")]
    names = ("README.md", "CONTRIBUTING.md", "RELEASING.md", "CHANGELOG.rst")
    pages += [checkout / name for name in names]
    assert sorted(listed) == sorted(str(p.relative_to(checkout).with_suffix("")) for p in pages)


def test_the_first_page_links_all_pages(docs):
    first = (docs / "README.md").read_text()
    table = first.split("## All pages", 1)[1]
    for page in docs.glob("*.md"):
        assert page.name == "README.md" or f"({page.name})" in table, page


def test_the_table_of_plugins_is_complete(docs, checkout):
    table = (docs / "plugins.md").read_text().split("\n## ", 1)[0]
    rows = "".join(line.split("|")[1] for line in table.splitlines() if line.startswith("|"))
    for full in PluginRegistry().classes:
        package, name = full.split("::")
        assert package != INCLUDED_PACKAGE or re.search(rf"\b{name}\b", rows), name
    for name in re.findall(r"\(../(worlds/\S+)\)", table):
        assert (checkout / name).exists()


def test_the_reference_contains_all_public_names(docs):
    reference = "".join(page.read_text() for page in (docs / "api").glob("*.rst"))
    documented = re.findall(r"\.\. (?:auto)?\w+:: (?:flatland\.)?(\w+)", reference)
    assert set(flatland.__all__) <= set(documented)


def test_the_robot_of_the_first_page_drives_and_scans(docs, tmp_path):
    [robot] = code_blocks((docs / "README.md").read_text(), "yaml")
    (tmp_path / "robot.yaml").write_text(robot)
    (tmp_path / "world.yaml").write_text(
        "properties: {}\nlayers: []\nmodels: [{name: r, model: robot.yaml}]\n"
    )
    with flatland.World.from_yaml(tmp_path / "world.yaml", seed=1) as world:
        scan = world.output("/scan")
        world.command("/cmd_vel").set(flatland.Twist(linear_x=1.0))
        world.step(200)
        assert world.model("r").pose[0] == pytest.approx(1.0)
        assert len(scan.latest.ranges) == 315


@pytest.mark.parametrize("page", ["README.md", "docs/README.md"])
def test_the_program_of_a_page_runs(page, checkout, monkeypatch, capsys):
    monkeypatch.chdir(checkout)
    [program] = code_blocks((checkout / page).read_text(), "python")
    exec(compile(program, page, "exec"), {})
    assert re.search(r"\(.*\) \d", capsys.readouterr().out)


@pytest.mark.parametrize("page", ["drawing.md", "python.md"])
def test_the_programs_of_a_page_run_one_after_the_other(
    page, docs, checkout, monkeypatch, tmp_path
):
    (tmp_path / "worlds").symlink_to(checkout / "worlds")
    monkeypatch.chdir(tmp_path)
    first, *others = code_blocks((docs / page).read_text(), "python")
    exec(compile(first, page, "exec"), {})
    # The first program closes its world; the others continue with an open one.
    with flatland.World.from_yaml("worlds/office/world.yaml", seed=1) as world:
        names = {"flatland": flatland, "world": world, "path": np.zeros((2, 2))}
        for program in others:
            exec(compile(program, page, "exec"), names)
    assert others


def without_comments(text: str) -> str:
    """Returns YAML without comments, which differ between a page and a file."""
    lines = [re.sub(r"(^| ) *#.*", "", line) for line in text.splitlines()]
    return "\n".join(line for line in lines if line)


@pytest.mark.parametrize("page", ["models.md", "drives.md", "moving_models.md"])
def test_blocks_that_name_a_file_are_part_of_it(page, docs, checkout):
    texts = code_blocks((docs / page).read_text(), "yaml")
    found = [text.split("\n", 1) for text in texts if text.startswith("# worlds/")]
    assert found
    for first, text in found:
        path = checkout / first.removeprefix("# ")
        assert without_comments(text) in without_comments(path.read_text())
