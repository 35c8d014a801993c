"""Starts RViz 2 with the displays of flatland: ros2 launch flatland rviz.launch.py."""

from __future__ import annotations

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

CONFIGURATION = Path(get_package_share_directory("flatland")) / "rviz" / "flatland.rviz"


def generate_launch_description() -> LaunchDescription:
    """Starts RViz unless rviz:=false, which launch files that include this one may pass."""
    arguments = [
        DeclareLaunchArgument("rviz", default_value="true", description="start RViz 2"),
        DeclareLaunchArgument(
            "rviz_config", default_value=str(CONFIGURATION), description="its configuration"
        ),
    ]
    rviz = Node(
        package="rviz2",
        executable="rviz2",
        arguments=["-d", LaunchConfiguration("rviz_config")],
        parameters=[{"use_sim_time": True}],
        condition=IfCondition(LaunchConfiguration("rviz")),
    )
    return LaunchDescription([*arguments, rviz])
