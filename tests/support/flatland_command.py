"""Runs the command `flatland`, in this process or in a new one."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

from waiting import TIMEOUT

from flatland import cli


def run(*arguments: str | Path, **options: Any) -> subprocess.CompletedProcess[str]:
    """Runs the command in a new process."""
    command = [sys.executable, "-W", "error", "-m", "flatland", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT, **options)


def main(*arguments: str | Path) -> int:
    """Runs the command in this process and returns its exit code."""
    return cli.main([str(argument) for argument in arguments])
