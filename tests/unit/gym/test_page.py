"""The programs of docs/learning.md."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from pages import code_blocks

PAGE = Path(__file__).resolve().parents[3] / "docs" / "learning.md"
# The program for RLlib requires a cluster; tests/learning/test_rllib.py tests its environment. The
# others make fewer environments, buildings, steps and episodes than on the page.
PROGRAMS = [
    re.sub(r"\b(8|16|32|50|64|100)\b", "3", program)
    for program in code_blocks(PAGE.read_text(), "python")
    if "import ray" not in program
]


@pytest.mark.parametrize("number", range(len(PROGRAMS)))
def test_a_program_of_the_page_runs(
    checkout: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    monkeypatch.chdir(checkout)
    exec(compile(PROGRAMS[number], f"learning.md, program {number}", "exec"), {})  # its last use


def test_the_page_names_all_parts() -> None:
    import flatland.gym

    text = PAGE.read_text()
    parts = (
        flatland.gym.ObservationPart,
        flatland.gym.Action,
        flatland.gym.Randomization,
        flatland.gym.Reward,
        flatland.gym.Ending,
        flatland.gym.Task,
    )
    for name in flatland.gym.__all__:
        each = getattr(flatland.gym, name)
        if isinstance(each, type) and issubclass(each, parts) and each not in parts:
            assert (
                name in ("AnyOf", "RandomizationSum") or f"`{name}(" in text or f"{name}`" in text
            ), name


def test_the_pages_agree_about_the_time_of_training(checkout: Path) -> None:
    time = "in about two minutes of processor time"
    assert all(
        time in " ".join(page.read_text().split()) for page in (PAGE, checkout / "README.md")
    )
    rows = re.findall(r"\| [1-5] .*\| ([0-9.]+) min \|", PAGE.read_text())
    assert {round(float(minutes)) for minutes in rows} == {2}
