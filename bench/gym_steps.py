"""Environments of flatland.gym: steps a second and memory of flatland/Navigate-v0.

`python bench/gym_steps.py FILE.png` draws the speed over the number of environments, beside
AsyncVectorEnv of Gymnasium.
"""

from __future__ import annotations

import functools
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from curves import Curve, Panel, plot
from table import Row
from timing import best_of

import flatland.gym

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
    """Measures environment steps of one and of 64 environments, and the memory of 256."""
    one, reset = _single()
    many = 64 / best_of(_stepper(flatland.gym.make_vec(NAME, 64)), 5.0)
    memory = float(
        subprocess.run(
            [sys.executable, "-c", MEMORY], check=True, capture_output=True, text=True
        ).stdout
    )
    cores = f"{os.cpu_count()} cores"
    return [
        Row(f"{NAME}, 1 environment", one, "steps/s", 8000.0, at_least=True),
        Row(f"{NAME}, 64 environments", many, "steps/s", 50_000.0, at_least=True, note=cores),
        Row(f"{NAME}, reset", reset / unit, "U", note=f"{reset * 1e6:.0f} µs"),
        Row(f"{NAME}, memory of {MEMORY_ENVS} environments", memory, "MB", 1000.0),
    ]


def _single() -> tuple[float, float]:
    """Returns steps a second of one environment with its resets, and the time of a reset [s]."""
    env = flatland.gym.FlatlandEnv()
    env.reset(seed=0)
    actions = _actions(1)

    def steps() -> None:
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action[0])
            if terminated or truncated:
                env.reset()

    speed = len(actions) / best_of(steps, 5.0)
    reset = best_of(env.reset, 1.0)
    env.close()
    return speed, reset


def _actions(n: int) -> Any:
    """Returns random actions, under which an episode lasts about 70 steps; shape (200, n, 2)."""
    return np.random.default_rng(0).uniform(-1, 1, (200, n, 2)).astype(np.float32)


def _stepper(envs: Any) -> Callable[[], None]:
    """Returns a function that steps environments once, with new actions in each call."""
    envs.reset(seed=0)
    actions = _actions(envs.num_envs)
    # The first episodes end at the same time.
    for action in actions[:100]:
        envs.step(action)
    numbers = iter(range(10**9))

    def step() -> None:
        envs.step(actions[next(numbers) % len(actions)])

    return step


def _speed(envs: Any, seconds: float = 3.0) -> float:
    """Returns environment steps a second, on average over some seconds, with all resets."""
    step = _stepper(envs)
    best = 0.0
    for _ in range(3):
        start, n = time.perf_counter(), 0
        while time.perf_counter() < start + seconds / 3:
            step()
            n += 1
        best = max(best, n * envs.num_envs / (time.perf_counter() - start))
    envs.close()
    return best


def panel() -> Panel:
    """Measures the speed over the number of environments."""
    ours = [_speed(flatland.gym.make_vec(NAME, n)) for n in COUNTS]
    theirs = []
    for n in ASYNC_COUNTS:
        make = functools.partial(gymnasium.make, NAME)
        theirs.append(_speed(gymnasium.vector.AsyncVectorEnv([make] * n)))
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
