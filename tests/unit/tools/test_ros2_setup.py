"""The set-up of ROS 2 with wheels: for which interpreters there are any, and wrong arguments."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).resolve().parents[3]


@pytest.mark.parametrize(
    ("platform", "expected"),
    [
        ("3.11 x86_64", ""),
        ("3.13 x86_64", "no wheels of ROS 2 for Python 3.13 x86_64"),
        ("3.11 aarch64", "no wheels of ROS 2 for Python 3.11 aarch64"),
    ],
)
def test_interpreters_with_wheels(tmp_path: Path, platform: str, expected: str) -> None:
    python = tmp_path / "python"
    python.write_text(f"#!/bin/sh\necho '{platform}'\n")
    python.chmod(0o755)
    command = f". tools/common.bash; no_ros2_wheels {python}"
    run = subprocess.run(
        ["bash", "-ec", command], cwd=CHECKOUT, capture_output=True, text=True, check=True
    )
    assert expected in run.stdout
    assert bool(run.stdout) == bool(expected)


def test_an_unknown_distribution_is_refused() -> None:
    run = subprocess.run(
        ["tools/ros2_setup.sh", "humble"], cwd=CHECKOUT, capture_output=True, text=True, check=False
    )
    assert run.returncode == 1
    assert "must be kilted or jazzy, got 'humble'" in run.stderr


@pytest.mark.parametrize("distribution", ["kilted", "jazzy"])
def test_all_wheels_have_exact_versions(distribution: str) -> None:
    lines = (CHECKOUT / "tools" / "ros2" / f"{distribution}.txt").read_text().splitlines()
    lines += (CHECKOUT / "tools" / "ros2" / "common.txt").read_text().splitlines()
    packages = [line for line in lines if not line.startswith(("#", "-r"))]
    assert f"ros-{distribution}-rclpy" in {line.partition("==")[0] for line in packages}
    assert all("==" in line for line in packages)
