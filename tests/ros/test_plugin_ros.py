"""`self.ros` of a plugin, adapters for values of its own, and their end with the model."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import Float32, String
from std_srvs.srv import SetBool

PLUGINS = """
import sys
from dataclasses import dataclass

from std_msgs.msg import Float32, String
from std_srvs.srv import SetBool, Trigger

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
        self.echo = self.ros.advertise("echo", String)
        self.ros.subscribe("listen", String, self.on_message)
        self.ros.advertise_service("/fail", SetBool, self.on_fail)

    def on_message(self, message):
        if message.data == "raise":
            raise ValueError("expected")
        if message.data == "exit":
            sys.exit("expected")
        if message.data in ("step", "close"):
            try:
                getattr(self.world, message.data)()
            except flatland.WorldError as error:
                self.echo.publish(String(str(error)))
            return
        self.echo.publish(message)

    def on_fail(self, request):
        if request.data:
            raise RuntimeError("expected error")
        sys.exit("expected exit")


class Stove(flatland.ModelPlugin):
    def on_initialize(self, config):
        self.temperature = self.output("temperature", Temperature)
        self.target = self.command("target", Temperature, Temperature(20.0))
        self.secret = self.output("secret", Unknown)

    def after_physics_step(self, timekeeper):
        self.temperature.emit(Temperature(self.target.value.celsius))


class NeedsParam(flatland.ModelPlugin):
    def on_initialize(self, config):
        self.ros.advertise("left_over", String)
        self.ros.param("missing")


class WrongType(flatland.ModelPlugin):
    def on_initialize(self, config):
        self.ros.advertise("left_over", String)
        self.ros.advertise("/clock", String)


class OtherType(flatland.ModelPlugin):
    def on_initialize(self, config):
        self.ros.advertise("/temperature/", String)


class WrongName(flatland.ModelPlugin):
    def on_initialize(self, config):
        self.ros.subscribe("no name", String, print)


class TakenService(flatland.ModelPlugin):
    def on_initialize(self, config):
        self.ros.advertise_service("/spawn_model", Trigger, print)
"""
NAMES = (
    "Talker",
    "Stove",
    "NeedsParam",
    "WrongType",
    "OtherType",
    "WrongName",
    "TakenService",
)


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, write_world: Callable[..., Path]) -> Any:
    files = {
        name: "bodies: [{name: base, footprints: []}]\n"
        f"plugins: [{{name: p, type: 'test::{name}'}}]\n"
        for name in NAMES
    }
    world = write_world("[{name: first, model: Stove.model.yaml}]", **files)
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


def test_callback_that_raises_is_logged_and_called_again(
    ros: Any, talker: None, server: Any
) -> None:
    del talker
    echo = ros.ready_topic("/t1/echo", String)
    publisher = ros.publisher("/t1/listen", String)
    for word, kind in (("raise", "ValueError"), ("exit", "SystemExit")):
        publisher.publish(String(word))
        publisher.publish(String("hi"))
        assert echo.next().data == "hi"
        server.wait_for_line(f"{kind}: expected")


def test_exception_of_a_service_is_reported_to_the_client(ros: Any, talker: None) -> None:
    del talker
    import rospy

    with pytest.raises(rospy.ServiceException, match="expected error"):
        ros.call("/fail", SetBool, True)
    with pytest.raises(rospy.ServiceException, match=r"SystemExit.*expected exit"):
        ros.call("/fail", SetBool, False)


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
        ("NeedsParam", 'ROS parameter "/m/missing" is not set'),
        ("WrongType", 'publisher "/clock" has the type rosgraph_msgs/Clock already'),
        (
            "OtherType",
            'publisher "/temperature" has the type std_msgs/Float32 already, used by Model Plugin '
            '"p" type "test::Stove" model "first", not std_msgs/String',
        ),
        ("WrongName", '"no name" is not a legal topic name'),
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


@pytest.mark.parametrize("method", ["step", "close"])
def test_callback_may_not_step_or_close_the_world(ros: Any, server: Any, method: str) -> None:
    assert ros.spawn("Talker.model.yaml", "m").success
    echo = ros.ready_topic("/echo", String)
    ros.publisher("/listen", String).publish(String(method))
    assert f"{method} must not be called from a plugin's hook" in echo.next().data
    assert ros.delete("m").success
