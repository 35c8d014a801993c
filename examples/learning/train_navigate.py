#!/usr/bin/env python3
"""Trains policies that drive to goals, by imitation of a teacher that uses the map.

The method is DAgger: S. Ross, G. Gordon, D. Bagnell, "A reduction of imitation learning and
structured prediction to no-regret online learning", Proc. AISTATS (2011). The policy drives, the
teacher chooses a heading in each situation, and the network learns the headings of all situations.

Requires `pip install "flatland-sim[learning]"`. For each seed, it writes the policy as ONNX file
and the learning curve as CSV, and prints the rates in buildings without training. A picture shows
all curves.
"""

from __future__ import annotations

import argparse
import csv
import functools
import time
import warnings
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
import torch
from navigation import TASKS, TrainingBuildings, evaluate_on, rates
from network import HEADINGS, STATE, Network, positions
from teacher import Teacher
from torch import Tensor
from torch.nn import functional

from flatland.gym import Buildings, FlatlandVectorEnv
from flatland.gym.policies import Policy, PolicyRobot

STEPS: Final = 64  # of each environment in a round
UPDATES: Final = 16  # of the network in a round
BATCH: Final = 4096  # situations in an update
LEARNING_RATE: Final = 1e-3
WINDOW: Final = 1000  # episodes in a point of the curve
CURVE: Final = ("cpu_minutes", "steps", "reached", "collisions", "loss")

Row = tuple[float, int, float, float, float]


class Training:
    """The environments, the teacher, the network, and all situations with their headings.

    Attributes:
        network: The network.
        curve: For each round: processor time [min], steps, rates of reached goals and of collisions
            in the last episodes, and loss.
    """

    def __init__(self, seed: int, rounds: int, num_envs: int, buildings: Buildings) -> None:
        """Creates a network with random weights.

        Args:
            seed: Seed of the episodes, the weights and the updates.
            rounds: Number of rounds.
            num_envs: Number of environments.
            buildings: The buildings in which the episodes take place.
        """
        self._start = time.process_time()
        torch.manual_seed(seed)
        self._envs = FlatlandVectorEnv(num_envs, buildings, autoreset_mode="SameStep")
        self._teacher = Teacher(self._envs)
        self.network = Network(self._envs)
        self._optimizer = torch.optim.Adam(self.network.parameters(), lr=LEARNING_RATE)
        self._schedule = torch.optim.lr_scheduler.CosineAnnealingLR(
            self._optimizer, rounds * UPDATES, eta_min=0.02 * LEARNING_RATE
        )
        self._rounds = rounds
        self._features = torch.zeros(rounds * STEPS, num_envs, self.network.features_size)
        self._headings = torch.zeros(rounds * STEPS, num_envs)
        self._size = 0  # steps that are filled
        self._episodes: deque[tuple[bool, bool]] = deque(maxlen=WINDOW)
        self._state = torch.zeros(num_envs, STATE)
        self._observations, _ = self._envs.reset(seed=seed * num_envs)
        self.curve: list[Row] = []

    def run(self) -> None:
        """Performs all rounds, and closes the environments."""
        for number in range(self._rounds):
            for _ in range(STEPS):
                self._step(is_taught=number == 0)
            losses = [self._update() for _ in range(UPDATES)]
            steps = self._size * len(self._state)
            reached, collisions = np.mean(list(self._episodes) or [(0, 0)], axis=0).tolist()
            minutes = (time.process_time() - self._start) / 60
            self.curve.append((minutes, steps, reached, collisions, losses[-1]))
            if number % 10 == 9:
                print(
                    f"{minutes:5.1f} CPU min {steps:8d} steps: reached {reached:.1%}, collisions "
                    f"{collisions:.1%}, loss {losses[-1]:.2f}",
                    flush=True,
                )
        self._teacher.close()
        self._envs.close()

    def _step(self, *, is_taught: bool) -> None:
        """Performs a step of all environments.

        Args:
            is_taught: Whether the robots follow the teacher instead of the network.
        """
        wanted = torch.from_numpy(self._teacher.headings(self._observations)).float()
        observations = torch.from_numpy(self._observations)
        with torch.no_grad():
            features, frames = self.network.features(observations)
            actions, self._state = self.network.follow(observations, self._state, features, frames)
            if is_taught:
                actions = self.network.drive(observations, wanted)
        self._features[self._size] = features
        self._headings[self._size] = wanted - frames
        self._size += 1
        self._observations, _, terminated, truncated, infos = self._envs.step(actions.numpy())
        ended = terminated | truncated
        self._state[torch.from_numpy(ended)] = 0.0
        if ended.any():
            final = infos["final_info"]
            self._episodes.extend(
                zip(final["is_success"][ended], final["collision"][ended], strict=True)
            )

    def _update(self) -> float:
        """Changes the weights by the gradient in random situations, and returns the loss."""
        chosen = torch.randint(self._size * len(self._state), (BATCH,))
        features = self._features.flatten(0, 1)[chosen]
        headings = self._headings.flatten()[chosen]
        # Left and right are exchanged in half of the situations.
        half = BATCH // 2
        features = torch.cat((self.network.mirrored(features[:half]), features[half:]))
        headings = torch.cat((-headings[:half], headings[half:]))
        loss = _loss(self.network.logits(features), headings)
        self._optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        self._optimizer.step()
        self._schedule.step()
        return loss.item()

    def write(self, path: Path) -> None:
        """Writes the network as ONNX file."""
        example = torch.from_numpy(self._observations), self._state
        names = ["observation", "state"], ["action", "next_state"]
        with warnings.catch_warnings():
            # The other exporter requires one more package.
            warnings.simplefilter("ignore", DeprecationWarning)
            torch.onnx.export(
                self.network.eval(),
                example,
                str(path),
                input_names=names[0],
                output_names=names[1],
                dynamic_axes={name: {0: "n"} for name in (*names[0], *names[1])},
                opset_version=17,
                dynamo=False,
            )
        add_metadata(path, PolicyRobot.of(self._envs))


