"""A short run of `make soak` with a node."""

from __future__ import annotations

import sys
from pathlib import Path

from programs import run_program
from waiting import TIMEOUT


def test_nothing_grows_in_a_short_run_of_service_calls(
    checkout: Path, ros_environment: dict[str, str]
) -> None:
    command = [sys.executable, checkout / "bench" / "soak.py", "services", "--scale", "0.001"]
    # The program prints nothing until its end.
    done = run_program(command, env=ros_environment, check=True, silence=4 * TIMEOUT)
    assert "nothing grows" in done.stdout
