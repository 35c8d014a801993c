"""Resolution of names: model namespaces, global names, node groups and remappings."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from nav_msgs.msg import Odometry

from flatland.srv import SpawnModel

GROUP = """
<launch>
  <param name="/use_sim_time" value="true"/>
  <param name="/robots/start_x" value="2.5"/>
  <group ns="robots">
    <node name="sim" pkg="flatland" type="flatland_server" required="true">
      <param name="world_path" value="{world}"/>
      <remap from="scan" to="laser"/>
    </node>
  </group>
</launch>
"""
GLOBAL = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: DiffDrive, name: drive, body: base, odom_pub: /odom, twist_sub: nested//cmd_vel/}
"""


def test_node_in_a_group(
    ros: Any, launcher: Any, write_world: Callable[..., Path], tmp_path: Path
) -> None:
    world = write_world(
        """
  - {name: robot, model: robot.model.yaml, pose: ['$eval param("start_x")', 0, 0]}
  - {name: spaced, model: robot.model.yaml, namespace: r1//}
  - {name: rooted, model: global.model.yaml, namespace: /r2}
""",
        **{"global": GLOBAL},
    )
    file = tmp_path / "group.launch"
    file.write_text(GROUP.format(world=world))
    launcher.launch(str(file))
    answer = ros.call("/robots/spawn_model", SpawnModel, "missing.yaml", "m", "", None)
    assert answer.success is False

    registered = ros.registered("/robots/sim")
    assert registered["services"] >= {
        f"/robots/{name}"
        for name in ("spawn_model", "delete_model", "move_model", "set_rate", "toggle_pause")
    }
    assert registered["publishers"] == {
        "/clock",
        "/tf",
        "/rosout",
        "/robots/model_states",
        "/robots/laser",  # remapped
        "/robots/odometry/filtered",
        "/robots/odometry/ground_truth",
        "/robots/twist",
        "/robots/r1/scan",
        "/robots/r1/odometry/filtered",
        "/robots/r1/odometry/ground_truth",
        "/robots/r1/twist",
        "/odom",
        "/r2/odometry/ground_truth",
        "/r2/twist",
    }
    assert registered["subscribers"] == {
        "/robots/cmd_vel",
        "/robots/r1/cmd_vel",
        "/r2/nested/cmd_vel",
    }
    # `param()` resolves relative names in the namespace of the node.
    truth = ros.topic("/robots/odometry/ground_truth", Odometry).next()
    assert truth.pose.pose.position.x == pytest.approx(2.5, abs=1e-4)
