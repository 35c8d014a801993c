#!/usr/bin/env python3
"""Trains a robot to drive to goals in the office, with PPO of stable-baselines3.

Requires `pip install "flatland-sim[learning]"`. Writes the policy, the learning curve as CSV and as
a picture, and prints the success rate in new episodes.
"""

from __future__ import annotations

import argparse
import csv
import os
import time
from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
import torch
from navigation import EVALUATION_SEED, actions_of, make_many
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback

from flatland.gym import evaluate
from flatland.gym.stable_baselines import StableVector

WINDOW = 1000  # episodes in a point of the curve


class Progress(BaseCallback):
    """Prints and collects the learning curve, and ends the training after a time.

    Attributes:
        rows: For each update of the policy: minutes, steps, success rate, collision rate, mean
            return and mean length of the last episodes.
    """

    def __init__(self, minutes: float) -> None:
        """Creates the callback.

        Args:
            minutes: Wall time of the training.
        """
        super().__init__()
        self.rows: list[tuple[float, int, float, float, float, float]] = []
        self._limit = 60.0 * minutes
        self._start = 0.0
        self._printed = 0.0
        self._episodes: deque[tuple[bool, bool, float, int]] = deque(maxlen=WINDOW)

    def _on_training_start(self) -> None:
        self._start = time.monotonic()

    def _on_step(self) -> bool:
        for info in self.locals["infos"]:
            if "episode" in info:
                episode = info["episode"]
                self._episodes.append(
                    (info["is_success"], info["collision"], episode["r"], episode["l"])
                )
        left = self._limit - (time.monotonic() - self._start)
        # The learning rate decreases with the time, not with the number of steps.
        self.model._current_progress_remaining = max(left / self._limit, 0.0)
        return left > 0

    def _on_rollout_end(self) -> None:
        if not self._episodes:
            return
        minutes = (time.monotonic() - self._start) / 60
        success, collision, total, length = np.mean(list(self._episodes), axis=0)
        self.rows.append((minutes, self.num_timesteps, success, collision, total, length))
        if minutes - self._printed >= 0.5:
            self._printed = minutes
            print(
                f"{minutes:5.1f} min {self.num_timesteps:9d} steps: success {success:.1%}, "
                f"collisions {collision:.1%}, return {total:.2f}, {length:.0f} steps",
                flush=True,
            )


class PPOByTime(PPO):
    """PPO whose schedules follow the time that is left, as set by `Progress`."""

    def _update_current_progress_remaining(self, num_timesteps: int, total_timesteps: int) -> None:
        """Keeps what the callback has set."""


def train(minutes: float, num_envs: int, seed: int) -> tuple[PPO, Progress]:
    """Trains a policy.

    Args:
        minutes: Wall time of the training.
        num_envs: Number of environments.
        seed: Seed of the environments and the policy.

    Returns:
        The model, and the learning curve.
    """
    torch.set_num_threads(1)  # The network is small: more threads wait for each other.
    envs = StableVector(make_many(num_envs))
    model = PPOByTime(
        "MlpPolicy",
        envs,
        n_steps=max(8192 // num_envs, 8),
        batch_size=2048,
        n_epochs=5,
        learning_rate=lambda left: 1e-4 + 4e-4 * left,
        gamma=0.99,
        gae_lambda=0.95,
        ent_coef=0.0,
        policy_kwargs={"net_arch": [128, 128], "log_std_init": -0.7},
        seed=seed,
        device="cpu",
    )
    progress = Progress(minutes)
    model.learn(10**12, callback=progress)
    envs.close()
    return model, progress


def success_rate(model: Any, episodes: int, num_envs: int = 64) -> tuple[float, float]:
    """Returns the rates of success and of collisions in new episodes, one per seed.

    Args:
        model: The policy, which takes its most probable action.
        episodes: Number of episodes.
        num_envs: Number of environments.
    """
    envs = make_many(num_envs)
    outcomes = evaluate(actions_of(model), envs, episodes, EVALUATION_SEED)
    envs.close()
    return outcomes.success_rate, outcomes.collision_rate


def write_curve(progress: Progress, path: Path) -> None:
    """Writes the learning curve as CSV, and as a picture beside it."""
    names = ("minutes", "steps", "success", "collisions", "return", "length")
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(names)
        writer.writerows(progress.rows)
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns = np.array(progress.rows).T
    figure = Figure(figsize=(7, 3.6), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.plot(columns[0], columns[2], label="goal reached")
    axes.plot(columns[0], columns[3], label="collision")
    axes.plot(columns[0], 1 - columns[2] - columns[3], label="time limit")
    axes.set(xlabel="minutes", ylabel=f"fraction of the last {WINDOW} episodes", ylim=(0, 1))
    axes.grid(alpha=0.3)
    axes.legend()
    steps = axes.secondary_xaxis("top", functions=_time_to_steps(columns[0], columns[1]))
    steps.set_xlabel("million steps")
    figure.savefig(path.with_suffix(".png"))


def _time_to_steps(minutes: Any, steps: Any) -> Any:
    """Returns the conversion between both axes and its inverse, by the mean speed."""
    speed = steps[-1] / minutes[-1] / 1e6
    return (lambda x: x * speed, lambda x: x / speed)


def main() -> None:
    """Trains, evaluates, and writes the results."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=10.0, help="wall time of the training")
    parser.add_argument("--num-envs", type=int, default=64, help="number of environments")
    parser.add_argument("--seed", type=int, default=1, help="seed of environments and policy")
    parser.add_argument("--episodes", type=int, default=1024, help="episodes of the evaluation")
    parser.add_argument(
        "--output", type=Path, default=Path("build/learning/navigate.zip"), help="the policy"
    )
    options = parser.parse_args()
    options.output.parent.mkdir(parents=True, exist_ok=True)
    model, progress = train(options.minutes, options.num_envs, options.seed)
    model.save(options.output)
    write_curve(progress, options.output.with_suffix(".csv"))
    success, collision = success_rate(model, options.episodes, options.num_envs)
    load = os.getloadavg()[1]
    print(
        f"{model.num_timesteps} steps in {progress.rows[-1][0]:.1f} min on {os.cpu_count()} cores, "
        f"load {load:.1f}; new episodes: success {success:.1%}, collisions {collision:.1%}"
    )


if __name__ == "__main__":
    main()
