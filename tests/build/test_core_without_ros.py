"""The simulation core imports no ROS module, not even messages."""

from __future__ import annotations

import os
import sys

from programs import run_program

CHECK = """
import importlib, pkgutil, sys

WITH_ROS = {
    "flatland.ros", "flatland.ros2", "flatland.viewer", "flatland.msg", "flatland.srv",
    "flatland.scenarios.ros1", "flatland.scenarios.ros2",
}
# Raises an error that names the extra.
WITH_EXTRA = {"flatland.gym.stable_baselines"}
BLOCKED = {
    "rospy", "roslib", "rosgraph", "roslaunch", "rosservice", "rostopic", "genpy", "genmsg",
    "tf2_ros", "tf2_msgs", "std_msgs", "std_srvs", "geometry_msgs", "nav_msgs", "sensor_msgs",
    "rosgraph_msgs", "rclpy", "visualization_msgs", "interactive_markers", "rviz",
}

class Block:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in BLOCKED or any(f"{name}.".startswith(f"{p}.") for p in WITH_ROS):
            raise ModuleNotFoundError(f"{name} is blocked in this test")

sys.meta_path.insert(0, Block())
import flatland

def walk(package):
    for info in pkgutil.iter_modules(package.__path__, f"{package.__name__}."):
        if info.name not in WITH_ROS | WITH_EXTRA:
            module = importlib.import_module(info.name)
            if info.ispkg:
                walk(module)

walk(flatland)
assert "flatland.plugins.laser" in sys.modules
with flatland.World.from_yaml(sys.argv[1]) as world:
    world.step(10)
    print("steps:", round(world.time / 0.005))
"""


def test_core_imports_and_steps_with_ros_blocked(world_file):
    environment = {name: v for name, v in os.environ.items() if not name.startswith("ROS_")}
    command = [sys.executable, "-W", "error", "-c", CHECK, world_file]
    done = run_program(command, env=environment, cwd=world_file.parent, check=True)
    assert done.stdout == "steps: 10\n"
