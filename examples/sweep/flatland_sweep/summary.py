"""Summary of the results: a table by controller, and a picture."""

from __future__ import annotations

import importlib
import math
from pathlib import Path
from typing import Any, Final

import pandas as pd

_Z: Final = 1.959964  # 97.5 % quantile of the normal distribution


def wilson_interval(successes: int, trials: int) -> tuple[float, float]:
    """Returns the 95 % Wilson score interval of a rate; NaN without trials.

    See https://en.wikipedia.org/wiki/Binomial_proportion_confidence_interval.
    """
    if not trials:
        return (math.nan, math.nan)
    rate = successes / trials
    scale = 1 + _Z**2 / trials
    center = (rate + _Z**2 / (2 * trials)) / scale
    half = _Z * math.sqrt(rate * (1 - rate) / trials + (_Z / (2 * trials)) ** 2) / scale
    # It contains the rate, apart from rounding.
    return (max(0.0, min(rate, center - half)), min(1.0, max(rate, center + half)))


def summarize(frame: pd.DataFrame) -> pd.DataFrame:
    """Returns one row for each world and controller, and one for all worlds if there are several.

    Cells with an error are counted, but are part of no other number. Medians of time and path are
    those of the successes.

    Args:
        frame: The rows of a sweep.
    """
    rows = []
    worlds: list[str | None] = sorted(frame["world"].unique())
    if len(worlds) > 1:
        worlds.append(None)
    for world in worlds:
        of_world = frame if world is None else frame[frame["world"] == world]
        for controller, group in of_world.groupby("controller"):
            rows.append({"world": world or "all", "controller": controller, **_numbers(group)})
    return pd.DataFrame(rows)


def _numbers(group: pd.DataFrame) -> dict[str, Any]:
    valid = group[group["outcome"] != "error"]
    successes = valid[valid["success"]]
    low, high = wilson_interval(len(successes), len(valid))
    return {
        "cells": len(group),
        "errors": len(group) - len(valid),
        "success": len(successes) / len(valid) if len(valid) else math.nan,
        "low": low,
        "high": high,
        "timeouts": int((valid["outcome"] == "timeout").sum()),
        "time": successes["time"].median(),
        "path": successes["path_length"].median(),
        "collisions": float(valid["collisions"].mean()) if len(valid) else math.nan,
        "clearance": valid["min_clearance"].median(),
    }


def format_summary(summary: pd.DataFrame) -> str:
    """Returns the table of `summarize` as text."""
    head = {
        "success": "success",
        "interval": "95 % interval",
        "time": "time [s]",
        "path": "path [m]",
        "collisions": "collisions",
        "clearance": "clearance [m]",
    }
    table = summary[["world", "controller", "cells", "errors", "timeouts"]].copy()
    table["success"] = summary["success"].map(_percent)
    limits = zip(summary["low"], summary["high"], strict=True)
    table["interval"] = [
        "-" if math.isnan(low) else f"{_percent(low)} to {_percent(high)}" for low, high in limits
    ]
    for name, digits in (("time", 1), ("path", 1), ("collisions", 2), ("clearance", 3)):
        table[name] = [
            "-" if math.isnan(value) else f"{value:.{digits}f}" for value in summary[name]
        ]
    return str(table.rename(columns=head).to_string(index=False))


def _percent(rate: float) -> str:
    return "-" if math.isnan(rate) else f"{100 * rate:.1f} %"


def draw_summary(frame: pd.DataFrame, path: Path) -> bool:
    """Draws rates of success, times and clearances by controller.

    Args:
        frame: The rows of a sweep.
        path: The picture, a PNG file.

    Returns:
        Whether it was drawn; False if matplotlib is not installed.
    """
    try:
        figures = importlib.import_module("matplotlib.figure")
    except ImportError:
        return False
    summary = summarize(frame)
    controllers = sorted(frame["controller"].unique())
    worlds = sorted(frame["world"].unique())
    # Names of controllers in files are too long for an axis.
    labels = [name.rpartition(":")[2] for name in controllers]
    figure = figures.Figure(figsize=(12, 4), layout="constrained")
    rates, times, clearances = figure.subplots(1, 3)
    width = 0.8 / len(worlds)
    for number, world in enumerate(worlds):
        of_world = summary[summary["world"] == world].set_index("controller").reindex(controllers)
        offset = (number - (len(worlds) - 1) / 2) * width
        places = [index + offset for index in range(len(controllers))]
        rate = 100 * of_world["success"]
        errors = [rate - 100 * of_world["low"], 100 * of_world["high"] - rate]
        color = f"C{number % 10}"
        rates.bar(places, rate, width, yerr=errors, color=color, capsize=3, label=world)
        valid = frame[(frame["world"] == world) & (frame["outcome"] != "error")]
        for axes, column, rows in (
            (times, "time", valid[valid["success"]]),
            (clearances, "min_clearance", valid),
        ):
            values = [rows[rows["controller"] == name][column] for name in controllers]
            boxes = axes.boxplot(
                [one.to_numpy(float) for one in values],
                positions=places,
                widths=0.8 * width,
                patch_artist=True,
                medianprops={"color": "black"},
            )
            for box in boxes["boxes"]:
                box.set_facecolor(color)
    for axes, title in (
        (rates, "success [%], 95 % Wilson interval"),
        (times, "time of successes [s]"),
        (clearances, "minimum clearance [m]"),
    ):
        axes.set_title(title)
        axes.set_xticks(range(len(controllers)), labels)
        axes.set_ylim(bottom=0)
    rates.set_ylim(0, 100)
    if len(worlds) > 1:
        rates.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), fontsize="small")
    figure.savefig(path, format="png", dpi=100)
    return True
