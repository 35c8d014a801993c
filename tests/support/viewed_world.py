"""Worlds that browsers look at: in this process, and in a program `flatland view`."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final, TypeVar

import pytest
from waiting import TIMEOUT

from flatland import World
from flatland.simulation import Simulation
from flatland.web import WebViewer

R = TypeVar("R")

_SILENCE: Final = 30.0  # s after which a program that prints nothing is ended

# Hues that the page itself does not use.
ROBOT_COLOR: Final = (255, 0, 255)
CRATE_COLOR: Final = (0, 255, 255)
WALL_COLOR: Final = (255, 255, 0)

ROBOT: Final = """
bodies:
  - {name: base, color: [1, 0, 1, 1], footprints: [{type: circle, radius: 0.4, density: 1}]}
plugins:
  - {type: DiffDrive, name: drive, body: base, pub_rate: 50, odom_frame_id: map}
  - {type: Laser, name: laser, body: base, range: 6, update_rate: 4,
     angle: {min: -3.1, max: 3.1, increment: 0.02}}
"""
CRATE: Final = """
bodies:
  - name: box
    color: [0, 1, 1, 1]
    footprints:
      - {type: polygon, density: 1, points: [[-0.8, -0.3], [0.8, -0.3], [0.8, 0.3], [-0.8, 0.3]]}
"""
_WORLD: Final = """
properties: {}
layers: [{name: walls, map: map.yaml, color: [1, 1, 0, 1]}]
models:
  - {name: robot, model: robot.model.yaml, pose: [-2, 1, 0]}
  - {name: crate, model: crate.model.yaml, pose: [2, -2, 0]}
"""


def write_room(folder: Path) -> Path:
    """Writes a world: a room of 10 m by 10 m around (0, 0) with a robot and a crate."""
    files = {
        "map.yaml": "type: line_segments\ndata: walls.dat\nscale: 1.0\norigin: [0, 0, 0]\n",
        "walls.dat": "-5 -5 5 -5\n5 -5 5 5\n5 5 -5 5\n-5 5 -5 -5\n",
        "robot.model.yaml": ROBOT,
        "crate.model.yaml": CRATE,
        "world.yaml": _WORLD,
    }
    for name, text in files.items():
        (folder / name).write_text(text)
    return folder / "world.yaml"


class ViewedWorld:
    """A world that a thread runs, and that a `WebViewer` shows.

    Attributes:
        world: The world.
        simulation: The simulation that runs it.
        handle: The handle of the world at the viewer.
    """

    def __init__(self, viewer: WebViewer, path: Path, *, name: str = "", rate: float = 200) -> None:
        """Loads a world, adds it to a viewer and starts to run it."""
        self.viewer = viewer
        self.world = World.from_yaml(path, seed=1)
        self.simulation = Simulation(self.world, rate)
        self.handle = viewer.add_world(self.world, name=name, simulation=self.simulation)
        self._thread = threading.Thread(target=self.simulation.run, name=f"world {name}")
        self._thread.start()

    def close(self) -> None:
        """Ends the simulation and closes the world."""
        self.viewer.remove_world(self.handle)
        self.simulation.stop()
        self._thread.join(TIMEOUT)
        self.world.close()

    def ask(self, action: Callable[[], R]) -> R:
        """Runs a function between two steps, and returns its result."""
        return self.world.post(action).result(TIMEOUT)

    def pose(self, name: str) -> tuple[float, float, float]:
        """Returns the pose of a model: x, y [m], heading [rad]."""
        return self.ask(lambda: tuple(float(v) for v in self.world.model(name).pose))

    def names(self) -> list[str]:
        """Returns the names of all models."""
        return self.ask(lambda: [model.name for model in self.world.models])

    def time(self) -> float:
        """Returns the simulated time [s]."""
        return self.ask(lambda: self.world.time)

    def scans_wanted(self) -> bool:
        """Returns whether anything receives the scans of the robot."""
        # Unlike `World.output`, the registry does not make the output wanted.
        return self.ask(lambda: self.world.ports.find_output("/scan").wanted)

    def reset(self) -> None:
        """Returns to the state after loading, not paused."""

        def reset() -> None:
            self.world.reset()
            self.world.resume()
            self.simulation.set_rate(200)

        self.ask(reset)


@contextlib.contextmanager
def viewed_room(folder: Path, **options: Any) -> Iterator[ViewedWorld]:
    """Shows a room for the duration of the block; the arguments are those of `WebViewer`."""
    with WebViewer(port=0, **options) as viewer:
        room = ViewedWorld(viewer, write_room(folder))
        try:
            yield room
        finally:
            room.close()


class ViewProgram:
    """A running `flatland view`.

    Attributes:
        url: The printed address.
        process: The process.
    """

    def __init__(self, *arguments: str | Path) -> None:
        """Starts the program and waits for the address."""
        command = [sys.executable, "-m", "flatland", "view", *map(str, arguments), "--no-browser"]
        environment = {**os.environ, "PYTHONUNBUFFERED": "1", "PYTHONFAULTHANDLER": "1"}
        self.process = subprocess.Popen(
            command,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        assert self.process.stdout is not None
        lines = []
        # The signal ends the program with the stacks of its threads.
        timer = threading.Timer(_SILENCE, self.process.send_signal, [signal.SIGABRT])
        timer.start()
        for line in self.process.stdout:
            lines.append(line)
            if found := re.search(r"http://[^\s]+", line):
                self.url = found.group()
                break
        else:
            pytest.fail(f"flatland view printed no address:\n{''.join(lines)}")
        timer.cancel()

    def kill(self) -> None:
        """Kills the program, which cannot close its connections in an orderly way."""
        self._end(signal.SIGKILL)

    def stop(self) -> int:
        """Interrupts the program as Ctrl-C does, and returns its exit code."""
        self._end(signal.SIGINT)
        return self.process.returncode

    def _end(self, number: signal.Signals) -> None:
        if self.process.poll() is None:
            self.process.send_signal(number)
        try:
            self.process.communicate(timeout=_SILENCE)
        except subprocess.TimeoutExpired:
            self.process.send_signal(signal.SIGABRT)
            output, _ = self.process.communicate()
            pytest.fail(f"flatland view did not end:\n{output}")
