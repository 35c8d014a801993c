"""Runs programs of the documentation with the installed package, in an environment without ROS.

Prints the state hash of the office after 5000 steps, which is the same for all builds. Requires
the extras `gym` and `draw`. Run it outside of a clone, whose package Python would import instead.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import sysconfig
import tempfile
import time
import urllib.request
from pathlib import Path

import gymnasium

import flatland
import flatland.gym  # registers the environments

WORLDS = Path(sysconfig.get_path("data")) / "share" / "flatland" / "worlds"
COMMAND = Path(sysconfig.get_path("scripts")) / "flatland"


def play_an_episode() -> None:
    """Plays an episode of the first documented environment with random actions."""
    env = gymnasium.make("flatland/Navigate-v0")
    env.reset(seed=1)
    ended = False
    while not ended:
        _, _, terminated, truncated, info = env.step(env.action_space.sample())
        ended = terminated or truncated
    env.close()
    assert {"distance", "is_success", "collision"} <= set(info), info


def run(*arguments: str | Path) -> str:
    """Runs the command `flatland` and returns its output."""
    done = subprocess.run([COMMAND, *arguments], stdout=subprocess.PIPE, text=True, check=True)
    return done.stdout


def make_a_world() -> None:
    """Generates a world in the working folder, checks it and draws it."""
    world = Path("office") / "world.yaml"
    run("new", "world", "office", "--office", "--seed", "1")
    run("check", world)
    run("show", world, "-o", "office.png")
    assert Path("office.png").stat().st_size > 0


def score_a_controller() -> None:
    """Runs an included scenario."""
    run("test", "narrow_doors", "--only", "*/straight_ahead*door=1.2*", "--robot", "gap")
    assert Path("flatland-test", "report.html").stat().st_size > 0


def view_a_world() -> None:
    """Starts the viewer and loads its page."""
    arguments = [COMMAND, "view", WORLDS / "office" / "world.yaml", "--port", "0", "--no-browser"]
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True) as viewer:
        assert viewer.stdout is not None
        try:
            lines = iter(viewer.stdout.readline, "")
            address = next(m[0] for m in (re.search(r"http://\S+", line) for line in lines) if m)
            with urllib.request.urlopen(address) as page:
                assert b"<canvas" in page.read()
        finally:
            viewer.terminate()


def hash_of_the_office() -> str:
    """Returns the state hash of the office with driving robots after 5000 steps."""
    with flatland.World.from_yaml(WORLDS / "office" / "world.yaml", seed=3) as world:
        world.command("/cmd_vel").set(flatland.Twist(linear_x=0.5, angular_z=0.2))
        for output in world.ports.outputs.values():
            output.subscribe(lambda value: None)
        world.step(5000)
        return world.state_hash()


def main() -> None:
    """Runs all programs."""
    if "--hash" not in sys.argv:
        start = time.monotonic()
        play_an_episode()
        print(f"episode: {time.monotonic() - start:.1f} s")
        assert run("--version").split()[-1] == flatland.__version__
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            make_a_world()
            score_a_controller()
            view_a_world()
            os.chdir("/")
    print(f"hash: {hash_of_the_office()}")


if __name__ == "__main__":
    main()
