"""A short run of `make soak` with a node."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from waiting import TIMEOUT


def test_nothing_grows_in_a_short_run_of_service_calls(
    checkout: Path, ros_environment: dict[str, str]
) -> None:
    done = subprocess.run(
        [sys.executable, str(checkout / "bench" / "soak.py"), "services", "--scale", "0.005"],
        env=ros_environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    assert "nothing grows" in done.stdout
