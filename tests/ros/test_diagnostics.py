"""/diagnostics: rate, costs of plugins, subscribers that do not keep up."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from raw_subscriber import RawSubscriber
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty
from waiting import TIMEOUT

import flatland
from flatland.ros.diagnostics import Diagnostics
from flatland.ros.transport.registrar import Registrar
from flatland.simulation import Simulation
from flatland.srv import SetRate

PLUGINS = """
import time
import flatland

class Slow(flatland.ModelPlugin):
    def before_physics_step(self, timekeeper):
        time.sleep(0.03)

class Broken(flatland.ModelPlugin):
    def before_physics_step(self, timekeeper):
        raise ValueError("expected")
"""
MANIFEST = """
<library path=".">
  <class name="Slow" type="diagnosed.Slow" base_class_type="flatland::ModelPlugin"/>
  <class name="Broken" type="diagnosed.Broken" base_class_type="flatland::ModelPlugin"/>
</library>
"""
# Each scan has 40 kB, so that the buffers of a connection are soon full.
BEAMS = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: Laser, name: laser, body: base, range: 20,
     angle: {min: -2, max: 2, increment: 0.0004}}
"""
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

    def next(self) -> DiagnosticArray:
        self._topic.drop()
        return self._topic.next()


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, write_world: Callable[..., Path]) -> Any:
    world = write_world(
        "[{name: robot, model: beams.model.yaml}]",
        beams=BEAMS,
        slow="bodies: [{name: base, footprints: []}]\nplugins: [{type: Slow, name: plug}]\n",
        broken="bodies: [{name: base, footprints: []}]\nplugins: [{type: Broken, name: plug}]\n",
    )
    (world.parent / "diagnosed.py").write_text(PLUGINS)
    (world.parent / "manifest.xml").write_text(MANIFEST)
    manifest = str(world.parent / "manifest.xml")
    module_launcher.environment = {
        **module_launcher.environment,
        "FLATLAND_PLUGIN_PATH": manifest,
    }
    return module_launcher.server(world, update_rate=100)


@pytest.fixture
def diagnosed(ros: Any) -> Diagnosed:
    return Diagnosed(ros)


def test_rate_that_is_held(diagnosed: Diagnosed) -> None:
    values = diagnosed.until("simulation", lambda status, _: status.level == OK)
    assert float(values["update rate [Hz]"]) == 100
    assert float(values["target real-time factor"]) == 0.5
    assert 0 < float(values["real-time factor"]) < 0.7
    assert 0 < float(values["steps per second"]) < 140
    assert values["models"] == "1"
    assert float(values["simulated time [s]"]) > 0


def test_messages_are_complete(diagnosed: Diagnosed) -> None:
    message = diagnosed.next()
    assert [status.name for status in message.status] == [
        f"flatland_server: {name}" for name in ("simulation", "plugins", "subscribers")
    ]
    assert {status.hardware_id for status in message.status} == {"flatland"}
    later = diagnosed.next()
    assert later.header.stamp > message.header.stamp


def test_messages_continue_while_the_world_is_paused(ros: Any, diagnosed: Diagnosed) -> None:
    ros.call("/pause", Empty)
    values = diagnosed.until("simulation", lambda status, _: status.message == "paused")
    assert values["paused"] == "True"
    stopped = diagnosed.until("simulation", lambda _, v: float(v["steps per second"]) == 0)
    ros.call("/resume", Empty)
    assert float(stopped["real-time factor"]) == 0


def test_rate_that_is_not_held_and_costs_of_plugins(ros: Any, diagnosed: Diagnosed) -> None:
    assert ros.spawn("slow.model.yaml", "slow").success
    diagnosed.until(
        "simulation",
        lambda status, _: (
            status.level == WARN
            and status.message.startswith("the update rate of 100 Hz cannot be held: ")
        ),
    )
    # A step takes 30 ms of the plugin, and little else.
    name = 'Model Plugin "plug" type "Slow" model "slow" [%]'
    values = diagnosed.until("plugins", lambda _, v: float(v.get(name, 0)) > 50)
    assert float(values["all of type Slow [%]"]) == pytest.approx(float(values[name]), abs=0.02)
    assert ros.delete("slow").success
    diagnosed.until("simulation", lambda status, _: status.level == OK)


def test_subscriber_that_does_not_keep_up(ros: Any, diagnosed: Diagnosed) -> None:
    diagnosed.until("subscribers", lambda status, _: status.level == OK)
    stuck = RawSubscriber(ros.master, "/scan", LaserScan, receive_buffer=4096)
    values = diagnosed.until(
        "subscribers",
        lambda status, _: (
            status.level == WARN and status.message == "subscribers do not keep up: /scan to /raw"
        ),
    )
    assert values["/scan to /raw"].endswith(" messages dropped")
    stuck.close()
    diagnosed.until("subscribers", lambda status, v: status.level == OK and not v)


def test_disabled_plugin(ros: Any, diagnosed: Diagnosed) -> None:
    assert ros.spawn("broken.model.yaml", "broken").success
    values = diagnosed.until("plugins", lambda status, _: status.level == ERROR)
    assert values["disabled"] == 'Model Plugin "plug" type "Broken" model "broken"'
    assert ros.delete("broken").success
    diagnosed.until("plugins", lambda status, _: status.level == OK)


def test_simulation_as_fast_as_possible(ros: Any, diagnosed: Diagnosed) -> None:
    assert ros.call("/set_rate", SetRate, 0).success
    values = diagnosed.until("simulation", lambda _, v: v["update rate [Hz]"] == "inf")
    assert values["target real-time factor"] == "inf"
    assert ros.call("/set_rate", SetRate, 100).success


def test_nothing_is_computed_without_a_subscriber(
    ros: Any, monkeypatch: pytest.MonkeyPatch, eventually: Callable[..., Any]
) -> None:
    """In this process, with the node above as a second publisher."""
    ticks: list[bool] = []
    tick = Diagnostics._tick

    def record(diagnostics: Diagnostics, due: float) -> bool:
        ticks.append(tick(diagnostics, due))
        return ticks[-1]

    monkeypatch.setattr(Diagnostics, "_tick", record)
    registrar, world = Registrar(), flatland.World(seed=1)
    simulation = Simulation(world)
    thread = threading.Thread(target=simulation.run)
    thread.start()
    diagnostics = simulation.post(lambda: Diagnostics(registrar, simulation)).result(TIMEOUT)
    try:
        assert registrar.flush(TIMEOUT)
        start = world.time
        eventually("half a second", lambda: world.time > start + 0.5)
        assert True not in ticks
        assert len(ticks) <= 1  # that of the registration
        topic = ros.topic("/diagnostics", DiagnosticArray)
        topic.until(lambda message: message.status[0].name == "flatland_tests: simulation")
        eventually("the ticks of a message", lambda: ticks.count(True) >= 6)
        topic.close()
        eventually("the end of the ticks", lambda: ticks[-1] is False)
        assert world.plugin_host.costs is None
    finally:
        simulation.stop()
        thread.join(TIMEOUT)
        diagnostics.close()
        diagnostics._publisher.close()
        assert registrar.flush(TIMEOUT)
        registrar.close(TIMEOUT)
        world.close()
