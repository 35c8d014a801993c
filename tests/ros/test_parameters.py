"""The parameters of the node: defaults, accepted values and errors."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rosgraph_msgs.msg import Clock

from flatland.ros.parameters import (
    NodeParameters,
    ParameterError,
    WebParameters,
    read_parameters,
)


def read(**given: Any) -> NodeParameters:
    return read_parameters({"world_path": "world.yaml", **given}.get)


def test_defaults() -> None:
    assert read() == NodeParameters(
        world_path="world.yaml",
        update_rate=200.0,
        max_lag=0.1,
        step_size=0.005,
        lockstep=False,
        show_viz=False,
        viz_pub_rate=30.0,
        simplify_map=0,
        seed=None,
        benchmark_duration=None,
        plugin_timeout=60.0,
        shutdown_timeout=2.0,
        if_blocked="warn",
        move_keeps_odometry=False,
        initialpose_model="",
        record="",
        record_mcap="",
        use_sim_time=True,
        clock_rate=0.0,
        model_states_rate=50.0,
        publish_map="",
        map_frame="map",
        map_resolution=0.05,
        msgs_package="flatland",
        model_path=None,
        web=None,
    )


def test_the_parameters_of_the_browser_viewer() -> None:
    assert read(web="true").web == WebParameters("127.0.0.1", 8000, None, False)
    given = {"web_host": "0.0.0.0", "web_port": "0", "web_token": 7, "web_read_only": True}
    assert read(web=True, **given).web == WebParameters("0.0.0.0", 0, "7", True)
    assert read(web=True, web_host=" ", web_token=" ").web == read(web=True).web
    assert read(web=False, **given).web is None


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("update_rate", 0, 0.0),
        ("update_rate", math.inf, 0.0),
        ("update_rate", "inf", 0.0),  # roslaunch passes it as text
        ("update_rate", "1e3", 1000.0),
        ("update_rate", 0.5, 0.5),
        ("max_lag", 0, 0.0),
        ("max_lag", "0.5", 0.5),
        ("step_size", 1, 1.0),
        ("step_size", "1e-3", 0.001),
        ("step_size", "1e-6", 1e-6),
        ("step_size", 1000, 1000.0),
        ("show_viz", True, True),
        ("show_viz", "True", True),
        ("show_viz", "false", False),
        ("viz_pub_rate", 10, 10.0),
        ("simplify_map", 2, 2),
        ("simplify_map", "1", 1),
        ("seed", 0, 0),
        ("seed", "12345678901", 12345678901),  # too large for XML-RPC
        ("benchmark_duration", 2.5, 2.5),
        ("plugin_timeout", 2, 2.0),
        ("plugin_timeout", "0.5", 0.5),
        ("plugin_timeout", math.inf, None),
        ("plugin_timeout", "inf", None),
        ("shutdown_timeout", "0.5", 0.5),
        ("shutdown_timeout", math.inf, None),
        ("if_blocked", "allow", "allow"),
        ("if_blocked", "nearest", "nearest"),
        ("move_keeps_odometry", True, True),
        ("move_keeps_odometry", "true", True),
        ("initialpose_model", "robot", "robot"),
        ("initialpose_model", 7, "7"),
        ("initialpose_model", " ", ""),
        ("record", "/tmp/a.flog", "/tmp/a.flog"),
        ("record", " ", ""),
        ("record_mcap", "/tmp/a.mcap", "/tmp/a.mcap"),
        ("record_mcap", "~/a.mcap", str(Path("~/a.mcap").expanduser())),
        ("record", "a.flog", str(Path("a.flog").absolute())),
        ("use_sim_time", False, False),
        ("use_sim_time", "true", True),
        ("clock_rate", 100, 100.0),
        ("clock_rate", "inf", 0.0),
        ("publish_map", "walls", "walls"),
        ("publish_map", "", ""),
        ("publish_map", " ", ""),
        ("publish_map", 2, "2"),
        ("publish_map", False, None),
        ("map_frame", "r1/map", "r1/map"),
        ("map_frame", "/map", "map"),
        ("map_resolution", "0.1", 0.1),
        ("map_resolution", 1, 1.0),
        ("msgs_package", "flatland", "flatland"),
        ("msgs_package", "flatland_msgs", "flatland_msgs"),
        ("model_path", " ", None),
        ("model_path", "/usr:/tmp", ("/usr", "/tmp")),
        ("model_path", ["/usr", "/tmp"], ("/usr", "/tmp")),
    ],
)
def test_valid_values(name: str, value: object, expected: object) -> None:
    got = getattr(read(**{name: value}), name)
    assert got == expected
    assert type(got) is type(expected)


@pytest.mark.parametrize(
    "name",
    [
        "update_rate",
        "max_lag",
        "step_size",
        "viz_pub_rate",
        "benchmark_duration",
        "plugin_timeout",
        "shutdown_timeout",
        "clock_rate",
        "model_states_rate",
        "map_resolution",
    ],
)
@pytest.mark.parametrize("value", [math.nan, "nan", -1, -1e-300, "fast", "", True, [1], {"a": 1}])
def test_invalid_numbers(name: str, value: object) -> None:
    with pytest.raises(ParameterError) as error:
        read(**{name: value})
    assert str(error.value).startswith(f'Invalid parameter "~{name}": it must be ')
    assert f"got {float(value) if value in (-1, -1e-300) else value!r}" in str(error.value)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("max_lag", math.inf),
        ("max_lag", "inf"),
        ("step_size", 0),
        ("step_size", math.inf),
        ("step_size", 1e-10),
        ("step_size", 0.9e-6),
        ("step_size", 1001),
        ("step_size", 10**400),
        ("viz_pub_rate", 0),
        ("map_resolution", 0),
        ("map_resolution", math.inf),
        ("map_frame", ""),
        ("map_frame", "/"),
        ("map_frame", 1),
        ("publish_map", True),
        ("publish_map", 1.5),
        ("publish_map", ["walls"]),
        ("benchmark_duration", 0),
        ("plugin_timeout", 0),
        ("shutdown_timeout", 0),
        ("show_viz", 1),
        ("show_viz", "yes"),
        ("lockstep", 1),
        ("lockstep", "on"),
        ("simplify_map", 3),
        ("simplify_map", -1),
        ("simplify_map", 1.0),
        ("simplify_map", True),
        ("seed", -1),
        ("seed", 1.5),
        ("seed", "a"),
        ("seed", False),
        ("use_sim_time", "maybe"),
        ("if_blocked", "stop"),
        ("if_blocked", ""),
        ("if_blocked", True),
        ("if_blocked", ["warn"]),
        ("move_keeps_odometry", 1),
        ("initialpose_model", True),
        ("initialpose_model", ["robot"]),
        ("initialpose_model", 1.5),
        ("record", 1),
        ("record_mcap", ["a"]),
        ("msgs_package", "std_msgs"),
        ("msgs_package", ""),
        ("msgs_package", True),
        ("msgs_package", ["flatland"]),
        ("world_path", 5),
        ("world_path", ["a"]),
        ("model_path", "relative/path"),
        ("model_path", "/nowhere/at/all"),
        ("model_path", "/usr:"),
        ("model_path", "/etc/passwd"),
        ("model_path", []),
        ("model_path", [""]),
        ("model_path", ["/usr", 1]),
        ("model_path", True),
        ("model_path", {"a": "/usr"}),
        ("web", "yes"),
        ("web_host", True),
        ("web_port", -1),
        ("web_port", 65536),
        ("web_port", "http"),
        ("web_port", 80.5),
        ("web_token", ["a"]),
        ("web_read_only", 1),
    ],
)
def test_invalid_values(name: str, value: object) -> None:
    with pytest.raises(ParameterError, match=f'Invalid parameter "~{name}": it must be '):
        read(**{name: value})


def test_empty_seed_is_no_seed() -> None:
    assert read(seed="").seed is None


@pytest.mark.parametrize("path", [None, ""])
def test_world_path_is_required(path: str | None) -> None:
    with pytest.raises(ParameterError, match=r"^No world_path parameter given!$"):
        read(world_path=path)


# -- plugin_timeout in the real node ----------------------------------------------------------

STUCK = """
import threading
import flatland

