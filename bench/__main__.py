"""Measures the performance of flatland: `make bench`, or `python bench` in its environment.

Prints a table. Most figures are ratios or multiples of U, the time of one scan of 1081 beams with
`b2World::RayCast` in the benchmark world, measured in the same run. With --json or --plot, the
cost is also measured over the problem size.
"""

from __future__ import annotations

import argparse
import importlib
import json
from dataclasses import asdict
from pathlib import Path

from curves import plot
from scans import time_unit
from scenes import BAR_WORLD, benchmark_world_path
from table import as_json, format_table

GROWTH = "growth"  # the module that measures curves
# Each module defines `rows(unit)`, which measures and returns its rows; `unit` is U [s].
MODULES = (
    "scans",
    "lasers",
    "materials",
    "steps",
    "jam",
    "plugin_steps",
    "messages",
    "node",
    "ros2",
    "lockstep",
    "real_time",
    "large_map",
    "random_worlds",
    "markers",
    "placement",
    "people",
    "churn",
    "copies",
    "gym_steps",
    "web_page",
    "web_stream",
)


def main() -> None:
    """Measures the selected groups, prints the table and writes the requested files."""
    parser = argparse.ArgumentParser(prog="bench", description=__doc__)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all results as JSON")
    parser.add_argument(
        "--plot", type=Path, metavar="FILE", help="plot the cost over the problem size"
    )
    groups = (*MODULES, GROWTH)
    parser.add_argument(
        "--only",
        nargs="+",
        choices=groups,
        default=groups,
        metavar="GROUP",
        help=f"measure only these groups: {', '.join(groups)}",
    )
    options = parser.parse_args()
    unit = time_unit()
    world = benchmark_world_path().parent.name
    print(f"U = {unit * 1e3:.3f} ms, in {world}\n")
    if world != BAR_WORLD:
        print(f"The bars in U are for {BAR_WORLD}: set FLATLAND_SHARED_DIR.\n")
    rows = []
    for name in MODULES:
        if name in options.only:
            rows += importlib.import_module(name).rows(unit)
    print(format_table(rows))
    panels = []
    if GROWTH in options.only and (options.json is not None or options.plot is not None):
        panels = importlib.import_module(GROWTH).panels()
    if panels and options.plot is not None:
        plot(panels, options.plot)
        print(f"\ncost over the problem size: {options.plot}")
    if options.json is not None:
        growth = [asdict(panel) for panel in panels]
        report = {"unit": unit, "rows": as_json(rows), "growth": growth}
        options.json.write_text(json.dumps(report, indent=2))


if __name__ == "__main__":
    main()
