"""`self.ros` of a plugin, adapters for values of its own, and the one thread that calls it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import Float32, String
from std_srvs.srv import SetBool, Trigger
from waiting import wait_until

PLUGINS = """
import sqlite3
import sys
from dataclasses import dataclass

from std_msgs.msg import Float32, String
from std_srvs.srv import SetBool, Trigger, TriggerResponse

import flatland
from flatland.ros.adapters import register_adapter


@dataclass(frozen=True)
class Temperature:
    celsius: float


@dataclass(frozen=True)
class Unknown:
    pass


register_adapter(Temperature, Float32, lambda value: Float32(value.celsius),
                 lambda message: Temperature(message.data))


class Talker(flatland.ModelPlugin):
    def on_initialize(self, config):
        self.hello = self.ros.advertise("hello", String, latch=True)
        self.hello.publish(String("from " + self.ros.param("town", "nowhere")))
        self.ros.advertise_service("/fail", SetBool, self.on_fail)

    def on_fail(self, request):
        raise RuntimeError("expected error")


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
        if message.data == "exit":
            sys.exit("expected")
        if message.data == "step":
            try:
                self.world.step()
            except flatland.WorldError as error:
                self.record("refused_step")
                assert "step must not be called from a plugin's hook" in str(error)
            return
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


class Stove(flatland.ModelPlugin):
    def on_initialize(self, config):
        self.temperature = self.output("temperature", Temperature)
        self.target = self.command("target", Temperature, Temperature(20.0))
        self.secret = self.output("secret", Unknown)

    def after_physics_step(self, timekeeper):
        self.temperature.emit(Temperature(self.target.value.celsius))


class WrongType(flatland.ModelPlugin):
    def on_initialize(self, config):
        self.ros.advertise("left_over", String)
        self.ros.advertise("/clock", String)


class TakenService(flatland.ModelPlugin):
    def on_initialize(self, config):
        self.ros.advertise_service("/spawn_model", Trigger, print)
"""
NAMES = ("Talker", "Journal", "Stove", "WrongType", "TakenService")


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, write_world: Callable[..., Path]) -> Any:
    """A server with some of the plugins; `loaded` touches `ball`."""
    base = "bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]\n"
    files = {name: f"{base}plugins: [{{name: p, type: 'test::{name}'}}]\n" for name in NAMES}
    world = write_world(
        "[{name: first, model: Stove.model.yaml, pose: [3, 3, 0]},"
        " {name: loaded, model: Journal.model.yaml, namespace: loaded},"
        " {name: ball, model: ball.model.yaml, pose: [0.3, 0, 0]}]",
        **files,
    )
    module_launcher.add_plugins(world.parent, PLUGINS, "test_plugins_of_ros")
    return module_launcher.server(world)


@pytest.fixture
def talker(ros: Any) -> Any:
    """A model with a Talker in a namespace, deleted after the test."""
    ros.master.setParam("/t1/town", "Flatville")
    before = ros.registered()
    answer = ros.spawn("Talker.model.yaml", "talker", "t1")
    assert answer.success, answer.message
    yield
    ros.delete("talker")
    assert ros.registered() == before


def test_latched_message_of_on_initialize_holds_a_parameter(ros: Any, talker: None) -> None:
    del talker
    message = ros.topic("/t1/hello", String).next()
    assert message.data == "from Flatville"
    assert message._connection_header["latching"] == "1"


def test_exception_of_a_service_is_reported_to_the_client(ros: Any, talker: None) -> None:
    del talker
    with pytest.raises(rospy.ServiceException, match="expected error"):
        ros.call("/fail", SetBool, True)


@pytest.mark.parametrize("name", ["loaded", "spawned"])
def test_all_code_of_a_plugin_runs_in_one_thread(ros: Any, server: Any, name: str) -> None:
    if name == "spawned":
        assert ros.move("ball", (0.3, 0, 0)).success
        answer = ros.spawn("Journal.model.yaml", name, name)
        assert answer.success, answer.message
    notes = ros.publisher(f"/{name}/note", String)
    speeds = ros.publisher(f"/{name}/speed", Twist)
    expected = {
        *("on_initialize", "before_physics_step", "after_physics_step", "begin_contact"),
        *("pre_solve", "on_request", "accept", "a_note", "refused_step"),
    }

    def recorded() -> set[str]:
        # The exception of the first one is logged, and has no effect on the others.
        for word in ("exit", "step", "a_note"):
            notes.publish(String(word))
        speeds.publish(Twist())
        return set(ros.call(f"/{name}/journal", Trigger).message.split())

    wait_until("all calls", lambda: recorded() >= expected)
    server.wait_for_line("SystemExit: expected")
    assert ros.move(name, (-3, -3, 0)).success
    wait_until("end of the contact", lambda: "end_contact" in recorded())
    assert ros.delete(name).success
    server.wait_for_line(f"journal of {name} at the end: .* on_shutdown")
    assert "ProgrammingError" not in server.output


def test_registered_adapter_converts_in_both_directions(ros: Any) -> None:
    temperatures = ros.topic("/temperature", Float32)
    assert temperatures.next().data == 20.0
    ros.publisher("/target", Float32).publish(Float32(180.0))
    temperatures.until(lambda message: message.data == 180.0)


def test_output_without_an_adapter_gives_a_warning(ros: Any, server: Any) -> None:
    server.wait_for_line(r'\[WARN\].*output "/secret" is not connected to ROS: no adapter for Unk')
    assert "/secret" not in ros.registered()["publishers"]


@pytest.mark.parametrize(
    ("model", "reason"),
    [
        ("WrongType", 'publisher "/clock" has the type rosgraph_msgs/Clock already'),
        ("TakenService", 'service "/spawn_model" has the type flatland/SpawnModel already'),
    ],
)
def test_plugin_that_fails_to_start_leaves_nothing_registered(
    ros: Any, model: str, reason: str
) -> None:
    before = ros.registered()
    answer = ros.spawn(f"{model}.model.yaml", "m", "m")
    assert answer.success is False
    assert answer.message.startswith(f'Flatland plugin: Model Plugin "p" type "test::{model}"')
    assert reason in answer.message
    assert ros.registered() == before


def test_second_service_of_the_same_name_is_refused(ros: Any, talker: None) -> None:
    del talker
    answer = ros.spawn("Talker.model.yaml", "second", "t2")
    assert answer.success is False
    first = 'Model Plugin "p" type "test::Talker" model "talker"'
    assert f'service "/fail" exists already, used by {first}' in answer.message
    assert "/t2/hello" not in ros.registered()["publishers"]
