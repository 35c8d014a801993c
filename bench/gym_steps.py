"""Environments of flatland.gym: time of a step and memory of flatland/Navigate-v0.

`python bench/gym_steps.py FILE.png` draws the speed over the number of environments, beside
AsyncVectorEnv of Gymnasium.
"""

from __future__ import annotations

import functools
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from curves import Curve, Panel, plot
from table import Row
from timing import Mean, best_of, mean_of

import flatland.gym
from flatland.gym import Arrived

NAME = "flatland/Navigate-v0"
COUNTS = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024)
ASYNC_COUNTS = (1, 2, 4, 8, 16, 32, 64)  # each is a process
MEMORY_ENVS = 256

# Prints the peak memory [MB].
MEMORY = f"""
import re
import numpy as np
import flatland.gym
envs = flatland.gym.make_vec("{NAME}", {MEMORY_ENVS})
envs.reset(seed=0)
for _ in range(20):
    envs.step(envs.action_space.sample())
print(int(re.search(r"VmHWM:\\s+(\\d+) kB", open("/proc/self/status").read())[1]) / 1024)
"""


def rows(unit: float) -> list[Row]:
    """Measures steps of one and of many environments with resets, and the memory of 256."""
    found = []
    seconds: dict[tuple[str, int], float] = {}
    for env, count, bar in (
        (NAME, 1, 0.05),
        (NAME, 16, None),
        (NAME, 64, 0.008),
        (NAME, 1024, 0.008),
        ("flatland/Maze-v0", 64, None),
        ("flatland/Crowd-v0", 16, None),
    ):
        step = _step(flatland.gym.make_vec(env, count))
        name = f"{env}, {count} environments in a vector, step of one of them"
        note = f"{step.rate}, on {os.cpu_count()} cores"
        found.append(Row(name, step.seconds / unit, "U", bar, note=note))
        seconds[env, count] = step.seconds
    ratio = seconds["flatland/Crowd-v0", 16] / seconds[NAME, 16]
    found.append(Row(f"flatland/Crowd-v0 against {NAME}, 16 environments", ratio, "times", 3.0))
    # Robots do not wait for others: their episodes end at goals only.
    fleet = _step(flatland.gym.make_vec("flatland/Fleet-v0", 16, num_robots=4, ending=Arrived()))
    name = "flatland/Fleet-v0, 16 worlds with 4 robots in a vector, step of one robot"
    note = f"{fleet.rate}, on {os.cpu_count()} cores"
    found.append(Row(name, fleet.seconds / unit, "U", note=note))
    single, reset = _single()
    memory = float(
        subprocess.run(
            [sys.executable, "-c", MEMORY], check=True, capture_output=True, text=True
        ).stdout
    )
    return [
        Row(f"{NAME}, FlatlandEnv, step", single.seconds / unit, "U", 0.05, note=single.rate),
        *found,
        Row(f"{NAME}, reset", reset / unit, "U", note=f"{reset * 1e6:.0f} µs"),
        Row(f"{NAME}, memory of {MEMORY_ENVS} environments", memory, "MB", 1000.0),
    ]


def _single() -> tuple[Mean, float]:
    """Returns the time of a step of one environment with its resets, and of a reset [s]."""
    env = flatland.gym.FlatlandEnv()
    env.reset(seed=0)
    actions = _actions(1)

    def steps() -> None:
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action[0])
            if terminated or truncated:
                env.reset()

    step = mean_of(steps, 4.0) / len(actions)
    reset = best_of(env.reset, 1.0)
    env.close()
    return step, reset


def _actions(n: int) -> Any:
    """Returns random actions, under which an episode lasts about 70 steps; shape (200, n, 2)."""
    return np.random.default_rng(0).uniform(-1, 1, (200, n, 2)).astype(np.float32)


def _step(envs: Any) -> Mean:
    """Returns the time of a step of one of many environments, with all resets [s]."""
    envs.reset(seed=0)
    actions = _actions(envs.num_envs)
    # The first episodes begin at the same time.
    for action in actions[:100]:
        envs.step(action)
    numbers = iter(range(10**9))
    mean = mean_of(lambda: envs.step(actions[next(numbers) % len(actions)]), 4.0)
    envs.close()
    return mean / envs.num_envs


def panel() -> Panel:
    """Measures the speed over the number of environments."""
    ours = [1 / _step(flatland.gym.make_vec(NAME, n)).seconds for n in COUNTS]
    theirs = []
    for n in ASYNC_COUNTS:
        make = functools.partial(gymnasium.make, NAME)
        theirs.append(1 / _step(gymnasium.vector.AsyncVectorEnv([make] * n)).seconds)
    curves = [
        Curve("flatland.gym.make_vec", list(map(float, COUNTS)), ours),
        Curve("AsyncVectorEnv", list(map(float, ASYNC_COUNTS)), theirs),
    ]
    return Panel(f"{NAME} on {os.cpu_count()} cores", "environments", "steps a second", curves)


if __name__ == "__main__":
    result = panel()
    for curve in result.curves:
        for x, y in zip(curve.x, curve.y, strict=True):
            print(f"{curve.label:24s} {x:6.0f} {y:10.0f} steps/s")
    plot([result], Path(sys.argv[1]))
