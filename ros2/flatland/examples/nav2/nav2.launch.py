"""Navigation of the robot of the office with Nav2: ros2 launch flatland nav2.launch.py.

The simulator publishes the map and takes the place of a robot; amcl localizes it. A goal is set
with RViz (2D Goal Pose), with the viewer in the browser, or on the action navigate_to_pose.
"""

from __future__ import annotations

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

SHARE = Path(get_package_share_directory("flatland"))
PARAMETERS = SHARE / "examples" / "nav2" / "nav2.yaml"
# Package and program of each node; all of them are managed by the lifecycle manager.
NODES = {
    "amcl": "nav2_amcl",
    "controller_server": "nav2_controller",
    "planner_server": "nav2_planner",
    "behavior_server": "nav2_behaviors",
    "bt_navigator": "nav2_bt_navigator",
}


def generate_launch_description() -> LaunchDescription:
    """Starts the simulator, Nav2 and, with rviz:=true, RViz."""
    arguments = [
        DeclareLaunchArgument("web", default_value="true", description="start the browser viewer"),
        DeclareLaunchArgument("rviz", default_value="false", description="start RViz 2"),
        DeclareLaunchArgument(
            "params_file", default_value=str(PARAMETERS), description="parameters of Nav2"
        ),
    ]
    simulator = Node(
        package="flatland",
        executable="flatland_server",
        name="flatland_server",
        output="screen",
        parameters=[
            {
                "world_path": str(SHARE / "worlds" / "office" / "world.yaml"),
                "map_to_odom": False,  # sent by amcl; the odometry then drifts
                "enable_stamped_cmd_vel": True,  # as Nav2 sends them
                "show_viz": True,
                "web": LaunchConfiguration("web"),
            }
        ],
        on_exit=Shutdown(),
    )
    parameters = [LaunchConfiguration("params_file"), {"use_sim_time": True}]
    nodes = [
        Node(
            package=package,
            executable=name,
            name=name,
            output="screen",
            parameters=parameters,
            remappings=[("odom", "odometry/filtered")],
        )
        for name, package in NODES.items()
    ]
    manager = Node(
        package="nav2_lifecycle_manager",
        executable="lifecycle_manager",
        name="lifecycle_manager_navigation",
        output="screen",
        parameters=[{"use_sim_time": True, "autostart": True, "node_names": list(NODES)}],
    )
    rviz = IncludeLaunchDescription(
        str(SHARE / "launch" / "rviz.launch.py"),
        launch_arguments={"rviz": LaunchConfiguration("rviz")}.items(),
    )
    return LaunchDescription([*arguments, simulator, *nodes, manager, rviz])
