"""Starts the simulator: ros2 launch flatland server.launch.py world_path:=WORLD [web:=true].

Each parameter of the node is an argument. Those that are not given have the defaults of the node.
"""

from __future__ import annotations

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchContext, LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    IncludeLaunchDescription,
    OpaqueFunction,
    Shutdown,
)
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from flatland.ros2.parameters import fields

SHARE = Path(get_package_share_directory("flatland"))
DEFAULTS = {"world_path": str(SHARE / "worlds" / "office" / "world.yaml"), "show_viz": "true"}


def start_server(context: LaunchContext) -> list[Node]:
    """Returns the simulator with the parameters that have a value."""
    values = {each.name: context.launch_configurations[each.name] for each in fields()}
    return [
        Node(
            package="flatland",
            executable="flatland_server",
            name="flatland_server",
            output="screen",
            parameters=[{name: value for name, value in values.items() if value}],
            # Without the simulator, the other nodes have no purpose.
            on_exit=Shutdown(),
        )
    ]


def generate_launch_description() -> LaunchDescription:
    """Declares the arguments, and starts the simulator and, with rviz:=true, RViz."""
    arguments = [
        DeclareLaunchArgument(
            each.name,
            default_value=DEFAULTS.get(each.name, ""),
            description=each.metadata["meaning"],
        )
        for each in fields()
    ]
    rviz = IncludeLaunchDescription(
        str(SHARE / "launch" / "rviz.launch.py"),
        launch_arguments={"rviz": LaunchConfiguration("rviz")}.items(),
    )
    return LaunchDescription(
        [
            *arguments,
            DeclareLaunchArgument("rviz", default_value="false", description="start RViz 2"),
            OpaqueFunction(function=start_server),
            rviz,
        ]
    )
