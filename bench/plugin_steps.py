"""Cost of a step with each included plugin, as a multiple of a Box2D step of one body.

The robot is on the benchmark map and rotates, so that its body never falls asleep. All plugins are
updated in every step, regardless of their default rate.
"""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import yaml

import flatland
from flatland.plugin_api.manifest import INCLUDED_PACKAGE
from flatland.plugin_api.registry import PluginRegistry
from flatland.runtime.observer import WorldObserver

from scenes import BEAMS, RANGE, benchmark_world_path  # isort: skip
from table import Row
from timing import best_pair

STEPS = 200  # per measurement
SECONDS = 0.4  # minimum duration of each comparison
TURN = 0.5  # rad/s
BASE = {"name": "base", "footprints": [{"type": "circle", "radius": 0.2, "density": 50}]}
WHEELS = {"front": (0.0, 0.0), "left": (-0.4, 0.2), "right": (-0.4, -0.2)}
# Parameters of each plugin besides its name and type.
PARAMETERS: dict[str, dict[str, Any]] = {
    "Laser": {
        "body": "base",
        "range": RANGE,
        "angle": {"min": -2.356194490192345, "max": 2.3562, "increment": 4.71238898038469 / 1080},
    },
    "Sonar": {"body": "base", "range": 5.0, "field_of_view": 0.5},
    "SemanticScan": {
        "body": "base",
        "range": RANGE,
        "angle": {"min": -2.356194490192345, "max": 2.3562, "increment": 4.71238898038469 / 1080},
    },
    "DiffDrive": {"body": "base"},
    "TricycleDrive": {
        "body": "base",
        "front_wheel_joint": "front",
        "rear_left_wheel_joint": "left",
        "rear_right_wheel_joint": "right",
    },
    "AckermannDrive": {"body": "base", "wheelbase": 0.5, "max_steer_angle": 0.6},
    "OmniDrive": {
        "body": "base",
        "layout": "mecanum",
        "wheelbase": 0.3,
        "track": 0.3,
        "max_wheel_speed": 1.0,
        "max_wheel_acceleration": 2.0,
    },
    "PathFollower": {
        "body": "base",
        "waypoints": [[0.5, 0.0], [0.5, 0.5]],
        "speed": 0.1,
        "acceleration": 0.1,
    },
    "WheelStates": {
        "wheels": [
            {"name": "left", "position": [0.0, 0.15], "radius": 0.1},
            {"name": "right", "position": [0.0, -0.15], "radius": 0.1},
        ]
    },
    "Hitch": {"update_rate": float("inf")},
    "ModelTfPublisher": {"publish_tf_world": True},
    "PosePublisher": {"message": "odometry"},
    "Bumper": {},
    "BoolSensor": {},
    "Gps": {"body": "base", "update_rate": float("inf")},
    "Imu": {"body": "base"},
    "Tween": {"body": "base", "delta": [0.5, 0.2, 0.1]},
    "RandomWall": {"layer": "2d", "robot_name": "robot", "num_of_walls": 5, "wall_wall_dist": 0.1},
    "Pedestrians": {"groups": [{"name": "visitor", "count": 10}]},
    "DummyModelPlugin": {
        "dummy_param_float": 0.123456,
        "dummy_param_string": "dummy_test_123456",
        "dummy_param_int": 123456,
    },
    "DummyWorldPlugin": {},
}
NOTES = {
    "Laser": f"{BEAMS} beams",
    "Sonar": "127 rays",
    "SemanticScan": f"{BEAMS} beams",
    "TricycleDrive": "4 bodies, 3 joints",
    "ModelTfPublisher": "4 bodies, 3 joints",
    "Bumper": "in contact with a post",
    "BoolSensor": "in contact with a post",
    "Pedestrians": "10 people",
}


class TransformListener(WorldObserver):
    """Receives all transforms, as the bridge does if /tf has subscribers."""

    def transforms_sent(self, transforms: Sequence[flatland.Transform]) -> None:
        self.last = transforms


def _wheels() -> tuple[list[Any], list[Any]]:
    """Returns the bodies and joints of the wheels of a tricycle."""
    bodies, joints = [], []
    shape = {"type": "circle", "radius": 0.05, "density": 1, "layers": []}
    for name, (x, y) in WHEELS.items():
        bodies.append({"name": name, "pose": [x, y, 0.0], "footprints": [shape]})
        ends = [{"name": "base", "anchor": [x, y]}, {"name": name, "anchor": [0.0, 0.0]}]
        kind = "revolute" if name == "front" else "weld"
        joints.append({"name": name, "type": kind, "bodies": ends})
    return bodies, joints


