"""Measures flatland: `make bench`, or `python bench` in its environment.

Prints one table; every figure is a ratio, or a multiple of U, one scan of 1081 beams by
`b2World::RayCast` on the benchmark world in the same run. Draws how cost grows, too.
"""

from __future__ import annotations

import argparse
import importlib
import json
from dataclasses import asdict
from pathlib import Path

from curves import plot
from scans import yardstick
from table import as_json, format_table

GROWTH = "growth"  # the module of curves; the others have rows
# Each module has `rows(unit)`, which measures and returns its rows; unit is U in seconds.
MODULES = (
    *("scans", "steps", "jam", "plugin_steps", "node", "real_time", "large_map", "markers"),
    "placement",
)


def main() -> None:
    """Measures, prints the table and writes JSON."""
    parser = argparse.ArgumentParser(prog="bench", description=__doc__)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the rows as JSON")
    parser.add_argument("--baseline", type=Path, metavar="FILE", help="JSON of an earlier run")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="draw how cost grows")
    groups = (*MODULES, GROWTH)
    parser.add_argument(
        "--only", nargs="+", choices=groups, default=groups, metavar="GROUP", help="some groups"
    )
    options = parser.parse_args()
    baseline = {}
    if options.baseline is not None:
        earlier = json.loads(options.baseline.read_text())
        baseline = {row["name"]: row["value"] for row in earlier["rows"]}
    unit = yardstick()
    print(f"U = {unit * 1e3:.3f} ms\n")
    rows = []
    for name in MODULES:
        if name in options.only:
            rows += importlib.import_module(name).rows(unit)
    print(format_table(rows, baseline))
    panels = []
    if GROWTH in options.only and (options.json is not None or options.plot is not None):
        panels = importlib.import_module(GROWTH).panels()
    if panels and options.plot is not None:
        plot(panels, options.plot)
        print(f"\nhow cost grows: {options.plot}")
    if options.json is not None:
        growth = [asdict(panel) for panel in panels]
        report = {"unit": unit, "rows": as_json(rows), "growth": growth}
        options.json.write_text(json.dumps(report, indent=2))


if __name__ == "__main__":
    main()
