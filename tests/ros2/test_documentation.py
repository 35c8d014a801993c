"""The commands of docs/ros2.md that start the simulator and drive a robot."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import pytest
from rclpy.qos import ReliabilityPolicy

from flatland.ros2 import qos
from flatland.ros2.message_types import message_class


@pytest.mark.kilted
def test_from_nothing_to_a_driving_robot(ros: Any, launcher: Any, checkout: Path) -> None:
    text = (checkout / "docs" / "ros2.md").read_text()
    [commands] = re.findall(r"```bash\nmake ros2\n(.*?)```", text, re.DOTALL)
    activate, start, drive, stop = commands.splitlines()
    assert activate == ". build/ros2/kilted/bin/activate"
    assert stop == "kill %1"
    programs = Path(sys.prefix) / "bin"
    simulator = launcher.program(
        *f"{programs}/{start}".removesuffix(" &").split(), "-p", "web_port:=0", cwd=checkout
    )
    simulator.wait_for_line("viewer in the browser: http")
    driver = launcher.program(*f"{programs}/{drive}".split(), "2", cwd=checkout)
    assert driver.wait() == 0
    positions = [float(x) for x in re.findall(r"at \((-?[\d.]+), ", driver.stdout)]
    assert positions[-1] > positions[0] + 0.1
    assert simulator.stop() == 0


def test_quality_of_service_of_measurements(checkout: Path) -> None:
    text = (checkout / "docs" / "ros2.md").read_text()
    [row] = re.findall(r"^\| measurements: (.*?) \|", text, re.MULTILINE)
    for name in re.findall("`(.*?)`", row):
        package = "flatland" if name == "SemanticScan" else "sensor_msgs"
        profile = qos.of_publisher(
            message_class(f"{package}/{name}"), 1, latch=False, reliable_sensors=False
        )
        assert profile.reliability == ReliabilityPolicy.BEST_EFFORT
