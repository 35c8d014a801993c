"""Stop requests, and the end of a process that does not stop."""

from __future__ import annotations

import subprocess
import sys

import pytest
from waiting import TIMEOUT

PROGRAM = """
import logging
import os
import signal
import threading

from flatland.node.shutdown import ShutdownWatchdog

logging.basicConfig(format="%(message)s")
stopped = threading.Event()
watchdog = ShutdownWatchdog(stopped.set, lambda: print("unregistered", flush=True))
"""
STOPS = {
    "signal": "os.kill(os.getpid(), signal.SIGTERM)",
    "interrupt": "os.kill(os.getpid(), signal.SIGINT)",
    "request": "watchdog.request_stop()",
}


def run(*lines: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", PROGRAM + "\n".join(lines)],
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )


@pytest.mark.parametrize("stop", STOPS)
def test_a_process_that_does_not_stop_in_time_is_ended(stop: str) -> None:
    ended = run("watchdog.timeout = 0.05", STOPS[stop], "threading.Event().wait()")
    assert ended.returncode == 1
    assert ended.stdout == "unregistered\n"
    text = "not stopped within 0.05 s, exiting; still running: thread MainThread: "
    assert ended.stderr.startswith(text)
    assert ended.stderr.rstrip().endswith(" in wait")


def test_without_a_time_limit_the_process_ends_by_itself() -> None:
    ended = run(
        "watchdog.timeout = None",
        STOPS["signal"],
        "stopped.wait()",
        "print('stopped')",
    )
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "stopped\n", "")
