"""The documentation site, built as by `make docs`."""

from __future__ import annotations

import subprocess

import pytest
from waiting import BUILD_TIMEOUT


@pytest.mark.timeout(BUILD_TIMEOUT)
def test_the_site_is_built_without_warnings(checkout, tmp_path):
    if not (checkout / "build" / "docs" / "venv" / "flatland-requirements").exists():
        pytest.skip("Sphinx is not installed: run `make docs`")
    site = tmp_path / "site"
    done = subprocess.run(
        [checkout / "tools" / "build_docs.sh", site],
        capture_output=True,
        text=True,
        timeout=BUILD_TIMEOUT,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "url=docs/README.html" in (site / "index.html").read_text()
    reference = (site / "docs" / "api" / "world.html").read_text()
    assert 'id="flatland.World.from_yaml"' in reference
