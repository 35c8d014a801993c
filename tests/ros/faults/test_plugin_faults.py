"""Plugins that block in a hook, whose threads end with an exception, and that crash."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import tcpros
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Empty
from tcpros import ServiceClient

from flatland.srv import DeleteModel

PLUGINS = """
import ctypes
import pathlib
import threading
import time

import flatland

FOLDER = pathlib.Path(__file__).parent


def fail():
    raise RuntimeError("cause of the function")


class Faulty(flatland.ModelPlugin):
    def before_physics_step(self, timekeeper):
        if (FOLDER / "block").exists():
            print("blocked", flush=True)
            self.wait()
        if (FOLDER / "crash").exists():
            ctypes.string_at(0)

    def after_physics_step(self, timekeeper):
        for name, target in (("method", self.fail), ("function", fail)):
            if (FOLDER / name).exists():
                (FOLDER / name).unlink()
                threading.Thread(target=target, name=f"worker of {name}").start()

    def wait(self):
        while (FOLDER / "block").exists():
            time.sleep(0.01)

    def fail(self):
        raise RuntimeError("cause of the method")
"""
PLUGIN = 'Model Plugin "bad" type "test::Faulty" model "robot"'
MODEL = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins: [{type: "test::Faulty", name: bad}]
"""


@pytest.fixture(scope="module")
def folder(module_launcher: Any, write_world: Callable[..., Path]) -> Path:
    """The folder of a world whose plugin has a fault when a file of that name appears."""
    world = write_world("[{name: robot, model: faulty.model.yaml}]", faulty=MODEL)
    module_launcher.add_plugins(world.parent, PLUGINS, "test_faulty_plugins")
    return world.parent


@pytest.fixture(scope="module")
def server(folder: Path, module_launcher: Any) -> Any:
    return module_launcher.server(folder / "world.yaml")


@pytest.fixture
def block(folder: Path) -> Iterator[Path]:
    """The path of a file that makes the plugin block while it exists."""
    path = folder / "block"
    yield path
    path.unlink(missing_ok=True)


def test_thread_that_ends_with_an_exception_is_attributed(server: Any, folder: Path) -> None:
    for name in ("method", "function"):
        (folder / name).touch()
        server.wait_for_line(
            rf'\[ERROR\].*thread "worker of {name}" of {PLUGIN} ended with an exception'
        )
        server.wait_for_line(f"RuntimeError: cause of the {name}")


def test_plugin_that_blocks_is_named_and_calls_are_refused(
    server: Any, ros: Any, block: Path
) -> None:
    clock = ros.topic("/clock", Clock)
    address = tcpros.service_address(ros.master, "/delete_model")
    early = ServiceClient(address, "/delete_model", DeleteModel, persistent=True)
    block.touch()
    server.wait_for_line("^blocked")
    early.send([("nobody",)])
    server.wait_for_line(
        rf"\[ERROR\].*{PLUGIN}: before_physics_step has not returned for 5 s, "
        "the simulation waits for it:"
    )
    server.wait_for_line(r'File ".*test_faulty_plugins.py", line \d+, in wait')
    refusal = f"the simulation is blocked: {PLUGIN}: before_physics_step does not return"
    assert refusal in early.receive().message
    late = ServiceClient(address, "/delete_model", DeleteModel, persistent=False)
    assert late.call("nobody").message == refusal
    with pytest.raises(RuntimeError, match="the simulation is blocked"):
        ServiceClient(
            tcpros.service_address(ros.master, "/pause"), "/pause", Empty, persistent=False
        ).call()
    block.unlink()
    server.wait_for_line(
        rf"\[WARN\].*{PLUGIN}: before_physics_step has returned after \d+ s, the simulation cont"
    )
    # The refused calls have no effect afterwards: the world is not paused.
    now = ros.step()
    clock.until(lambda message: message.clock.to_nsec() > now)
    assert 'model with name "nobody"' in late.call("nobody").message
    assert sum("has not returned" in line for line in server.lines) == 1


def test_crash_shows_the_plugin_and_its_hook(server: Any, folder: Path) -> None:
    try:
        (folder / "crash").touch()
        assert server.wait() in (-signal.SIGSEGV, 128 + signal.SIGSEGV)
    finally:
        (folder / "crash").unlink()
    server.wait_for_line("Fatal Python error: Segmentation fault")
    current = server.output.partition("Current thread")[2]
    hook = current.partition("test_faulty_plugins.py")[2].splitlines()[0]
    assert hook.endswith("in before_physics_step")
