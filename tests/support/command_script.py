"""One script of commands, carried out by ROS 1, by ROS 2 and by a program without ROS.

The world contains a plugin of a third party, which uses `self.ros` with the types of either ROS.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

from room_world import ROBOT, write_room_world

MODELS = """
  - {name: robot, model: noisy.model.yaml, pose: [1, 2, 0]}
  - {name: ball, model: ball.model.yaml, pose: [2.5, 2.2, 0]}
"""
NOISY_ROBOT = ROBOT.replace("range: 20,", "range: 20, noise_std_dev: 0.02,")
PLUGIN = '''
import flatland


class Probe(flatland.WorldPlugin):
    """Returns the number of commands received, the ranges of the laser and the state."""

    def on_initialize(self, config):
        if self.ros is None:
            return
        from std_srvs import srv

        response = getattr(srv, "TriggerResponse", None) or srv.Trigger.Response
        self.ros.advertise_service(
            "probe", srv.Trigger, lambda request: response(success=True, message=self.probe())
        )

    def probe(self):
        command = self.world.command("/cmd_vel")
        received = sum(each.received for each in command._commands)
        scan = self.world.output("/scan").latest
        ranges = "" if scan is None else scan.ranges.tobytes().hex()
        return f"{received} {ranges} {self.world.state_hash()}"
'''
MANIFEST = (
    '<library path="."><class name="third::Probe" type="third_party.Probe" '
    'base_class_type="flatland::WorldPlugin"/></library>'
)


# Calls that fail: service, type and fields of the request.
FAILURES: tuple[tuple[str, str, dict[str, object]], ...] = (
    ("spawn_model", "SpawnModel", {"yaml_path": "no.model.yaml", "name": "n"}),
    ("spawn_model", "SpawnModel", {"yaml_path": "ball.model.yaml", "name": "ball"}),
    ("spawn_model", "SpawnModel", {"yaml_path": "ball.model.yaml", "name": "n", "ns": "a b"}),
    ("spawn_model", "SpawnModel", {"yaml_path": "{bodies: 3}", "name": "n"}),
    ("move_model", "MoveModel", {"name": "nobody"}),
    ("delete_model", "DeleteModel", {"name": "nobody"}),
    ("delete_models", "DeleteModels", {"names": ["ball", "nobody"]}),
    ("get_model_states", "GetModelStates", {"names": ["nobody"]}),
    ("set_rate", "SetRate", {"update_rate": -1.0}),
    ("set_appearance", "SetAppearance", {"model": "ball", "color": [2.0, 0.0, 0.0]}),
    ("set_layer_map", "SetLayerMap", {"layer": "2d"}),
    ("step_world", "StepWorld", {"duration": 0.003}),
    ("reset_world", "ResetWorld", {"seed": -2}),
    ("wait_until_ready", "WaitUntilReady", {"topics": ["/x"]}),
)


class Client(Protocol):
    """What carries out the commands of the script in a world in lockstep."""

    def drive(self, linear: float, angular: float) -> None:
        """Sends a velocity command."""

    def step(self, duration: float) -> None:
        """Steps for a simulated time [s]."""

    def move(self, model: str, pose: Sequence[float]) -> None:
        """Moves a model."""

    def spawn(self, file: str, name: str, pose: Sequence[float]) -> None:
        """Spawns a model."""

    def delete(self, model: str) -> None:
        """Deletes a model."""

    def reset(self, seed: int) -> None:
        """Resets the world with a seed."""

    def probe(self) -> str:
        """Returns what the plugin returns."""


def write_world(folder: Path) -> tuple[Path, dict[str, str]]:
    """Writes the world; returns its path, and environment variables for the plugin."""
    plugins = "[{name: probe, type: 'third::Probe'}]"
    world = write_room_world(folder, MODELS, plugins, noisy=NOISY_ROBOT)
    (folder / "third_party.py").write_text(PLUGIN)
    manifest = folder / "manifest.xml"
    manifest.write_text(MANIFEST)
    return world, {"FLATLAND_PLUGIN_PATH": str(manifest)}


def run_script(client: Client, result: Path) -> None:
    """Carries out the commands, and writes the answers of the plugin to a file."""
    answers = []
    received = 0

    def drive(linear: float, angular: float) -> None:
        nonlocal received
        client.drive(linear, angular)
        received += 1
        # A command is received asynchronously.
        while int(client.probe().split()[0]) < received:
            pass

    def step(duration: float) -> None:
        client.step(duration)
        answers.append(client.probe())
        assert len(answers[-1].split()) == 3, answers[-1]

    client.probe()  # From now on, the laser is computed.
    step(0.1)
    drive(0.5, 0.3)
    step(1.0)
    client.move("ball", (2.0, -1.0, 1.0))
    client.spawn("ball.model.yaml", "second", (-1.0, 2.0, 0.5))
    drive(-0.4, 0.8)
    step(1.5)
    client.delete("second")
    step(0.5)
    client.reset(5)
    received = 0
    drive(0.3, -0.2)
    step(0.7)
    result.write_text(json.dumps(answers))
