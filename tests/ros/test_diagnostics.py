"""/diagnostics: rate, costs of plugins, subscribers that do not keep up.

There is one message a second, so that most states are tested without ROS, in `tests/unit/node`.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from raw_subscriber import RawSubscriber
from sensor_msgs.msg import LaserScan

from flatland.srv import StepWorld

PLUGINS = """
import time
import flatland

class Slow(flatland.ModelPlugin):
    def before_physics_step(self, timekeeper):
        time.sleep(0.2)

class Broken(flatland.ModelPlugin):
    def before_physics_step(self, timekeeper):
        raise ValueError("expected")
"""
# Each scan has 40 kB, so that the buffers of a connection are soon full.
BEAMS = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: Laser, name: laser, body: base, range: 20,
     angle: {min: -2, max: 2, increment: 0.0004}}
"""
BODY = "bodies: [{name: base, footprints: []}]\n"
OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR


class Diagnosed:
    """The statuses of the node by name."""

    def __init__(self, ros: Any) -> None:
        self._topic = ros.topic("/diagnostics", DiagnosticArray)

    def until(self, name: str, accept: Callable[[Any, dict[str, str]], bool]) -> dict[str, str]:
        """Waits for a status that is accepted; returns its values."""
        found: dict[str, str] = {}

        def accepted(message: DiagnosticArray) -> bool:
            (status,) = (s for s in message.status if s.name == f"flatland_server: {name}")
            found.clear()
            found.update({each.key: each.value for each in status.values})
            return accept(status, found)

        self._topic.until(accepted)
        return found


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, write_world: Callable[..., Path]) -> Any:
    world = write_world(
        "[{name: robot, model: beams.model.yaml}]",
        beams=BEAMS,
        slow=BODY + "plugins: [{type: 'test::Slow', name: plug}]\n",
        broken=BODY + "plugins: [{type: 'test::Broken', name: plug}]\n",
    )
    module_launcher.add_plugins(world.parent, PLUGINS, "diagnosed")
    return module_launcher.server(world, update_rate=20, max_lag=0.5)


def test_causes_of_warnings(ros: Any) -> None:
    diagnosed = Diagnosed(ros)
    stuck = RawSubscriber(ros.master, "/scan", LaserScan, receive_buffer=4096)
    answer = ros.call("/step_world", StepWorld, 1.0)
    assert answer.message.endswith(" messages of /scan to /raw were dropped")
    for name in ("slow", "broken"):
        assert ros.spawn(f"{name}.model.yaml", name).success

    diagnosed.until(
        "simulation",
        lambda status, _: (
            status.level == WARN
            and status.message.startswith("the update rate of 20 Hz cannot be held: ")
        ),
    )
    name = 'Model Plugin "plug" type "test::Slow" model "slow" [%]'
    values = diagnosed.until(
        "plugins", lambda status, v: status.level == ERROR and float(v.get(name, 0)) > 20
    )
    assert values["disabled"] == 'Model Plugin "plug" type "test::Broken" model "broken"'
    values = diagnosed.until(
        "subscribers",
        lambda status, _: (
            status.level == WARN and status.message == "subscribers do not keep up: /scan to /raw"
        ),
    )
    assert values["/scan to /raw"].endswith(" messages dropped")

    for name in ("slow", "broken"):
        assert ros.delete(name).success
    stuck.close()
    values = diagnosed.until("simulation", lambda status, _: status.level == OK)
    assert (values["update rate [Hz]"], values["models"]) == ("20", "1")
    diagnosed.until("plugins", lambda status, _: status.level == OK)
    diagnosed.until("subscribers", lambda status, v: status.level == OK and not v)
