"""Compares this version with that of another commit: `make bench-against REF=commit`.

Builds the commit in build/versions, and measures the processor time of selected work in both
versions by turns, with the programs of this checkout. The ratio of a row is the median of the
ratios of all turns. Exits with 1 if a ratio is above 1.05.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import work
from by_turns import Comparison, Measure, by_turns, format_comparisons
from node import quiet
from node_turns import READERS, running_node, start_of
from scenes import benchmark_world_path, shared_dir
from versions import Version, build, installed

Pair = tuple[Version, Version]  # this version and the reference
Select = Callable[[str], bool]  # returns whether a row is selected


@contextlib.contextmanager
def worker(version: Version, row: str, office: Path) -> Iterator[Measure]:
    """Runs a process that measures a row of `work.py` with the files of an office."""
    process = subprocess.Popen(
        [sys.executable, work.__file__, row],
        env={**os.environ, **version.variables, work.OFFICE_VARIABLE: str(office)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    commands, answers = process.stdin, process.stdout

    def measure() -> float:
        print(file=commands, flush=True)
        return float(answers.readline())

    with process:
        if answers.readline() != "ready\n":
            raise RuntimeError(f"{version.name} cannot perform {row}")
        yield measure


def works(versions: Pair, turns: int, selected: Select) -> Iterator[Comparison]:
    """Measures work without ROS."""
    for row in filter(selected, work.ROWS):
        this, reference = versions
        office = reference.office
        with worker(this, row, office) as first, worker(reference, row, office) as second:
            yield Comparison(row, by_turns(first, second, turns))


def nodes(
    versions: Pair, name: str, world: Path, turns: int, selected: Select
) -> Iterator[Comparison]:
    """Measures the start of the node, and its steps with each kind of reader.

    Args:
        versions: The versions.
        name: Name of the world.
        world: The world file.
        turns: Number of turns.
        selected: Whether a row is selected.
    """
    this, reference = versions
    row = f"node, {name}: start and end"
    if selected(row):
        with start_of(this, world) as first, start_of(reference, world) as second:
            yield Comparison(row, by_turns(first, second, turns))
    rows = {f"node, {name}: {reader}": reader for reader in READERS}
    if any(map(selected, rows)):
        with running_node(this, world) as node, running_node(reference, world) as other:
            for row in filter(selected, rows):
                with node.read(rows[row]), other.read(rows[row]):
                    yield Comparison(row, by_turns(node.measure, other.measure, turns))


def world_paths(office: Path) -> list[Path]:
    """Returns the benchmark world and the office of the reference simulator, and our office."""
    paths = [benchmark_world_path(), office / "world.yaml"]
    shared = shared_dir()
    if shared is not None:
        paths.append(shared / "worlds" / "conestogo_office_test" / "world.yaml")
    return list(dict.fromkeys(paths))


def main() -> int:
    """Measures the selected rows and prints the table; returns the exit code."""
    parser = argparse.ArgumentParser(prog="bench-against", description=__doc__)
    parser.add_argument("ref", help="the commit to compare with")
    parser.add_argument(
        "--only", nargs="+", default=[""], metavar="TEXT", help="only rows that contain a text"
    )
    parser.add_argument("--turns", type=int, default=10, help="number of turns (default 10)")
    options = parser.parse_args()

    def selected(row: str) -> bool:
        return any(text in row for text in options.only)

    versions = installed(), build(options.ref)
    measured = [works(versions, options.turns, selected)]
    with contextlib.ExitStack() as stack:
        for path in world_paths(versions[1].office):
            world = stack.enter_context(quiet(path))
            measured.append(nodes(versions, path.parent.name, world, options.turns, selected))
        rows = []
        for row in itertools.chain(*measured):
            print(f"{row.name}: {row.ratio:.3f}", flush=True)
            rows.append(row)
    print(f"\n{format_comparisons(rows, options.ref)}")
    return int(any(row.is_slower for row in rows))


if __name__ == "__main__":
    sys.exit(main())
