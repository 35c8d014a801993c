"""Pictures of runs and of distributions as SVG, for the report."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Final

from flatland.scenarios.episode import Result
from flatland.scenarios.outline import Line

_WIDTH: Final = 360.0  # of the picture of a run [px]
_HEIGHT: Final = 260.0
_MARGIN: Final = 0.5  # around the walls [m]
_PLOT_WIDTH: Final = 420.0
_ROW: Final = 34.0  # height of a row of a plot [px]
_LABEL: Final = 110.0  # width of the labels of a plot [px]


def run_picture(result: Result, walls: Sequence[Line]) -> str:
    """Returns the picture of a run: walls, models at its end, the path, goals and events.

    A kidnapping is a dashed line between two parts of the path.
    """
    tracks = result.tracks
    points = [point for track in tracks for point in track]
    everything = [point for line in walls for point in line] + points + list(result.goals)
    # Models may have been put far away.
    for _, role, lines in result.models:
        if role == "hit" or not walls:
            everything += [point for line in lines for point in line]
    if not everything:
        return ""
    xs, ys = [x for x, _ in everything], [y for _, y in everything]
    x_min, x_max = min(xs) - _MARGIN, max(xs) + _MARGIN
    y_min, y_max = min(ys) - _MARGIN, max(ys) + _MARGIN
    scale = min(_WIDTH / (x_max - x_min), _HEIGHT / (y_max - y_min))
    width, height = (x_max - x_min) * scale, (y_max - y_min) * scale

    def place(x: float, y: float) -> tuple[float, float]:
        return ((x - x_min) * scale, (y_max - y) * scale)

    def path(lines: Iterable[Sequence[tuple[float, float]]]) -> str:
        parts = []
        for line in lines:
            corners = ("%.1f %.1f" % place(x, y) for x, y in line)  # noqa: UP031
            parts.append("M" + "L".join(corners))
        return "".join(parts)

    shapes = [f'<path class="walls" d="{path(walls)}"/>']
    for name, role, lines in result.models:
        title = f"{name}, hit by the robot" if role == "hit" else name
        shapes.append(
            f'<path class="model {role}" d="{path(lines)}"><title>{escape(title)}</title></path>'
        )
    if points:
        shapes.append(f'<path class="track" d="{path(tracks)}"/>')
        for time, x1, y1, x2, y2 in result.jumps:
            shapes.append(
                f'<path class="jump" d="{path([[(x1, y1), (x2, y2)]])}">'
                f"<title>moved at {time:.2f} s</title></path>"
            )
        shapes.append(_dot(*place(*points[0]), 4, "start"))
    for number, (x, y) in enumerate(result.goals, 1):
        px, py = place(x, y)
        shapes.append(_dot(px, py, 5, "goal"))
        if len(result.goals) > 1:
            shapes.append(f'<text x="{px + 7:.1f}" y="{py + 4:.1f}">{number}</text>')
    for time, x, y, action in result.events:
        px, py = place(x, y)
        title = f"<title>{escape(action)} at {time:.2f} s</title>"
        shapes.append(
            f'<rect class="event" x="{px - 3:.1f}" y="{py - 3:.1f}" width="6" height="6">'
            f"{title}</rect>"
        )
    if points:
        x, y = place(*points[-1])
        end = "end" if result.row["success"] else "end bad"
        shapes.append(
            f'<path class="{end}" d="M{x - 4:.1f} {y - 4:.1f}l8 8m0 -8l-8 8">'
            f"<title>{escape(result.row['outcome'])}</title></path>"
        )
    label = f"Path of {result.row['controller']} in {result.row['scenario']}"
    return (
        f'<svg class="run" viewBox="0 0 {width:.0f} {height:.0f}" width="{width:.0f}" '
        f'height="{height:.0f}" role="img" aria-label="{escape(label)}">{"".join(shapes)}</svg>'
    )


def strip_plot(title: str, values: Mapping[str, Sequence[tuple[str, float]]], unit: str) -> str:
    """Returns a plot with one row per controller, and one dot per run.

    Args:
        title: Name of the measure.
        values: Title and value of each run by controller.
        unit: Unit of the values.
    """
    numbers = [value for runs in values.values() for _, value in runs]
    if not numbers:
        return ""
    high = _round_up(max(*numbers, 1e-9))
    height = _ROW * len(values) + 40
    shapes = []
    room = _PLOT_WIDTH - _LABEL - 20

    def place(value: float) -> float:
        return _LABEL + room * max(0.0, value) / high

    for tick in range(5):
        value = high * tick / 4
        x = place(value)
        shapes.append(f'<path class="grid" d="M{x:.1f} 6V{height - 34:.1f}"/>')
        shapes.append(f'<text class="tick" x="{x:.1f}" y="{height - 18:.1f}">{value:.3g}</text>')
    for row, (controller, runs) in enumerate(values.items()):
        y = 6 + _ROW * (row + 0.5)
        shapes.append(
            f'<text class="label" x="{_LABEL - 8:.1f}" y="{y + 4:.1f}">'
            f"{escape(_short(controller))}</text>"
        )
        for number, (name, value) in enumerate(runs):
            # Golden-ratio offsets spread the dots without random numbers.
            offset = ((number * 0.618034) % 1 - 0.5) * 0.6 * _ROW
            shapes.append(
                f'<circle class="dot c{row % 6}" cx="{place(value):.1f}" cy="{y + offset:.1f}" '
                f'r="2.5"><title>{escape(name)}: {value:.4g} {escape(unit)}</title></circle>'
            )
        if runs:
            mean = place(sum(value for _, value in runs) / len(runs))
            shapes.append(
                f'<path class="mean" d="M{mean:.1f} {y - _ROW * 0.4:.1f}v{_ROW * 0.8:.1f}"/>'
            )
    shown = f"{title} [{unit}]" if unit else title
    shapes.append(
        f'<text class="axis" x="{_LABEL + room / 2:.1f}" y="{height - 3:.1f}">'
        f"{escape(shown)}</text>"
    )
    return (
        f'<svg class="plot" viewBox="0 0 {_PLOT_WIDTH:.0f} {height:.0f}" '
        f'width="{_PLOT_WIDTH:.0f}" height="{height:.0f}" role="img" '
        f'aria-label="{escape(shown)} of all runs">{"".join(shapes)}</svg>'
    )


def _dot(x: float, y: float, radius: float, name: str) -> str:
    return f'<circle class="{name}" cx="{x:.1f}" cy="{y:.1f}" r="{radius:g}"/>'


def _short(controller: str) -> str:
    """Returns the name of a controller, without its file."""
    return controller.rpartition(":")[2]


def _round_up(value: float) -> float:
    """Returns the next number of the form 1, 2, 4, 5 or 10 times a power of 10."""
    power = 10 ** math.floor(math.log10(value))
    return next(
        float(step * power) for step in (1, 2, 4, 5, 10) if step * power >= value * (1 - 1e-9)
    )
