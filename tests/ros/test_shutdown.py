"""The end of the node: signals, `rosnode kill`, and the time limit of a shutdown."""

from __future__ import annotations

import contextlib
import re
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

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
NOTHING = {"publishers": set(), "subscribers": set(), "services": set()}


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    return write_world("[{name: robot, model: robot.model.yaml}]")


@pytest.fixture
def world_with(launcher: Any, write_world: Callable[..., Path]) -> Callable[[str], Path]:
    """Writes a world with one of the plugins."""

    def write(plugin: str) -> Path:
        world = write_world(plugins=f"[{{name: slow, type: 'test::{plugin}'}}]")
        launcher.add_plugins(world.parent, PLUGINS, "test_plugins_of_shutdown")
        return world

    return write


def fatal_lines(process: Any) -> list[str]:
    return [line for line in process.lines if "[FATAL]" in line]


def kill_node(ros: Any) -> None:
    """Requests the end of the node as `rosnode kill` does."""
    node = ServerProxy(ros.master.lookupNode("/flatland_server"))
    with contextlib.suppress(OSError):  # The node may end before it responds.
        node.shutdown("/flatland_tests", "killed by a test")


def assert_ended_cleanly(process: Any, ros: Any) -> None:
    assert process.wait() == 0
    assert fatal_lines(process) == []
    assert "Traceback" not in process.output
    assert ros.registered_now() == NOTHING


def assert_was_ended(process: Any, ros: Any, running: str, timeout: str = "0.5") -> None:
    assert process.wait() == 1
    (line,) = fatal_lines(process)
    assert re.search(
        rf"not stopped within {timeout} s, exiting; still running: thread {running}", line
    ), line
    assert ros.registered_now() == NOTHING


def test_rosnode_kill_ends_a_paused_node(launcher: Any, ros: Any, world: Path) -> None:
    process = launcher.server(world)
    ros.call("/pause", Empty)
    kill_node(ros)
    assert_ended_cleanly(process, ros)


def test_plugin_may_take_a_second_to_write_a_file(
    launcher: Any, ros: Any, world_with: Callable[[str], Path]
) -> None:
    """At full speed."""
    world = world_with("SlowEnd")
    process = launcher.server(world, update_rate=0)
    ros.topic("/clock", Clock).next()
    process.send(signal.SIGTERM)
    assert_ended_cleanly(process, ros)
    lines = (world.parent / "result.txt").read_text().splitlines()
    assert lines == [*(f"line {number}" for number in range(10)), "complete"]


def test_start_of_a_plugin_that_does_not_return_is_named(
    launcher: Any, ros: Any, world_with: Callable[[str], Path]
) -> None:
    process = launcher.start(world_path=world_with("EndlessStart"), shutdown_timeout=0.5)
    process.wait_for_line("initializing")
    process.send(signal.SIGINT)
    assert_was_ended(
        process,
        ros,
        'MainThread: World Plugin "slow" type "test::EndlessStart": on_initialize, '
        r"\S+plugins_of_shutdown.py:\d+ in on_initialize > .* in wait$",
    )


def test_thread_of_a_plugin_that_does_not_end_is_named(
    launcher: Any, ros: Any, world_with: Callable[[str], Path]
) -> None:
    # Even a busy machine has ended the main thread by then.
    process = launcher.server(world_with("EndlessThread"), shutdown_timeout=4.0)
    process.send(signal.SIGINT)
    assert_was_ended(process, ros, r"worker: .*threading.py:\d+ in wait$", timeout="4")


def test_signal_while_a_large_map_loads(launcher: Any, ros: Any, tmp_path: Path) -> None:
    """A small layer is followed by a layer of noise, with a million edges."""
    for name, pixels in (("small", 10), ("large", 2000)):
        image = np.random.default_rng(1).choice(np.uint8([0, 255]), (pixels, pixels))
        cv2.imwrite(str(tmp_path / f"{name}.png"), image)
        (tmp_path / f"{name}.yaml").write_text(
            f"{{image: {name}.png, resolution: 0.1, origin: [0, 0, 0], occupied_thresh: 0.65}}"
        )
    path = tmp_path / "world.yaml"
    layers = "[{name: small, map: small.yaml}, {name: large, map: large.yaml}]"
    path.write_text(f"{{properties: {{}}, layers: {layers}}}")
    process = launcher.start(world_path=path, shutdown_timeout=0.01)
    process.wait_for_line('Layer "small"')
    process.send(signal.SIGTERM)
    assert_was_ended(process, ros, r"MainThread: .*/flatland/\w+/\w+\.py:\d+ in ", timeout="0.01")
    assert ': loaded "' not in process.output


def test_stop_in_roslaunch_passes_the_time_limit(
    launcher: Any, world_with: Callable[[str], Path]
) -> None:
    process = launcher.launch(
        "flatland",
        "server.launch",
        f"world_path:={world_with('EndlessStep')}",
        "show_viz:=false",
        "shutdown_timeout:=0.25",
    )
    process.wait_for_line("stepping")
    process.send(signal.SIGINT)
    process.wait_for_line(
        r'\[FATAL\].*not stopped within 0.25 s.*EndlessStep": before_physics_step, '
    )
    process.wait()
