"""Types the service calls of the documentation, page by page, into a shell beside the office."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import Any

import pytest
from waiting import TIMEOUT

_CALL = re.compile(r"^rosservice call .*$", re.MULTILINE)
PAGES = ["README.md", "docs/models.md", "docs/ros.md", "docs/viewer.md"]


@pytest.mark.parametrize("page", PAGES)
def test_calls_do_what_the_page_says(
    launcher: Any, ros: Any, checkout: Path, ros_environment: dict[str, str], page: str
) -> None:
    del ros
    launcher.server(checkout / "worlds" / "office" / "world.yaml")
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


def test_no_page_is_forgotten(checkout: Path) -> None:
    pages = [checkout / "README.md", *sorted((checkout / "docs").glob("*.md"))]
    having = [str(page.relative_to(checkout)) for page in pages if _CALL.search(page.read_text())]
    # write_a_plugin.md is typed as a whole, by tests/examples.
    assert set(having) - {"docs/write_a_plugin.md"} == set(PAGES)
