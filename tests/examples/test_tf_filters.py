"""Scans and transforms of the office pass the message filter of tf2 without a dropped message.

The filter is that of tf2 itself, in a C++ program: amcl, SLAM nodes and costmaps use it.
"""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from compiler import compile_program
from programs import output_of

DURATION = 2.0  # simulated time [s]
# Update rates [Hz].
SPEEDS = {"five times real time": 1000, "as fast as possible": 0}
# Topic, chain of frames from the fixed frame to the sensor, period of the scans [s].
LASERS = [
    ("/scan", ["map", "odom", "base_link", "laser"], 0.04),
    ("/tricycle/scan", ["map", "tricycle_base_link", "tricycle_laser"], 0.1),
]
PACKAGES = ["roscpp", "message_filters", "sensor_msgs", "tf2_ros"]
FRAME_TIMEOUT = 500.0  # s; on a busy machine
RESULT = re.compile(r"received (\d+) passed (\d+) dropped (\d+) largest gap ([\d.]+)")


def build(folder: Path) -> Path:
    """Compiles the program that counts scans."""
    source = Path(__file__).parent / "tf_filter" / "tf_filter.cpp"
    flags, libraries = (
        shlex.split(output_of(["pkg-config", option, *PACKAGES], os.environ, folder))
        for option in ("--cflags", "--libs")
    )
    return compile_program(folder / "tf_filter", [source], ["-std=c++17", "-w", *flags], libraries)


@pytest.mark.ros
@pytest.mark.build
def test_no_scan_is_dropped_at_any_speed(
    ros_environment: dict[str, str], start: Callable[..., Any], tmp_path: Path
) -> None:
    program = build(tmp_path)
    server = start(["roslaunch", "flatland", "server.launch", "show_viz:=false"], ros_environment)
    server.wait_for_line('loaded ".*world.yaml"')
    for speed, rate in SPEEDS.items():
        set_rate = ["rosservice", "call", "--wait", "/set_rate", str(rate)]
        assert "success: True" in output_of(set_rate, ros_environment, tmp_path)
        counters = [
            start([program, str(DURATION), topic, *frames], ros_environment)
            for topic, frames, _ in LASERS
        ]
        for (topic, _, period), counter in zip(LASERS, counters, strict=True):
            counter.wait_for_line(RESULT.pattern, FRAME_TIMEOUT)
            check(f"{topic}, {speed}", counter.output, rate, period)
    server.stop()


def check(name: str, output: str, rate: float, period: float) -> None:
    """Checks what a counter has printed."""
    received, passed, dropped, gap = map(float, RESULT.search(output).groups())
    assert dropped == 0, f"{name}: {output}"
    assert passed == received, f"{name}: {output}"
    if rate:
        # As fast as possible, the node drops scans that a slow subscriber does not take.
        # The program stops when it next reads the time.
        assert DURATION / period <= received <= 1.05 * DURATION / period + 2, name
        assert gap == pytest.approx(period, abs=1e-6), name
    else:
        assert received > DURATION / period / 10, name