def add_metadata(path: Path, robot: PolicyRobot) -> None:
    """Adds the robot of the training to an ONNX file."""
    import onnx

    model = onnx.load(path)
    onnx.helper.set_model_props(model, robot.metadata())
    onnx.save(model, path)


def _loss(logits: Tensor, headings: Tensor) -> Tensor:
    """Returns the mean cross entropy of headings, each divided between its two neighbours.

    Args:
        logits: Logits of all headings, shape (n, 72).
        headings: Headings in the same frames [rad], shape (n,).
    """
    place = positions(headings)
    lower = torch.floor(place)
    first = torch.remainder(lower.long(), HEADINGS)[:, None]
    second = torch.remainder(first + 1, HEADINGS)
    log_probabilities = functional.log_softmax(logits, dim=1)
    part = (place - lower)[:, None]
    likelihood = (1.0 - part) * log_probabilities.gather(1, first)
    likelihood += part * log_probabilities.gather(1, second)
    return -likelihood.mean()


def write_curve(rows: Sequence[Row], path: Path) -> None:
    """Writes a learning curve as CSV."""
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(CURVE)
        writer.writerows(rows)


def draw_curves(curves: dict[int, Sequence[Row]], path: Path) -> None:
    """Draws learning curves by seed."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 3.6), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    for seed, rows in curves.items():
        columns = np.array(rows).T
        (line,) = axes.plot(columns[1] / 1000, 1.0 - columns[2], label=f"seed {seed}")
        axes.plot(columns[1] / 1000, columns[3], ":", color=line.get_color())
    axes.set(xlabel="thousand steps", ylim=(0, 0.1))
    axes.set_ylabel(
        f"fraction of the last {WINDOW} episodes\n(goal not reached; dotted: collision)"
    )
    axes.grid(alpha=0.3)
    axes.legend()
    figure.savefig(path)


def main() -> None:
    """Trains, evaluates, and writes the results."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--seed", type=int, nargs="+", default=[1], help="seeds of episodes and weights"
    )
    parser.add_argument("--rounds", type=int, default=60, help=f"rounds of {STEPS} steps")
    parser.add_argument("--num-envs", type=int, default=64, help="number of environments")
    parser.add_argument("--episodes", type=int, default=2048, help="episodes of the evaluation")
    parser.add_argument(
        "--output",
        type=Path,
        default=Path("build/learning/navigate.onnx"),
        help="the policy; with several seeds, -SEED is added to the name",
    )
    options = parser.parse_args()
    torch.set_num_threads(1)  # The network is small: more threads wait for each other.
    output: Path = options.output
    output.parent.mkdir(parents=True, exist_ok=True)
    curves: dict[int, Sequence[Row]] = {}
    table = ["seed  CPU min  task                  goal   coll.  other  steps to the goal"]
    for seed in options.seed:
        path = output.with_stem(f"{output.stem}-{seed}") if len(options.seed) > 1 else output
        training = Training(seed, options.rounds, options.num_envs, TrainingBuildings())
        training.run()
        training.write(path)
        curves[seed] = training.curve
        write_curve(training.curve, path.with_suffix(".csv"))
        draw_curves(curves, output.with_suffix(".png"))
        for task in TASKS:
            outcomes = evaluate_on(task, functools.partial(Policy, path), options.episodes)
            minutes = f"{training.curve[-1][0]:7.1f}"
            table.append(f"{seed:4d}  {minutes}  {task:20s} {rates(outcomes)}")
            print(table[-1], flush=True)
    print(*table, sep="\n")


if __name__ == "__main__":
    main()
