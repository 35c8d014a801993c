"""Runs the service calls of each page of the documentation."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import Any

import pytest
from waiting import TIMEOUT

_CALL = re.compile(r"^rosservice call .*$", re.MULTILINE)
# The pages and their worlds.
PAGES = {
    "README.md": "office",
    "docs/models.md": "office",
    "docs/moving_models.md": "trailers",
    "docs/navigation.md": "office",
    "docs/ros.md": "office",
    "docs/viewer.md": "office",
}


@pytest.mark.parametrize("page", PAGES)
def test_the_calls_of_a_page_succeed(
    launcher: Any, ros: Any, checkout: Path, ros_environment: dict[str, str], page: str
) -> None:
    del ros
    launcher.server(checkout / "worlds" / PAGES[page] / "world.yaml")
    calls = _CALL.findall((checkout / page).read_text())
    assert calls
    for call in calls:
        done = subprocess.run(
            ["bash", "-c", call],
            env=ros_environment,
            capture_output=True,
            text=True,
            timeout=TIMEOUT,
            check=False,
        )
        assert done.returncode == 0, f"{call}\n{done.stderr}"
        assert "success: False" not in done.stdout, f"{call}\n{done.stdout}"


def test_all_pages_with_calls_are_tested(checkout: Path) -> None:
    pages = [checkout / "README.md", *sorted((checkout / "docs").glob("*.md"))]
    with_calls = [
        str(page.relative_to(checkout)) for page in pages if _CALL.search(page.read_text())
    ]
    # tests/examples run all commands of these pages.
    run_by_examples = {"docs/lockstep.md", "docs/several_robots.md", "docs/write_a_plugin.md"}
    assert set(with_calls) - run_by_examples == set(PAGES)
