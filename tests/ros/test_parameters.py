"""The limit of the wall time in which a plugin must start."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from rosgraph_msgs.msg import Clock

STUCK = """
import threading
import flatland

class Stuck(flatland.ModelPlugin):
    def on_initialize(self, config):
        self.output("early", bool)
        threading.Event().wait()
"""
MODEL = """
bodies: [{name: base, footprints: []}]
plugins: [{name: plug, type: "test::Stuck"}]
"""


def test_model_with_a_plugin_that_never_starts_fails_to_spawn(
    launcher: Any, ros: Any, write_world: Callable[..., Path]
) -> None:
    world = write_world(stuck=MODEL)
    launcher.add_plugins(world.parent, STUCK, "stuck_plugin")
    process = launcher.server(world, plugin_timeout=0.25)
    before = ros.registered()
    answer = ros.spawn("stuck.model.yaml", "stuck")
    assert answer.success is False
    assert answer.message.startswith(
        'Flatland plugin: Model Plugin "plug" type "test::Stuck" model "stuck": '
        "on_initialize did not return within 0.25 s"
    )
    assert ros.registered() == before
    # The simulation and its services continue.
    clock = ros.topic("/clock", Clock)
    now = clock.next().clock
    clock.until(lambda message: message.clock > now)
    assert ros.spawn("ball.model.yaml", "stuck").success
    assert process.running
