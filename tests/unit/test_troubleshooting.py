"""Checks that the messages in docs/troubleshooting.md are those of the program.

Each section of the page with a message has an entry in one of two tables: `PROVOKED` causes the
message, `WRITTEN_IN` names the source file that contains it, for messages that need a ROS master, a
display, or a slow machine. In a message, `...` stands for any text.
"""

from __future__ import annotations

import ast
import logging
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from pages import code_blocks, pattern_of
from PIL import Image
from plugin_manifests import manifest
from programs import run_program

import flatland
from flatland.node.parameters import ParameterError, read_parameters
from flatland.ros_addresses import master_address

WORLD = "properties: {}\nlayers: []\nmodels: [{name: r1, model: robot.yaml}]\n"
BODY = "bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]\n"
DRIVE = "{name: drive, type: DiffDrive, body: base}"
MAP = "type: line_segments\ndata: walls.dat\nscale: 1\norigin: [0, 0, 0]\n"


class FailingPlugin(flatland.ModelPlugin):
    """Raises in each step, or steps the world."""

    calls_step = False

    def on_initialize(self, config):
        self.calls_step = config.get("calls_step", "bool", False)

    def after_physics_step(self, timekeeper):
        if self.calls_step:
            self.world.step()
        raise RuntimeError("as intended")


class Case:
    """Writes files, loads a world and returns what is raised and logged."""

    def __init__(self, folder: Path, caplog: pytest.LogCaptureFixture) -> None:
        self.folder = folder
        self._caplog = caplog

    def load(
        self,
        world: str = WORLD,
        robot: str = BODY,
        then: Callable[[flatland.World], object] | None = None,
        **options: object,
    ) -> str:
        """Returns the error text, or the log if nothing is raised."""
        (self.folder / "world.yaml").write_text(world)
        if robot:
            (self.folder / "robot.yaml").write_text(robot)
        try:
            with flatland.World.from_yaml(self.folder / "world.yaml", seed=1, **options) as loaded:
                if then is not None:
                    then(loaded)
        except flatland.FlatlandError as error:
            return str(error)
        return "\n".join(record.getMessage() for record in self._caplog.records)

    def write(self, **files: str) -> None:
        """Writes files; `map_yaml` is `map.yaml`."""
        for name, text in files.items():
            (self.folder / name.replace("_", ".")).write_text(text)


def not_set_up(case: Case) -> str:
    checkout = Path(__file__).resolve().parents[2]
    shutil.copy(checkout / "setup.bash", case.folder)
    command = ["bash", "-c", f". {case.folder}/setup.bash"]
    return run_program(command).stderr


def invalid_parameter(case: Case) -> str:
    given = {"world_path": "world.yaml", "update_rate": "fast"}
    with pytest.raises(ParameterError) as raised:
        read_parameters(given.get)
    return str(raised.value)


def missing_image(case: Case) -> str:
    case.write(map_yaml="image: map.png\nresolution: 1\norigin: [0, 0, 0]\noccupied_thresh: 0.6\n")
    return case.load("properties: {}\nlayers: [{name: walls, map: map.yaml}]\n")


def white_image(case: Case) -> str:
    Image.new("L", (9, 9), 255).save(case.folder / "map.png")
    return missing_image(case)


def invalid_master(_case: Case) -> str:
    with pytest.raises(ValueError, match="no port") as caught:
        master_address("http://localhost")
    return str(caught.value)


def stuck(case: Case) -> str:
    """The robot is driven into a corridor that is narrower than itself."""
    case.write(map_yaml=MAP, walls_dat="0 0.19 9 0.19\n0 -0.19 9 -0.19\n")

    def drive(world: flatland.World) -> None:
        world.command("/cmd_vel").set(flatland.Twist(linear_x=1.0))
        world.step(200)

    world = WORLD.replace("[]", "[{name: walls, map: map.yaml}]", 1)
    return case.load(
        world.replace("robot.yaml", "robot.yaml, pose: [3, 0, 0]"),
        BODY + f"plugins: [{DRIVE}]",
        drive,
    )


def in_a_wall(case: Case) -> str:
    case.write(map_yaml=MAP, walls_dat="0.1 -5 0.1 5\n")
    return case.load(WORLD.replace("[]", "[{name: walls, map: map.yaml}]", 1))


def use_deleted_body(world: flatland.World) -> None:
    body = world.model("r1").body("base")
    world.delete_model("r1")
    _ = body.pose


def step_closed(world: flatland.World) -> None:
    world.close()
    world.step()


def with_plugin(case: Case, parameters: str, **options: object) -> str:
    declared = manifest({f"{__name__}.FailingPlugin": "Model"})
    (case.folder / "plugins.xml").write_text(declared)
    robot = f'{BODY}plugins: [{{name: p, type: "test::FailingPlugin", {parameters}}}]'
    return case.load(robot=robot, then=lambda world: world.step(5), **options)


LAYERS = ", ".join(f"{{name: l{number}}}" for number in range(17))
LAYER_2D = BODY.replace("density: 1", "density: 1, layers: [2d]")
NAN = flatland.Twist(linear_x=float("nan"))
TF = "{name: tf, type: ModelTfPublisher, publish_tf_world: true}"

