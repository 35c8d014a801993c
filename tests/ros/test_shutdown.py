"""The end of the node: signals, `rosnode kill`, and the time limit of a shutdown."""

from __future__ import annotations

import re
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Empty

PLUGINS = """
import pathlib
import threading
import time

import flatland


class EndlessStart(flatland.WorldPlugin):
    def on_initialize(self, config):
        print("initializing", flush=True)
        threading.Event().wait()


class EndlessStep(flatland.WorldPlugin):
    def before_physics_step(self, timekeeper):
        print("stepping", flush=True)
        while True:
            pass


class EndlessEnd(flatland.WorldPlugin):
    def on_shutdown(self):
        self.wait()

    def wait(self):
        threading.Event().wait()


class EndlessThread(flatland.WorldPlugin):
    def on_initialize(self, config):
        threading.Thread(target=threading.Event().wait, name="worker").start()


class SlowEnd(flatland.WorldPlugin):
    def on_shutdown(self):
        with pathlib.Path(__file__).with_name("result.txt").open("w") as file:
            for number in range(10):
                file.write(f"line {number}\\n")
                file.flush()
                time.sleep(0.1)
            file.write("complete\\n")
"""
NAMES = ("EndlessStart", "EndlessStep", "EndlessEnd", "EndlessThread", "SlowEnd")
LAST_ACTIONS = 1.5  # s
MARGIN = 3.0  # s, for a busy machine
NOTHING = {"publishers": set(), "subscribers": set(), "services": set()}


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    return write_world("[{name: robot, model: robot.model.yaml}]")


@pytest.fixture
def world_with(launcher: Any, write_world: Callable[..., Path]) -> Callable[[str], Path]:
    """Writes a world with one of the plugins."""

    def write(plugin: str) -> Path:
        world = write_world(plugins=f"[{{name: slow, type: 'test::{plugin}'}}]")
        (world.parent / "test_plugins_of_shutdown.py").write_text(PLUGINS)
        classes = "".join(
            f'<class name="test::{name}" type="test_plugins_of_shutdown.{name}" '
            'base_class_type="flatland::WorldPlugin"/>'
            for name in NAMES
        )
        manifest = world.parent / "manifest.xml"
        manifest.write_text(f'<library path=".">{classes}</library>')
        launcher.environment = {**launcher.environment, "FLATLAND_PLUGIN_PATH": str(manifest)}
        return world

    return write


def fatal_lines(process: Any) -> list[str]:
    return [line for line in process.lines if "[FATAL]" in line]


def assert_ended_cleanly(process: Any, ros: Any) -> None:
    assert process.wait() == 0
    assert fatal_lines(process) == []
    assert "Traceback" not in process.output
    assert ros.registered() == NOTHING


def assert_was_ended(process: Any, ros: Any, running: str, timeout: str = "0.5") -> None:
    assert process.wait() == 1
    (line,) = fatal_lines(process)
    assert re.search(
        rf"not stopped within {timeout} s, exiting; still running: thread {running}", line
    ), line
    assert ros.registered() == NOTHING


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("state", ["running", "paused", "as fast as possible"])
def test_signal_ends_the_node(
    launcher: Any, ros: Any, world: Path, number: signal.Signals, state: str
) -> None:
    rate = 0 if state == "as fast as possible" else 200
    process = launcher.server(world, update_rate=rate)
    ros.topic("/clock", Clock).next()
    if state == "paused":
        ros.call("/pause", Empty)
    process.send(number)
    assert_ended_cleanly(process, ros)


def test_rosnode_kill_ends_the_node(launcher: Any, ros: Any, world: Path) -> None:
    process = launcher.server(world)
    launcher.program("rosnode", "kill", "/flatland_server").wait()
    assert_ended_cleanly(process, ros)


def test_plugin_may_take_a_second_to_write_a_file(
    launcher: Any, ros: Any, world_with: Callable[[str], Path]
) -> None:
    world = world_with("SlowEnd")
    process = launcher.server(world)
    process.send(signal.SIGINT)
    assert_ended_cleanly(process, ros)
    lines = (world.parent / "result.txt").read_text().splitlines()
    assert lines == [*(f"line {number}" for number in range(10)), "complete"]


