"""Guarantees to plugins in the node: one thread, and no blame for exceptions of subscribers."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Twist
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String
from std_srvs.srv import Trigger

PLUGINS = """
import sqlite3

from sensor_msgs.msg import LaserScan as LaserScanMessage
from std_msgs.msg import String
from std_srvs.srv import Trigger, TriggerResponse

import flatland
from flatland.ros.adapters import find_adapter, register_adapter

FAULTS = 10
built_in = find_adapter(flatland.LaserScan)
scans = 0


def faulty_conversion(scan):
    global scans
    scans += 1
    if scans <= FAULTS:
        raise ValueError(f"scan {scans} cannot be converted")
    return built_in.to_message(scan)


class FaultyAdapter(flatland.ModelPlugin):
    def on_initialize(self, config):
        register_adapter(flatland.LaserScan, LaserScanMessage, faulty_conversion)


class Journal(flatland.ModelPlugin):
    # A connection of sqlite3 raises if it is used in another thread than the one that opened it.

    def on_initialize(self, config):
        self.database = sqlite3.connect(":memory:")
        self.database.execute("CREATE TABLE calls (name TEXT)")
        self.record("on_initialize")
        self.ros.subscribe("note", String, self.on_note)
        self.ros.advertise_service("journal", Trigger, self.on_request)
        self.command("speed", flatland.Twist, flatland.Twist(), self.accept)

    def record(self, name):
        self.database.execute("INSERT INTO calls VALUES (?)", (name,))

    def before_physics_step(self, timekeeper):
        self.record("before_physics_step")

    def after_physics_step(self, timekeeper):
        self.record("after_physics_step")

    def begin_contact(self, contact):
        self.record("begin_contact")

    def end_contact(self, contact):
        self.record("end_contact")

    def pre_solve(self, contact, old_manifold):
        self.record("pre_solve")

    def accept(self, value):
        self.record("accept")
        return True

    def on_note(self, message):
        self.record(message.data)

    def on_request(self, request):
        self.record("on_request")
        return TriggerResponse(True, self.names())

    def on_shutdown(self):
        self.record("on_shutdown")
        print(f"journal of {self.model.name} at the end:", self.names(), flush=True)

    def names(self):
        rows = self.database.execute("SELECT DISTINCT name FROM calls ORDER BY name")
        return " ".join(name for name, in rows)
"""
SCANNER = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: "test::FaultyAdapter", name: adapter}
  - {type: Laser, name: laser, body: base, range: 20, update_rate: 50,
     angle: {min: -1.5, max: 1.5, increment: 0.5}}
"""
JOURNAL = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins: [{type: "test::Journal", name: journal}]
"""


@pytest.fixture(scope="module")
def server(module_launcher: Any, write_world: Callable[..., Path]) -> Any:
    """A server with a plugin of each class; `loaded` touches `ball`."""
    world = write_world(
        "[{name: loaded, model: journal.model.yaml, namespace: loaded},"
        " {name: ball, model: ball.model.yaml, pose: [0.3, 0, 0]},"
        " {name: scanner, model: scanner.model.yaml, pose: [3, 3, 0]}]",
        journal=JOURNAL,
        scanner=SCANNER,
    )
    module_launcher.add_plugins(world.parent, PLUGINS, "test_plugins_of_contracts")
    return module_launcher.server(world)


@pytest.mark.parametrize("spawned", [False, True])
def test_all_code_of_a_plugin_runs_in_one_thread(
    ros: Any, server: Any, eventually: Callable[..., Any], spawned: bool
) -> None:
    name = "loaded"
    if spawned:
        name = "spawned"
        assert ros.move("ball", (0.3, 0, 0)).success
        answer = ros.spawn("journal.model.yaml", name, name)
        assert answer.success, answer.message
    notes = ros.publisher(f"/{name}/note", String)
    speeds = ros.publisher(f"/{name}/speed", Twist)
    expected = {
        *("on_initialize", "before_physics_step", "after_physics_step", "begin_contact"),
        *("pre_solve", "on_request", "accept", "a note"),
    }

    def recorded() -> set[str]:
        notes.publish(String("a note"))
        speeds.publish(Twist())
        answer = ros.call(f"/{name}/journal", Trigger)
        return set(re.findall(r"a note|\w+", answer.message))

    eventually("all calls", lambda: recorded() >= expected)
    assert ros.move(name, (-3, -3, 0)).success
    eventually("end of the contact", lambda: "end_contact" in recorded())
    assert ros.delete(name).success
    server.wait_for_line(f"journal of {name} at the end: .* on_shutdown")
    assert "ProgrammingError" not in server.output


def test_exception_of_an_adapter_does_not_disable_the_sensor(ros: Any, server: Any) -> None:
    scan = ros.topic("/scan", LaserScan).next()
    assert len(scan.ranges) == 7
    server.wait_for_line(
        r'\[ERROR\].*: subscriber ROS topic "/scan" \(adapter '
        r'test_plugins_of_contracts.faulty_conversion\) of output "/scan" raised$'
    )
    server.wait_for_line("ValueError: scan 1 cannot be converted")
    assert "laser" not in "".join(line for line in server.lines if "[ERROR]" in line)
    assert "disabled" not in server.output
    assert server.stop() == 0