PROVOKED: dict[str, Callable[[Case], str]] = {
    "`setup.bash` fails": not_set_up,
    "The node ends immediately: a parameter is invalid": invalid_parameter,
    "The address of the ROS master is invalid": invalid_master,
    "A key is not recognized": lambda case: case.load(
        robot=BODY + "plugins: [{name: drive, type: DiffDrive, body: base, pub_rat: 5}]"
    ),
    "A key is missing": lambda case: case.load("properties: {}\n"),
    "A value has the wrong type": lambda case: case.load(
        robot=BODY + "plugins: [{name: drive, type: DiffDrive, body: base, pub_rate: fast}]"
    ),
    "The file is not valid YAML": lambda case: case.load("properties: {}\nlayers: [\nmodels: []\n"),
    "A model file does not exist": lambda case: case.load(robot=""),
    "A map image cannot be loaded": missing_image,
    "The world is empty, or the robot is outside of it": white_image,
    "A name is used twice": lambda case: case.load(
        WORLD.replace("robot.yaml}]", "robot.yaml}, {name: r1, model: robot.yaml}]")
    ),
    "A layer does not exist": lambda case: case.load(robot=LAYER_2D),
    "There are too many layers": lambda case: case.load(f"properties: {{}}\nlayers: [{LAYERS}]\n"),
    "A value has no effect": lambda case: case.load(
        robot=BODY + "plugins: [{name: d, type: DiffDrive, body: base, pub_rate: 5, pub_rate: 6}]"
    ),
    "The robot does not follow a command": lambda case: case.load(
        robot=BODY + f"plugins: [{DRIVE}]", then=lambda world: world.command("/cmd_vel").set(NAN)
    ),
    "The robot is stuck": stuck,
    "The robot starts in a wall": in_a_wall,
    "The robot jumps in RViz between two places": lambda case: case.load(
        robot=BODY + f"plugins: [{DRIVE}, {TF}]", then=lambda world: world.step()
    ),
    "A model cannot be spawned: its namespace is not legal": lambda case: case.load(
        then=lambda world: world.spawn_model("robot.yaml", "r2", "my robot")
    ),
    "A model does not exist": lambda case: case.load(then=lambda world: world.delete_model("r9")),
    "An output does not exist": lambda case: case.load(then=lambda world: world.output("/scan")),
    "A handle is no longer valid": lambda case: case.load(then=use_deleted_body),
    "The world is closed": lambda case: case.load(then=step_closed),
    "`step` fails in a plugin": lambda case: with_plugin(case, "calls_step: true"),
    "A plugin is not found": lambda case: case.load(
        robot=BODY + "plugins: [{name: front, type: Lasser, body: base}]"
    ),
    "A plugin does not find its body": lambda case: case.load(
        robot=BODY + "plugins: [{name: drive, type: DiffDrive, body: bas}]"
    ),
    "A plugin stops working": lambda case: with_plugin(
        case, "calls_step: false", plugin_errors="disable"
    ),
}
WRITTEN_IN = {
    "Debian packages are missing": "tools/apt_packages.sh",
    "A package is installed, but cannot be imported": "flatland/requirements.py",
    "`make run WORLD=…` does not find the world": "tools/run.sh",
    "The node ends immediately: no world": "flatland/node/parameters.py",
    "The node does not start": "flatland/ros/node.py",
    "Other nodes receive nothing from the simulator": "flatland/ros/transport/network_check.py",
    "No log file is written": "flatland/ros/logs.py",
    "The time of other nodes jumps": "flatland/node/clock.py",
    "Other nodes show wall time, or discard transforms as too old": "flatland/ros/node.py",
    "A plugin takes too long to start": "flatland/runtime/plugin_host.py",
    "A topic of a plugin does not exist in ROS": "flatland/node/bridge.py",
    "The simulation is slower than real time": "flatland/simulation/rate_monitor.py",
    "The node does not end": "flatland/node/shutdown.py",
    "RViz displays no scan": "flatland/node/frame_monitor.py",
    "The viewer does not open": "flatland/viewer/app.py",
    "The viewer in the browser does not start": "flatland/node/browser_viewer.py",
    "The viewer does not find a master": "flatland/viewer/app.py",
}


def messages(checkout: Path) -> dict[str, str]:
    """Returns the message of each section that has one, by heading."""
    page = (checkout / "docs" / "troubleshooting.md").read_text()
    found = {}
    for section in re.split(r"^### ", page, flags=re.MULTILINE)[1:]:
        blocks = code_blocks(section, "text")
        assert len(blocks) <= 1, section
        if blocks:
            found[section.split("\n", 1)[0]] = blocks[0].strip()
    return found


def texts(path: Path) -> list[str]:
    """Returns the texts of a source file, with `...` for the parts that are inserted."""
    source = path.read_text()
    if path.suffix != ".py":
        return [re.sub(r"\$\{?\w+(\[\*\])?\}?", "...", source)]
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.JoinedStr):
            parts = [
                part.value if isinstance(part, ast.Constant) else "..." for part in node.values
            ]
            found.append("".join(map(str, parts)))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            inserted = re.sub(r"%(\.\d+)?[sdgf]", "...", node.value)
            found.append(inserted.replace("%%", "%"))
    return found


def test_each_message_is_checked(checkout):
    tables = [*PROVOKED, *WRITTEN_IN]
    assert sorted(messages(checkout)) == sorted(tables)


@pytest.mark.parametrize("section", PROVOKED)
def test_a_message_is_printed(section, checkout, tmp_path, caplog, monkeypatch):
    monkeypatch.setenv("FLATLAND_PLUGIN_PATH", str(tmp_path / "plugins.xml"))
    caplog.set_level(logging.WARNING, logger="flatland")
    message = messages(checkout)[section]
    printed = PROVOKED[section](Case(tmp_path, caplog))
    assert re.search(f"^{pattern_of(message)}", printed, re.MULTILINE), (
        f"page:\n{message}\n\n{printed}"
    )


@pytest.mark.parametrize("section", WRITTEN_IN)
def test_a_message_is_in_the_source(section, checkout):
    message = messages(checkout)[section]
    written = texts(checkout / WRITTEN_IN[section])
    assert any(message in text for text in written), message
