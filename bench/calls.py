"""Counts Python calls: `make bench-calls`, or `python bench/calls.py [--functions ROW]`.

A call is an event `call` of `sys.setprofile`, which does not include functions in C and C++. The
counts do not depend on the machine.
"""

from __future__ import annotations

import argparse
import gc
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from types import CodeType, FrameType

from table import Row, format_table
from work import office, robot_folder, robot_world

SHOWN = 60  # functions of a row


def count_calls(action: Callable[[], object]) -> Counter[CodeType]:
    """Returns the number of calls of each Python function in an action, without its own call."""
    counts: Counter[CodeType] = Counter()

    def count(frame: FrameType, event: str, _argument: object) -> None:
        if event == "call":
            counts[frame.f_code] += 1

    gc.collect()
    gc.disable()
    sys.setprofile(count)
    try:
        action()
    finally:
        sys.setprofile(None)
        gc.enable()
    return counts - Counter([action.__code__]) if hasattr(action, "__code__") else counts


def measurements() -> Iterator[tuple[str, Callable[[], object], float]]:
    """Yields a name, an action and the limit of its calls; each action is valid until the next."""
    with robot_world(wanted=True) as world:
        yield "step(1), DiffDrive and Laser, outputs wanted", lambda: world.step(1), 50
        with robot_folder() as folder:
            path = folder / "robot.model.yaml"
            world.spawn_model(path, "first", "first", (3.0, -5.5, 0.0))
            yield (
                "spawn of such a model, loaded before",
                lambda: world.spawn_model(path, "second", "second", (5.0, -5.5, 0.0)),
                900,
            )
    with office() as world:
        world.clone().close()
        yield "clone and close of the office", lambda: world.clone().close(), 900
        snapshot = world.snapshot()
        world.restore(snapshot)
        yield "restore of the office", lambda: world.restore(snapshot), 50
        world.reset()
        yield "reset of the office", lambda: world.reset(), 1500


def main() -> None:
    """Prints the number of calls of each action, or the functions that one action calls."""
    parser = argparse.ArgumentParser(prog="bench-calls", description=__doc__)
    parser.add_argument(
        "--functions", metavar="TEXT", help="list the functions of the rows that contain a text"
    )
    options = parser.parse_args()
    rows = []
    for name, action, bar in measurements():
        counts = count_calls(action)
        files = len({code.co_filename for code in counts})
        rows.append(Row(name, counts.total(), "calls", bar, note=f"in {files} files"))
        if options.functions is not None and options.functions in name:
            for code, count in counts.most_common(SHOWN):
                path = Path(code.co_filename)
                where = "/".join(path.parts[-3:])
                print(f"{count:6d}  {code.co_qualname}  {where}:{code.co_firstlineno}")
    print(format_table(rows))


if __name__ == "__main__":
    main()
