"""Runs a world at full speed and logs the speed: ros2 launch flatland benchmark.launch.py."""

from __future__ import annotations

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

WORLD = Path(get_package_share_directory("flatland")) / "worlds" / "office" / "world.yaml"
ARGUMENTS = {
    "world_path": (str(WORLD), "the world file"),
    "benchmark_duration": ("60.0", "simulated time to run for [s]"),
    "step_size": ("0.005", "simulated time of a step [s]"),
    "seed": ("0", "makes all noise repeatable"),
}


def generate_launch_description() -> LaunchDescription:
    """Starts the node, which ends by itself."""
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=meaning)
        for name, (default, meaning) in ARGUMENTS.items()
    ]
    node = Node(
        package="flatland",
        executable="flatland_server",
        name="flatland_benchmark",
        output="screen",
        parameters=[
            {name: LaunchConfiguration(name) for name in ARGUMENTS},
            {"update_rate": 0.0},
        ],
        on_exit=Shutdown(),
    )
    return LaunchDescription([*arguments, node])
