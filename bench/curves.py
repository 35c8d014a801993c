"""Curves of cost over problem size, and their plot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Curve:
    """One curve of a panel."""

    label: str
    x: list[float]
    y: list[float]


@dataclass(frozen=True, slots=True)
class Panel:
    """Axes with one or more curves."""

    title: str
    x_label: str
    y_label: str
    curves: list[Curve]


COLUMNS = 2
PANEL_SIZE = (5.0, 3.6)  # inches


def plot(panels: Sequence[Panel], path: Path) -> None:
    """Draws all panels into one image file, with logarithmic axes."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns = min(COLUMNS, len(panels))
    rows = -(-len(panels) // columns)
    figure = Figure(figsize=(columns * PANEL_SIZE[0], rows * PANEL_SIZE[1]), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, panel in zip(grid, panels):  # noqa: B905 - the last axes can remain empty
        for curve in panel.curves:
            axes.loglog(curve.x, curve.y, marker="o", markersize=4, label=curve.label)
        axes.set_title(panel.title, fontsize="medium")
        axes.set(xlabel=panel.x_label, ylabel=panel.y_label)
        axes.grid(True, which="major", alpha=0.4)
        axes.legend()
    for axes in grid[len(panels) :]:
        axes.set_axis_off()
    figure.savefig(path, dpi=90)
