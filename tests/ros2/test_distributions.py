"""A simulator of one distribution and a client of the other one."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

OTHER = {"kilted": "jazzy", "jazzy": "kilted"}
CLIENT = """
import rclpy
from flatland_msgs.srv import GetModelStates
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import LaserScan

rclpy.init()
node = rclpy.create_node("client")
node.create_subscription(
    LaserScan, "/scan", lambda scan: print("beams:", len(scan.ranges)), qos_profile_sensor_data
)
client = node.create_client(GetModelStates, "/get_model_states")
client.wait_for_service()
future = client.call_async(GetModelStates.Request())
rclpy.spin_until_future_complete(node, future)
print("models:", *future.result().states.name)
rclpy.spin(node)
"""


def test_client_of_the_other_distribution(
    ros: Any, launcher: Any, write_world: Callable[..., Path]
) -> None:
    environments = Path(sys.prefix).parent
    python = environments / OTHER[Path(sys.prefix).name] / "bin" / "python"
    if not python.exists():
        pytest.skip(f"{python} does not exist")
    launcher.server(ros, write_world("[{name: robot, model: robot.model.yaml}]"))
    # Variables that the interpreter of an environment sets for itself.
    hidden = ("LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE", "VIRTUAL_ENV")
    environment = {name: value for name, value in os.environ.items() if name not in hidden}
    client = launcher.program(
        python, "-c", CLIENT, environment=environment | {"PYTHONUNBUFFERED": "1"}
    )
    client.wait_for_line("^models: robot$")
    client.wait_for_line("^beams: 7$")
    client.kill()
