#!/usr/bin/env python3
"""Draws the pictures of docs/pedestrians.md, which compare people with published observations.

With --hour, checks instead that no person is ever inside a wall or another person, and measures how
far people walk: 200 people in the office for an hour of simulated time, by each model. With
--doors, prints how long opposite streams take to pass a door.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("agg")
import matplotlib.pyplot as plt
from pedestrian_scenes import (
    STEP,
    Overlaps,
    bottleneck_flow,
    free_speeds,
    fundamental_diagram,
    lanes,
    opposite_streams,
    people_of,
    weidmann,
)

import flatland

CHECKOUT = Path(__file__).resolve().parent.parent
MODELS = {"social_force": ("social force", "tab:blue"), "orca": ("ORCA", "tab:orange")}
STILL = 0.15  # m in a second, below which people stand
FLOWS_OF_EXPERIMENTS = (1.2, 1.9)  # 1/(m s): Weidmann 1993; Kretz et al. 2006, Seyfried et al. 2009


def draw_hall(path: Path) -> None:
    """Draws the bundled world after 30 s."""
    with flatland.World.from_yaml(CHECKOUT / "worlds/people/world.yaml", seed=1) as world:
        world.step(round(30.0 / STEP))
        plt.imsave(path, world.draw(size=(1000, 640)))


def draw_validation(path: Path) -> None:
    """Draws free speeds, lanes, the fundamental diagram, and flows through doors."""
    figure, axes = plt.subplots(2, 2, figsize=(10.0, 7.4), layout="constrained")
    draw_speeds(axes[0, 0])
    draw_lanes(axes[0, 1])
    draw_diagram(axes[1, 0])
    draw_flows(axes[1, 1])
    for axis in axes.flat:
        axis.grid(alpha=0.3)
        axis.legend(fontsize=8)
    figure.savefig(path, dpi=100)


def draw_speeds(axis: plt.Axes) -> None:
    """Draws the distribution of free speeds."""
    bins = np.arange(0.5, 2.3, 0.1)
    for model, (name, color) in MODELS.items():
        speeds = free_speeds(model)
        label = f"{name}: {speeds.mean():.2f} ± {speeds.std():.2f} m/s"
        print(label)
        axis.hist(speeds, bins, density=True, histtype="step", color=color, label=label)
    v = np.linspace(0.5, 2.2, 200)
    density = np.exp(-0.5 * ((v - 1.34) / 0.26) ** 2) / (0.26 * np.sqrt(2 * np.pi))
    axis.plot(v, density, "k--", lw=1, label="1.34 ± 0.26 m/s")
    axis.set(title="Speeds of people who walk alone", xlabel="speed [m/s]", ylabel="density [s/m]")


def draw_lanes(axis: plt.Axes) -> None:
    """Draws the order of two opposite streams over time."""
    for model, (name, color) in MODELS.items():
        runs = [lanes(model, 60, 90, seed) for seed in range(1, 7)]
        times = runs[0][0]
        orders = np.array([order for _, order, _ in runs])
        print(f"{name}: order {orders[:, 0].mean():.2f} to {orders[:, -30:].mean():.2f}")
        axis.plot(times, orders.mean(axis=0), color=color, label=f"{name}, mean of 6 runs")
        axis.fill_between(times, orders.min(axis=0), orders.max(axis=0), color=color, alpha=0.12)
    axis.set(
        title="Lanes: 60 people in a corridor of 20 m x 4 m",
        xlabel="time [s]",
        ylabel="band order parameter",
        ylim=(0, 1),
    )


def draw_diagram(axis: plt.Axes) -> None:
    """Draws speeds over densities beside those of Weidmann."""
    for model, (name, color) in MODELS.items():
        points = fundamental_diagram(model, [10, 40, 80, 120, 160, 200, 220], 30.0)
        print(name, points.round(2).tolist())
        axis.plot(*points.T, "o", color=color, label=name)
    density = np.linspace(0.05, 5.4, 200)
    axis.plot(density, weidmann(density), "k--", lw=1, label="Weidmann 1993")
    axis.set(
        title="Fundamental diagram: people around a block",
        xlabel="density [1/m²]",
        ylabel="mean speed [m/s]",
        xlim=(0, 5.4),
        ylim=(0, 1.5),
    )


def draw_flows(axis: plt.Axes) -> None:
    """Draws flows through doors of several widths."""
    widths = np.array([0.8, 1.2, 1.6, 2.0])
    for model, (name, color) in MODELS.items():
        flows = [
            float(np.mean([bottleneck_flow(model, width, seed=seed) for seed in (1, 2)]))
            for width in widths
        ]
        print(name, dict(zip(widths.tolist(), np.round(flows, 2).tolist(), strict=True)))
        axis.plot(widths, flows, "o-", color=color, label=name)
    for specific, label, style in zip(
        FLOWS_OF_EXPERIMENTS, ("1.2 /(m s), Weidmann", "1.9 /(m s), experiments"), ":-", strict=True
    ):
        axis.plot(widths, specific * widths, f"k{style}", lw=1, label=label)
    axis.set(title="Flow through a door", xlabel="width of the door [m]", ylabel="flow [1/s]")


def check_hour(minutes: int, models: list[str]) -> bool:
    """Prints overlaps, speeds and stands in the office; returns whether nobody overlapped."""
    sys.path.insert(0, str(CHECKOUT / "bench"))
    from people import PEOPLE, office

    is_good = True
    for model in models:
        with office(PEOPLE, model) as world:
            overlaps = Overlaps(world)
            start = people_of(world).poses[:, :2]
            walked, still, longest = np.zeros((3, PEOPLE))
            for second in range(1, minutes * 60 + 1):
                world.step(round(1.0 / STEP) - 7)  # not only at the times of updates
                overlaps.look()
                world.step(7)
                overlaps.look()
                now = people_of(world).poses[:, :2]
                moved = np.hypot(*(now - start).T)
                walked += moved
                still = np.where(moved < STILL, still + 1.0, 0.0)
                longest = np.maximum(longest, still)
                start = now
                if second % 600 and second != minutes * 60:
                    continue
                print(
                    f"{model}, {second // 60} min: greatest overlaps {overlaps.walls * 1e3:.2f} mm "
                    f"with a wall, {overlaps.others * 1e3:.2f} mm with a person; mean speed "
                    f"{walked.mean() / second:.2f} m/s, least {walked.min() / second:.2f} m/s; "
                    f"longest stand {longest.max():.0f} s, {(longest > 60.0).sum()} people stood "
                    "for more than 60 s",
                    flush=True,
                )
        is_good &= max(overlaps.walls, overlaps.others) <= 0.0
    return is_good


def print_doors(models: list[str]) -> None:
    """Prints the times of opposite streams at a door, for five seeds."""
    for model in models:
        times = ", ".join(f"{opposite_streams(model, seed=seed):.1f}" for seed in range(1, 6))
        print(f"{model}: 20 people from each side pass a door in {times} s", flush=True)


def main() -> None:
    """Draws all pictures, or carries out one of the measurements."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hour", action="store_true", help="check overlaps instead")
    parser.add_argument("--minutes", type=int, default=60, help="simulated time of this check")
    parser.add_argument("--doors", action="store_true", help="measure opposite streams instead")
    parser.add_argument("--model", choices=list(MODELS), help="only one model in a measurement")
    parser.add_argument("--to", type=Path, default=CHECKOUT / "docs" / "images")
    options = parser.parse_args()
    models = [options.model] if options.model else list(MODELS)
    if options.hour:
        sys.exit(0 if check_hour(options.minutes, models) else 1)
    if options.doors:
        print_doors(models)
        return
    draw_hall(options.to / "people.png")
    draw_validation(options.to / "pedestrians.png")


if __name__ == "__main__":
    main()
