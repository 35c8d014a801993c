"""benchmark.launch: runs for a simulated time, reports its speed, and ends."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rosgraph_msgs.msg import Clock
from waiting import TIMEOUT


def test_benchmark_reports_and_ends(launcher: Any, write_world: Callable[..., Path]) -> None:
    world = write_world("[{name: robot, model: robot.model.yaml}]")
    process = launcher.launch(
        "flatland", "benchmark.launch", f"world_path:={world}", "benchmark_duration:=2.5"
    )
    match = process.wait_for_line(
        r"benchmark: (\d+) iterations in ([\d.]+) s of wall time, ([\d.]+) iterations a second"
    )
    iterations, seconds, rate = (float(text) for text in match.groups())
    assert iterations == 500
    assert iterations / rate == pytest.approx(seconds, abs=0.001)  # The seconds are rounded to ms.
    process.wait()
    assert "FATAL" not in process.output


def test_interrupted_benchmark_reports_nothing(
    launcher: Any, ros: Any, write_world: Callable[..., Path]
) -> None:
    world = write_world("[{name: robot, model: robot.model.yaml}]")
    process = launcher.start(
        world_path=world, update_rate=0, benchmark_duration=1e9, shutdown_timeout=TIMEOUT
    )
    process.wait_for_line("loaded")
    clock = ros.topic("/clock", Clock)
    clock.until(lambda message: message.clock.to_nsec() > 0)
    assert process.stop() == 0
    assert "benchmark:" not in process.output
