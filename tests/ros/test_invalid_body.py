"""A body that is not finite after a step: its model goes, and the simulation goes on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from geometry_msgs.msg import Twist, Vector3
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock

# A lever of 100 km that a plugin turns at 1e9 rad/s hits a body that lies on the upper wall of the
# room: the impulse overflows.
BODY = """
bodies:
  - name: base
    footprints: [{type: circle, radius: 30, density: 1.0e+8, restitution: 1.0e+9}]
"""
LEVER = """
bodies:
  - name: arm
    type: kinematic
    footprints:
      - {type: circle, radius: 30, center: [-1.0e+5, 94.9], density: 0, restitution: 1.0e+9}
plugins: [{type: "test::Spin", name: spin}]
"""
PLUGIN = """
import flatland

class Spin(flatland.ModelPlugin):
    def before_physics_step(self, timekeeper):
        self.model.bodies[0].set_velocity(0, 0, 1e9)
"""


def test_model_is_removed_and_the_rest_goes_on(
    ros: Any, launcher: Any, write_world: Callable[..., Path]
) -> None:
    world = write_world(
        """
        - {name: heavy, model: heavy.model.yaml, pose: [0, 34.99, 0]}
        - {name: lever, model: lever.model.yaml, pose: [1.0e+5, 0, 0]}
        - {name: robot, model: robot.model.yaml, namespace: r1, pose: [-500, 0, 0]}
        """,
        heavy=BODY,
        lever=LEVER,
    )
    launcher.add_plugins(world.parent, PLUGIN, "spin_plugin")
    process = launcher.server(world)
    process.wait_for_line(r'body "base" of model "heavy".* not finite: removed from the world')
    clock = ros.topic("/clock", Clock)
    assert len(clock.take(10)) == 10
    odometry = ros.topic("/r1/odometry/ground_truth", Odometry)
    ros.publisher("/r1/cmd_vel", Twist).publish(Twist(Vector3(1, 0, 0), Vector3()))
    odometry.until(lambda m: m.pose.pose.position.x > -499.9)
    assert ros.delete("heavy").success is False
    assert ros.delete("robot").success is True