class Stuck(flatland.ModelPlugin):
    def on_initialize(self, config):
        self.output("early", bool)
        threading.Event().wait()
"""
STUCK_MANIFEST = """
<library path=".">
  <class name="stuck::Stuck" type="stuck_plugin.Stuck" base_class_type="flatland::ModelPlugin"/>
</library>
"""
STUCK_MODEL = """
bodies: [{name: base, footprints: []}]
plugins: [{name: plug, type: "stuck::Stuck"}]
"""
TIMED_OUT = (
    'Flatland plugin: Model Plugin "plug" type "stuck::Stuck" model "stuck": '
    "on_initialize did not return within 0.25 s"
)


@pytest.fixture
def stuck_world(write_world: Callable[..., Path], launcher: Any) -> Callable[[str], Path]:
    """Writes a world beside a model whose plugin does not start."""

    def write(models: str) -> Path:
        world = write_world(models, stuck=STUCK_MODEL)
        (world.parent / "stuck_plugin.py").write_text(STUCK)
        manifest = world.parent / "manifest.xml"
        manifest.write_text(STUCK_MANIFEST)
        launcher.environment = {**launcher.environment, "FLATLAND_PLUGIN_PATH": str(manifest)}
        return world

    return write


@pytest.mark.parametrize("file", ["server.launch", "benchmark.launch"])
def test_world_with_a_plugin_that_never_starts_fails_to_load(
    launcher: Any, stuck_world: Callable[[str], Path], file: str
) -> None:
    world = stuck_world("[{name: stuck, model: stuck.model.yaml}]")
    arguments = [f"world_path:={world}", "plugin_timeout:=0.25"]
    if file == "server.launch":
        arguments.append("show_viz:=false")
    process = launcher.launch("flatland", file, *arguments)
    line = process.wait_for_line(r"\[FATAL\]").string
    assert re.search(re.escape(TIMED_OUT) + r" \[.*stuck\.model\.yaml:\d+\]$", line)
    process.wait_for_line("process has died .*exit code 1")
    process.wait()


def test_model_with_a_plugin_that_never_starts_fails_to_spawn(
    launcher: Any, ros: Any, stuck_world: Callable[[str], Path]
) -> None:
    world = stuck_world("[{name: robot, model: robot.model.yaml}]")
    process = launcher.server(world, plugin_timeout=0.25)
    before = ros.registered()
    answer = ros.spawn("stuck.model.yaml", "stuck")
    assert answer.success is False
    assert answer.message.startswith(TIMED_OUT)
    assert ros.registered() == before
    # The simulation and its services continue.
    clock = ros.topic("/clock", Clock)
    now = clock.next().clock
    clock.until(lambda message: message.clock > now)
    assert ros.spawn("ball.model.yaml", "stuck").success
    assert process.running


# -- max_lag in the real node -----------------------------------------------------------------

SLOW = """
import time
import flatland

