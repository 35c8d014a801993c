"""Runs the command `flatland`, in this process or in a new one."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

from programs import run_program

from flatland import cli


def run(*arguments: str | Path, **options: Any) -> subprocess.CompletedProcess[str]:
    """Runs the command in a new process."""
    command = [sys.executable, "-W", "error", "-m", "flatland", *map(str, arguments)]
    return run_program(command, **options)


def main(*arguments: str | Path) -> int:
    """Runs the command in this process and returns its exit code."""
    return cli.main([str(argument) for argument in arguments])
