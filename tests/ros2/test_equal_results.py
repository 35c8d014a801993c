"""One script of commands gives equal scans and states on ROS 1, ROS 2 and without ROS."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import flatland_msgs.srv
import pytest
from command_script import FAILURES, run_script, write_world
from flatland_msgs.srv import DeleteModel, MoveModel, ResetWorld, SpawnModel
from geometry_msgs.msg import Pose2D, Twist
from programs import run_program
from std_srvs.srv import Trigger

SEED = 3
RUNNERS = Path(__file__).parent / "runners"


class Ros2Client:
    """Carries out commands by topics and services of ROS 2."""

    def __init__(self, ros: Any) -> None:
        self._ros = ros
        self._commands = ros.publisher("/cmd_vel", Twist)

    def drive(self, linear: float, angular: float) -> None:
        command = Twist()
        command.linear.x, command.angular.z = linear, angular
        self._commands.publish(command)

    def step(self, duration: float) -> None:
        self._ros.step(duration)

    def _call(self, service: str, service_type: type[Any], **fields: object) -> None:
        answer = self._ros.call(service, service_type, **fields)
        assert (answer.success, answer.message) == (True, "")

    def move(self, model: str, pose: Sequence[float]) -> None:
        self._call("/move_model", MoveModel, name=model, pose=pose_message(pose))

    def spawn(self, file: str, name: str, pose: Sequence[float]) -> None:
        self._call("/spawn_model", SpawnModel, yaml_path=file, name=name, pose=pose_message(pose))

    def delete(self, model: str) -> None:
        self._call("/delete_model", DeleteModel, name=model)

    def reset(self, seed: int) -> None:
        self._call("/reset_world", ResetWorld, seed=seed)

    def probe(self) -> str:
        return str(self._ros.call("/probe", Trigger).message)


def pose_message(pose: Sequence[float]) -> Pose2D:
    x, y, theta = pose
    return Pose2D(x=x, y=y, theta=theta)


def environment_of_ros_1(checkout: Path) -> dict[str, str]:
    """Returns the environment of a shell in which ROS 2 is not active."""
    hidden = ("LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE", "VIRTUAL_ENV", "PYTHONPATH")
    plain = {name: value for name, value in os.environ.items() if name not in hidden}
    return plain | {"PYTHONPATH": f"{checkout}:{checkout}/tests/support"}


@pytest.mark.kilted
def test_equal_results(ros: Any, launcher: Any, checkout: Path, tmp_path: Path) -> None:
    world, plugin = write_world(tmp_path)
    launcher.environment |= plugin
    launcher.server(ros, world, lockstep=True, seed=SEED)
    run_script(Ros2Client(ros), tmp_path / "ros2.json")
    failures = []
    for name, service_type, fields in FAILURES:
        answer = ros.call(f"/{name}", getattr(flatland_msgs.srv, service_type), **fields)
        failures.append([answer.success, answer.message])

    python = checkout / ".venv" / "bin" / "python"
    environment = environment_of_ros_1(checkout) | plugin
    for runner in ("ros1", "plain"):
        result = tmp_path / f"{runner}.json"
        program = RUNNERS / f"{runner}.py"
        run_program([python, program, world, str(SEED), result], env=environment, check=True)
    # Without the numpy of Debian as well.
    other = tmp_path / "wheels.json"
    plain = [sys.executable, RUNNERS / "plain.py", world, str(SEED), other]
    run_program(plain, env=os.environ | environment_of_support(checkout) | plugin, check=True)

    expected = json.loads((tmp_path / "plain.json").read_text())
    assert len(expected) == 5
    assert len(set(expected)) == 5
    assert not any(success or not message for success, message in failures)
    assert json.loads((tmp_path / "ros1.failures").read_text()) == failures
    for name in ("ros1", "ros2", "wheels"):
        assert json.loads((tmp_path / f"{name}.json").read_text()) == expected, name


def environment_of_support(checkout: Path) -> dict[str, str]:
    return {"PYTHONPATH": f"{checkout}/tests/support"}