class Slow(flatland.ModelPlugin):
    def before_physics_step(self, timekeeper):
        time.sleep(0.03)
"""
SLOW_MANIFEST = """
<library path=".">
  <class name="slow::Slow" type="slow_plugin.Slow" base_class_type="flatland::ModelPlugin"/>
</library>
"""
SLOW_MODEL = """
bodies: [{name: base, footprints: []}]
plugins: [{name: plug, type: "slow::Slow"}]
"""


@pytest.fixture
def slow_world(write_world: Callable[..., Path], launcher: Any) -> Path:
    """A world whose steps take three cycles at 100 Hz."""
    world = write_world("[{name: slow, model: slow.model.yaml}]", slow=SLOW_MODEL)
    (world.parent / "slow_plugin.py").write_text(SLOW)
    manifest = world.parent / "manifest.xml"
    manifest.write_text(SLOW_MANIFEST)
    launcher.environment = {**launcher.environment, "FLATLAND_PLUGIN_PATH": str(manifest)}
    return world


def test_missed_rate_is_reported_with_the_most_expensive_plugin(
    launcher: Any, slow_world: Path
) -> None:
    process = launcher.launch(
        "flatland",
        "server.launch",
        f"world_path:={slow_world}",
        "show_viz:=false",
        "update_rate:=100",
        "max_lag:=0",
    )
    line = process.wait_for_line(r"\[WARN\] .* the update rate of 100 Hz cannot be held").string
    assert 'percent of the wall time: Model Plugin "plug" type "slow::Slow" model "slow" ' in line


def test_lag_within_max_lag_is_not_reported(
    launcher: Any, ros: Any, slow_world: Path, eventually: Callable[..., Any]
) -> None:
    process = launcher.server(slow_world, update_rate=100, max_lag=1000)
    ros.log_everything()
    # With the default value, the warning is logged with the third report.
    eventually("six reports", lambda: process.output.count("cycle use min") >= 6)
    assert "cannot be held" not in process.output


def test_invalid_max_lag_ends_the_node(launcher: Any, write_world: Callable[..., Path]) -> None:
    process = launcher.start(world_path=write_world(), max_lag=-0.1)
    line = process.wait_for_line(r"\[FATAL\]").string
    assert line.endswith(
        'Invalid parameter "~max_lag": it must be a finite number of seconds that is not '
        "negative, got -0.1"
    )
    assert process.wait() == 1
