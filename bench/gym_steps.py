"""Environments of flatland.gym: time of a step and memory of flatland/Navigate-v0.

`python bench/gym_steps.py FILE.png` draws the speed over the number of environments, beside
AsyncVectorEnv of Gymnasium.
"""

from __future__ import annotations

import functools
import itertools
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from curves import Curve, Panel, plot
from table import Row
from timing import Mean, best_of, mean_of, means_of

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
    for env, count, bar in (
        (NAME, 1, 0.05),
        (NAME, 64, 0.008),
        (NAME, 1024, 0.008),
        ("flatland/Maze-v0", 64, None),
    ):
        (step,) = _steps(flatland.gym.make_vec(env, count))
        found.append(_row(env, count, step, unit, bar))
    crowd = "flatland/Crowd-v0"
    empty, crowded = _steps(*[flatland.gym.make_vec(env, 16) for env in (NAME, crowd)])
    found += [_row(NAME, 16, empty, unit), _row(crowd, 16, crowded, unit)]
    ratio = crowded.seconds / empty.seconds
    found.append(Row(f"{crowd} against {NAME}, 16 environments", ratio, "times", 3.0))
    # Robots do not wait for others: their episodes end at goals only.
    (fleet,) = _steps(
        flatland.gym.make_vec("flatland/Fleet-v0", 16, num_robots=4, ending=Arrived())
    )
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


def _stepper(envs: Any) -> Callable[[], object]:
    """Returns a function that steps a vector with random actions."""
    envs.reset(seed=0)
    actions = _actions(envs.num_envs)
    # The first episodes begin at the same time.
    for action in actions[:100]:
        envs.step(action)
    rest = itertools.cycle(actions)
    return lambda: envs.step(next(rest))


def _steps(*vectors: Any) -> list[Mean]:
    """Returns the times of a step of one of many environments, with all resets [s].

    The vectors take turns, and are closed.
    """
    means = means_of([_stepper(envs) for envs in vectors], 4.0)
    for envs in vectors:
        envs.close()
    return [mean / envs.num_envs for envs, mean in zip(vectors, means, strict=True)]


def _row(env: str, count: int, step: Mean, unit: float, bar: float | None = None) -> Row:
    """Returns the row of the steps of some environments in a vector."""
    name = f"{env}, {count} environments in a vector, step of one of them"
    note = f"{step.rate}, on {os.cpu_count()} cores"
    return Row(name, step.seconds / unit, "U", bar, note=note)


def panel() -> Panel:
    """Measures the speed over the number of environments."""
    ours = [1 / _steps(flatland.gym.make_vec(NAME, n))[0].seconds for n in COUNTS]
    theirs = []
    for n in ASYNC_COUNTS:
        make = functools.partial(gymnasium.make, NAME)
        theirs.append(1 / _steps(gymnasium.vector.AsyncVectorEnv([make] * n))[0].seconds)
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