def _model(plugin: str | None) -> dict[str, Any]:
    """Returns the model file for a plugin."""
    bodies, joints = [BASE], []
    if plugin in ("TricycleDrive", "ModelTfPublisher"):
        wheels, joints = _wheels()
        bodies = [BASE, *wheels]
    elif plugin in ("Bumper", "BoolSensor"):
        # The post overlaps the base slightly, so that there is a contact in every step.
        post = {"type": "circle", "radius": 0.1, "center": [0.295, 0], "density": 0}
        bodies = [BASE, {"name": "post", "type": "static", "footprints": [post]}]
    return {"bodies": bodies, "joints": joints}


@contextlib.contextmanager
def world_with(plugin: str | None, observers: Sequence[WorldObserver] = ()) -> Iterator[Any]:
    """Loads a world with one robot and at most one plugin."""
    base = benchmark_world_path()
    given = yaml.safe_load(base.read_text())
    layer = {**given["layers"][0], "name": "2d"}
    layer["map"] = str(base.parent / layer["map"])
    model, plugins = _model(plugin), []
    if plugin is not None:
        entry = {"name": "plugin", "type": plugin, **PARAMETERS[plugin]}
        kind = PluginRegistry().find(plugin).base_class_type
        (plugins if kind == "flatland::WorldPlugin" else model.setdefault("plugins", [])).append(
            entry
        )
    robot = {"name": "robot", "model": "robot.yaml", "pose": given["models"][0]["pose"]}
    world = {"properties": {}, "layers": [layer], "models": [robot], "plugins": plugins}
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "robot.yaml").write_text(yaml.safe_dump(model))
        (Path(folder) / "world.yaml").write_text(yaml.safe_dump(world))
        path = Path(folder) / "world.yaml"
        with flatland.World.from_yaml(path, seed=1, observers=observers) as loaded:
            loaded.model("robot").body("base").set_velocity(0.0, 0.0, TURN)
            for topic in loaded.ports.commands:
                if loaded.command(topic).value_type is flatland.Twist:
                    loaded.command(topic).set(flatland.Twist(0.1, 0.0, TURN))
            loaded.step(100)
            yield loaded


def _stepper(world: flatland.World, outputs_wanted: bool) -> Callable[[], None]:
    """Returns a function that makes `STEPS` steps and reads the latest value of each output."""
    outputs = [world.output(topic) for topic in world.ports.outputs] if outputs_wanted else []

    def run() -> None:
        for _ in range(STEPS):
            world.step()
            for output in outputs:
                _ = output.latest

    return run


def _run_of(drive: str, entry: dict[str, Any]) -> Row:
    """Compares a run of steps of a drive in mode `force` with one in mode `velocity`."""
    given = PARAMETERS[drive]
    with world_with(drive) as plain:
        PARAMETERS[drive] = {**given, "mode": "force", **entry}
        try:
            with world_with(drive) as forced:
                plain_time, forced_time = best_pair(
                    lambda: plain.step(STEPS), lambda: forced.step(STEPS), SECONDS
                )
        finally:
            PARAMETERS[drive] = given
    note = f"{forced_time / STEPS * 1e6:.2f} µs"
    name = f"step in the core with {drive}, mode force / velocity"
    return Row(name, forced_time / plain_time, "", 1.5, note=note)


def rows(unit: float) -> list[Row]:
    """Measures the step with each included plugin, with and without subscribers."""
    included = [name for name in PluginRegistry().classes if name.startswith(INCLUDED_PACKAGE)]
    found = []
    with world_with(None) as empty:
        physics, dt = empty.physics, empty.timekeeper.step_size

        def box2d_steps() -> None:
            for _ in range(STEPS):
                physics.step(dt, empty.velocity_iterations, empty.position_iterations)

        def row(name: str, action: Callable[[], None], note: str = "") -> None:
            box2d, whole = best_pair(box2d_steps, action, SECONDS)
            text = f"{whole / STEPS * 1e6:.1f} µs"
            found.append(
                Row(name, whole / box2d, "Box2D steps", note=f"{text}, {note}" if note else text)
            )

        box2d, _ = best_pair(box2d_steps, box2d_steps, SECONDS)
        microseconds = f"{box2d / STEPS * 1e6:.1f} µs"
        found.append(Row("Box2D step, one body", box2d / STEPS / unit, "U", note=microseconds))
        row("step without plugins", _stepper(empty, outputs_wanted=False))
        for name in (full.partition("::")[2] for full in included):
            for wanted in (False, True):
                which = "outputs wanted" if wanted else "outputs not wanted"
                with world_with(name, [TransformListener()] if wanted else []) as world:
                    row(f"step with {name}, {which}", _stepper(world, wanted), NOTES.get(name, ""))
    found.append(_run_of("DiffDrive", {"max_force": 50.0, "max_torque": 5.0}))
    return found