def test_plugin_that_exceeds_the_time_limit_is_interrupted(
    launcher: Any, ros: Any, world_with: Callable[[str], Path]
) -> None:
    world = world_with("SlowEnd")
    process = launcher.server(world, shutdown_timeout=0.5)
    process.send(signal.SIGTERM)
    plugin = 'World Plugin "slow" type "test::SlowEnd": on_shutdown, '
    assert_was_ended(process, ros, rf"MainThread: {plugin}.*_plugins_of_shutdown.py:\d+ in on_sh")
    assert "complete" not in (world.parent / "result.txt").read_text()


@pytest.mark.parametrize(
    ("plugin", "ready", "running"),
    [
        (
            "EndlessStart",
            "initializing",
            r"on_initialize, \S+plugins_of_shutdown.py:\d+ in on_initialize > .* in wait$",
        ),
        ("EndlessStep", "stepping", r"before_physics_step, \S+:\d+ in before_physics_step$"),
        ("EndlessEnd", "loaded", r"on_shutdown, \S+:\d+ in on_shutdown > \S+:\d+ in wait > "),
    ],
    ids=["on_initialize", "before_physics_step", "on_shutdown"],
)
@pytest.mark.parametrize("request_stop", ["signal", "rosnode kill"])
def test_plugin_that_does_not_return_is_named(
    launcher: Any,
    ros: Any,
    world_with: Callable[[str], Path],
    plugin: str,
    ready: str,
    running: str,
    request_stop: str,
) -> None:
    process = launcher.start(world_path=world_with(plugin), shutdown_timeout=0.5)
    process.wait_for_line(ready)
    if request_stop == "signal":
        process.send(signal.SIGINT)
    else:
        launcher.program("rosnode", "kill", "/flatland_server").wait()
    name = f'World Plugin "slow" type "test::{plugin}"'
    assert_was_ended(process, ros, f"MainThread: {name}: {running}")


def test_thread_of_a_plugin_that_does_not_end_is_named(
    launcher: Any, ros: Any, world_with: Callable[[str], Path]
) -> None:
    process = launcher.server(world_with("EndlessThread"), shutdown_timeout=0.5)
    process.send(signal.SIGINT)
    assert_was_ended(process, ros, r"worker: .*threading.py:\d+ in wait$")


@pytest.fixture
def large_map(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A world with a small layer, followed by a layer of a million edges, or more."""
    for name, size in (("small", 10), ("large", getattr(request, "param", 1000))):
        pixels = np.random.default_rng(1).choice(np.uint8([0, 255]), (size, size))
        cv2.imwrite(str(tmp_path / f"{name}.png"), pixels)
        (tmp_path / f"{name}.yaml").write_text(
            f"{{image: {name}.png, resolution: 0.1, origin: [0, 0, 0], occupied_thresh: 0.65}}"
        )
    path = tmp_path / "world.yaml"
    layers = "[{name: small, map: small.yaml}, {name: large, map: large.yaml}]"
    path.write_text(f"{{properties: {{}}, layers: {layers}}}")
    return path


@pytest.mark.parametrize("large_map", [3000], indirect=True, ids=["9 million cells"])
def test_signal_while_a_large_map_loads(launcher: Any, ros: Any, large_map: Path) -> None:
    process = launcher.start(world_path=large_map, shutdown_timeout=0.05)
    process.wait_for_line('Layer "small"')
    start = time.monotonic()
    process.send(signal.SIGTERM)
    assert_was_ended(process, ros, r"MainThread: .*/world_loader.py:\d+ in ", timeout="0.05")
    # Besides the time limit, the node has half a second each for three last actions.
    assert time.monotonic() - start < LAST_ACTIONS + MARGIN


def test_map_that_loads_within_the_time_limit_ends_cleanly(
    launcher: Any, ros: Any, large_map: Path
) -> None:
    process = launcher.start(world_path=large_map, shutdown_timeout=600)
    process.wait_for_line('Layer "small"')
    process.send(signal.SIGTERM)
    assert_ended_cleanly(process, ros)


def test_stop_in_roslaunch_passes_the_time_limit(
    launcher: Any, world_with: Callable[[str], Path]
) -> None:
    process = launcher.launch(
        "flatland",
        "server.launch",
        f"world_path:={world_with('EndlessEnd')}",
        "show_viz:=false",
        "shutdown_timeout:=0.25",
    )
    process.wait_for_line("loaded")
    process.send(signal.SIGINT)
    process.wait_for_line(r"\[FATAL\].*not stopped within 0.25 s.*EndlessEnd")
    process.wait()
