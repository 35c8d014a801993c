"""`self.ros` of a plugin of a third party, with the types of ROS 2."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Float32, String
from std_srvs.srv import SetBool, Trigger

PLUGIN = """
from dataclasses import dataclass

import flatland
from flatland.ros2.adapters import register_adapter
from std_msgs.msg import Float32, String
from std_srvs.srv import SetBool, Trigger


@dataclass(frozen=True)
class Temperature:
    celsius: float


register_adapter(Temperature, Float32, lambda value: Float32(data=value.celsius),
                 lambda message: Temperature(message.data))


class Talker(flatland.ModelPlugin):
    def on_initialize(self, config):
        self.ros.advertise("hello", String, latch=True).publish(
            String(data="from " + self.ros.param("town", "nowhere")))
        self.echo = self.ros.advertise("echo", String)
        self.ros.subscribe("listen", String, self.on_message)
        self.ros.advertise_service("touch", Trigger, self.on_touch)
        self.ros.advertise_service("fail", SetBool, self.on_fail)
        self.temperature = self.output("temperature", Temperature)
        self.target = self.command("target", Temperature, Temperature(20.0))

    def after_physics_step(self, timekeeper):
        self.temperature.emit(self.target.value)

    def on_message(self, message):
        self.echo.publish(String(data=message.data.upper()))

    def on_touch(self, request):
        return Trigger.Response(success=True, message=self.model.name)

    def on_fail(self, request):
        raise RuntimeError("expected")
"""
MODEL = "bodies: [{name: base, footprints: []}]\nplugins: [{name: p, type: 'test::Talker'}]\n"
MANIFEST = (
    '<library path="."><class name="test::Talker" type="talker_of_tests.Talker" '
    'base_class_type="flatland::ModelPlugin"/></library>'
)


@pytest.fixture(scope="module", autouse=True)
def server(module_ros: Any, module_launcher: Any, write_world: Callable[..., Path]) -> Any:
    world = write_world("[{name: t, model: talker.model.yaml, namespace: t1}]", talker=MODEL)
    (world.parent / "talker_of_tests.py").write_text(PLUGIN)
    manifest = world.parent / "manifest.xml"
    manifest.write_text(MANIFEST)
    module_launcher.environment["FLATLAND_PLUGIN_PATH"] = str(manifest)
    return module_launcher.server(module_ros, world, "-p", "t1.town:=Flatville")


def test_latched_message_holds_a_parameter(ros: Any) -> None:
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    assert ros.topic("/t1/hello", String, latched).next().data == "from Flatville"


def test_messages_and_services(ros: Any) -> None:
    echo = ros.topic("/t1/echo", String)
    publisher = ros.publisher("/t1/listen", String)
    ros.wait_until_ready("/t1/echo", "/t1/listen")
    publisher.publish(String(data="loud"))
    assert echo.next().data == "LOUD"
    answer = ros.call("/t1/touch", Trigger)
    assert (answer.success, answer.message) == (True, "t")
    answer = ros.call("/t1/fail", SetBool)
    assert not answer.success
    assert "RuntimeError: expected" in answer.message


def test_values_of_its_own(ros: Any) -> None:
    temperature = ros.topic("/t1/temperature", Float32)
    assert temperature.next().data == 20.0
    ros.publisher("/t1/target", Float32).publish(Float32(data=30.5))
    temperature.until(lambda message: message.data == 30.5)
