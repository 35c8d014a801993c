"""Carries out the script of commands with ROS 1: ros1.py WORLD SEED RESULT."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

with socket.socket() as probe:
    probe.bind(("127.0.0.1", 0))
    PORT = str(probe.getsockname()[1])
os.environ |= {"ROS_MASTER_URI": f"http://127.0.0.1:{PORT}", "ROS_IP": "127.0.0.1"}

import rosgraph
import rospy
from command_script import FAILURES, run_script
from geometry_msgs.msg import Pose2D, Twist
from std_srvs.srv import Trigger
from waiting import TIMEOUT, wait_until

import flatland.srv
from flatland.srv import DeleteModel, MoveModel, ResetWorld, SpawnModel, StepWorld


class Ros1Client:
    """Carries out commands by topics and services of ROS 1."""

    def __init__(self) -> None:
        self._commands = rospy.Publisher("/cmd_vel", Twist, queue_size=1)
        wait_until("a subscriber of /cmd_vel", self._commands.get_num_connections)

    def drive(self, linear: float, angular: float) -> None:
        command = Twist()
        command.linear.x, command.angular.z = linear, angular
        self._commands.publish(command)

    def _call(self, name: str, service_type: type, *arguments: object) -> None:
        answer = rospy.ServiceProxy(name, service_type)(*arguments)
        assert (answer.success, answer.message) == (True, "")

    def step(self, duration: float) -> None:
        self._call("/step_world", StepWorld, duration)

    def move(self, model: str, pose: Sequence[float]) -> None:
        self._call("/move_model", MoveModel, model, Pose2D(*pose))

    def spawn(self, file: str, name: str, pose: Sequence[float]) -> None:
        self._call("/spawn_model", SpawnModel, file, name, "", Pose2D(*pose))

    def delete(self, model: str) -> None:
        self._call("/delete_model", DeleteModel, model)

    def reset(self, seed: int) -> None:
        self._call("/reset_world", ResetWorld, False, seed)

    def probe(self) -> str:
        return str(rospy.ServiceProxy("/probe", Trigger)().message)


_, path, seed, result = sys.argv
core = subprocess.Popen(["roscore", "-p", PORT], stdout=subprocess.DEVNULL)
server = None
try:
    wait_until("a ROS master", rosgraph.is_master_online)
    parameters = {"world_path": path, "seed": seed, "lockstep": True}
    given = [f"_{name}:={value}" for name, value in parameters.items()]
    code = "import sys; from flatland.ros.node import main; sys.exit(main())"
    server = subprocess.Popen([sys.executable, "-c", code, *given])
    rospy.init_node("script", disable_rostime=True)
    rospy.wait_for_service("/probe", TIMEOUT)
    run_script(Ros1Client(), Path(result))
    answers = []
    for name, service_type, fields in FAILURES:
        found = getattr(flatland.srv, service_type)
        answer = rospy.ServiceProxy(f"/{name}", found)(found._request_class(**fields))
        answers.append([answer.success, answer.message])
    Path(result).with_suffix(".failures").write_text(json.dumps(answers))
finally:
    for process in (server, core):
        if process is not None:
            process.send_signal(signal.SIGINT)
            process.wait(TIMEOUT)
