"""The ROS master is killed and restarted."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

import pytest
import rosgraph
import tcpros
from free_ports import free_port
from geometry_msgs.msg import Pose2D
from rosgraph_msgs.msg import Clock
from tcpros import ServiceClient
from waiting import TIMEOUT, wait_until

from flatland.srv import SetRate, SpawnModel, WaitUntilReady

NODE = "/flatland_server"
PLUGIN = """
import flatland
from std_msgs.msg import String
from std_srvs.srv import Trigger, TriggerResponse


class Talker(flatland.ModelPlugin):
    def on_initialize(self, config):
        self.ros.advertise("talk", String, latch=True)
        self.ros.subscribe("listen", String, lambda message: None)
        self.ros.advertise_service("ask", Trigger, lambda request: TriggerResponse(True, ""))
"""
TALKER = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: "test::Talker", name: talker}
  - {type: DiffDrive, name: drive, body: base, pub_rate: 50}
"""
# Drives the robot and reports what it receives; continues without a master.
CLIENT = """
import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from std_srvs.srv import Empty

rospy.init_node("client", anonymous=True, disable_rostime=True)
speeds = []


def speed_of(odometry):
    return odometry.twist.twist.linear.x


rospy.Subscriber("/odometry/ground_truth", Odometry, lambda m: speeds.append(speed_of(m)))
publisher = rospy.Publisher("/cmd_vel", Twist, queue_size=1)
pause = rospy.ServiceProxy("/resume", Empty)
speed = 0.0
while not rospy.is_shutdown():
    speed = 0.1 if speed == 0.2 else 0.2
    command = Twist()
    command.linear.x = speed
    while not rospy.is_shutdown() and (not speeds or abs(speeds[-1] - speed) > 0.01):
        publisher.publish(command)
        rospy.rostime.wallsleep(0.02)
        del speeds[:-1]
    print("driven", flush=True)
    try:
        pause()
        print("called", flush=True)
    except Exception as error:
        print("not called:", error, flush=True)
    rospy.rostime.wallsleep(0.1)
"""


class Core:
    """A roscore of the test, apart from the one of other tests, that can be killed."""

    def __init__(self, environment: Mapping[str, str], start: Callable[..., Any]) -> None:
        self._port = free_port()
        self.uri = f"http://127.0.0.1:{self._port}"
        self.environment = {**environment, "ROS_MASTER_URI": self.uri}
        self.master = rosgraph.Master("/flatland_tests", self.uri)
        self._start = start
        self._process: Any = None

    def start(self) -> None:
        """Starts the core and waits for it."""
        self._process = self._start("roscore", "-p", str(self._port), ROS_MASTER_URI=self.uri)
        self._process.wait_for_line("started core service")

    def kill(self) -> None:
        """Kills roscore, the master and rosout with SIGKILL."""
        pids = [self.master.getPid(), node_pid(self.master, "/rosout")]
        self._process.kill()
        for pid in pids:
            os.kill(pid, signal.SIGKILL)
        wait_until("the end of the master", lambda: not self.master.is_online())


def node_pid(master: Any, node: str) -> int:
    """Returns the process of a node."""
    return int(ServerProxy(master.lookupNode(node)).getPid("/test")[2])


def registered(master: Any) -> list[set[str]]:
    """Returns all topics, subscriptions and services of the node."""
    return [
        {name for name, nodes in entries if NODE in nodes} for entries in master.getSystemState()
    ]


def current_lines(process: Any, text: str) -> int:
    """Returns the number of lines with a text."""
    return sum(text in line for line in process.lines)


@pytest.fixture
def core(launcher: Any) -> Core:
    core = Core(launcher.environment, launcher.program)
    core.start()
    launcher.environment = core.environment
    return core


def start_server(core: Core, launcher: Any, world: Path) -> Any:
    """Starts a node that publishes debug markers, and waits until all its topics are registered."""
    arguments = (f"_world_path:={world}", "_show_viz:=true", "_custom:=value")
    server = launcher.node(*arguments, f"_shutdown_timeout:={TIMEOUT}")
    service = "/wait_until_ready"
    wait_until("its services", lambda: service in registered(core.master)[2])
    address = tcpros.service_address(core.master, service)
    client = ServiceClient(address, service, WaitUntilReady, persistent=False)
    answer = client.call([], TIMEOUT)
    assert answer.success, answer.message
    return server


def test_node_registers_again_with_a_new_master(
    core: Core, launcher: Any, write_world: Callable[..., Path]
) -> None:
    world = write_world("[{name: robot, model: talker.model.yaml}]", talker=TALKER)
    launcher.add_plugins(world.parent, PLUGIN, "test_talker")
    core.master.setParam("/use_sim_time", True)
    server = start_server(core, launcher, world)
    client = launcher.program(sys.executable, "-c", CLIENT)
    client.wait_for_line("called")
    before = registered(core.master)
    assert {"/clock", "/talk", "/odometry/ground_truth", f"{NODE}/paused"} <= before[0]
    assert {"/listen", "/cmd_vel"} <= before[1]
    assert {"/ask", "/spawn_model", f"{NODE}/get_loggers"} <= before[2]
    services = tcpros.service_address(core.master, "/set_rate")
    set_rate = ServiceClient(services, "/set_rate", SetRate, persistent=True)
    spawn = ServiceClient(services, "/spawn_model", SpawnModel, persistent=True)
    assert set_rate.call(190.0).success
    clock = tcpros.Subscriber(core.master, "/clock", Clock, node=NODE)

    core.kill()
    server.wait_for_line(rf"\[WARN\].*the ROS master at {core.uri} does not respond")
    # The simulation, connections and calls continue; models can be spawned.
    first = Clock().deserialize(tcpros.read_frame(clock.socket)).clock
    driven = current_lines(client, "driven")
    wait_until("a robot that drives", lambda: current_lines(client, "driven") > driven + 3)
    while Clock().deserialize(tcpros.read_frame(clock.socket)).clock.to_sec() < first.to_sec() + 1:
        pass
    assert set_rate.call(210.0).success
    assert spawn.call(str(world.parent / "talker.model.yaml"), "late", "late", Pose2D()).success

    core.start()
    server.wait_for_line(
        rf"\[WARN\].*the ROS master at {core.uri} is back: registered \d+ topics, "
        r"\d+ subscriptions and \d+ services again"
    )
    late = {"/late/talk", "/late/odometry/ground_truth", f"{NODE}/debug/model/late"}
    wait_until("the topics of the new model", lambda: late <= registered(core.master)[0])
    wait_until(
        "all registrations",
        lambda: (
            [{name for name in names if "late" not in name} for names in registered(core.master)]
            == before
        ),
    )
    wait_until("the rate", lambda: core.master.getParam(f"{NODE}/update_rate") == 210.0)
    assert core.master.getParam(f"{NODE}/custom") == "value"
    assert core.master.getParam("/use_sim_time") is True
    # The old client finds the service again; a new one finds the topics in both directions.
    called = current_lines(client, "called") - current_lines(client, "not called")
    wait_until(
        "calls of the old client",
        lambda: current_lines(client, "called") - current_lines(client, "not called") > called + 2,
    )
    client.send(signal.SIGKILL)
    client.wait()
    new_client = launcher.program(sys.executable, "-c", CLIENT)
    new_client.wait_for_line("driven")
    new_client.wait_for_line("^called")
    new_client.kill()
    assert current_lines(server, "does not respond") == 1
    assert current_lines(server, "is back:") == 1
    assert "Traceback" not in server.output

    core.kill()
    assert server.stop() == 0
    assert "Traceback" not in server.output
