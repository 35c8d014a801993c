"""Starts the simulator with the launch file of the package flatland, and reliable sensors."""

from __future__ import annotations

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import IncludeLaunchDescription

LAUNCH = Path(get_package_share_directory("flatland")) / "launch" / "server.launch.py"


def generate_launch_description() -> LaunchDescription:
    """Includes the launch file, which also receives all arguments of this one."""
    sensors = {"reliable_sensors": "true"}
    return LaunchDescription(
        [IncludeLaunchDescription(str(LAUNCH), launch_arguments=sensors.items())]
    )
