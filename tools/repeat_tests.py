"""Runs all tests repeatedly beside busy processes and lists each test that ever failed.

Run by `make test-repeat`. A test that fails in some of the runs only depends on something other
than the program.
"""

from __future__ import annotations

import argparse
import contextlib
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path("build/test-repeat")


@dataclass(frozen=True)
class Run:
    """The result of one run of pytest.

    Attributes:
        seconds: Wall time [s].
        code: Exit code of pytest.
        count: Number of tests.
        failed: Times of the tests that failed [s], by name.
    """

    seconds: float
    code: int
    count: int
    failed: dict[str, float]


@contextlib.contextmanager
def busy_processes(count: int) -> Iterator[None]:
    """Runs processes that use as much processor time as they get."""
    processes = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.wait()


def run_tests(number: int, arguments: list[str]) -> Run:
    """Runs pytest once.

    Args:
        number: Number of the run, for the names of its files.
        arguments: Arguments of pytest.
    """
    results, log = FOLDER / f"run-{number}.xml", FOLDER / f"run-{number}.log"
    results.unlink(missing_ok=True)
    start = time.monotonic()
    # As in `make test`: `python -m pytest` would import the package of the checkout.
    pytest = Path(sys.executable).with_name("pytest")
    with log.open("w") as output:
        done = subprocess.run(  # noqa: S603
            [pytest, *arguments, f"--junitxml={results}"],
            stdout=output,
            stderr=subprocess.STDOUT,
            check=False,
        )
    seconds = time.monotonic() - start
    tree = ElementTree.parse(results) if results.exists() else None  # noqa: S314
    cases = list(tree.iter("testcase")) if tree is not None else []
    failed = {
        f"{case.get('classname')}::{case.get('name')}": float(case.get("time", "nan"))
        for case in cases
        if case.find("failure") is not None or case.find("error") is not None
    }
    return Run(seconds, done.returncode, len(cases), failed)


def main() -> int:
    """Runs the tests and prints a line for each run and for each test that failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=20, help="number of runs")
    parser.add_argument("--load", type=int, default=0, help="number of busy processes beside them")
    options, arguments = parser.parse_known_args()
    FOLDER.mkdir(parents=True, exist_ok=True)
    # As SIGINT does, so that the busy processes end with this one.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    failures: dict[str, list[str]] = defaultdict(list)
    unsuccessful = 0
    with busy_processes(options.load):
        for number in range(1, options.runs + 1):
            run = run_tests(number, arguments)
            unsuccessful += run.code != 0
            print(
                f"run {number}: {run.count} tests in {run.seconds:.0f} s, "
                f"{len(run.failed)} failed, exit code {run.code}",
                flush=True,
            )
            for name, seconds in run.failed.items():
                failures[name].append(f"{seconds:.1f} s in run {number}")
    for name, times in sorted(failures.items()):
        print(f"FAILED {name}: {', '.join(times)}")
    print(
        f"{unsuccessful} of {options.runs} runs failed beside {options.load} busy processes; "
        f"the output of each run is in {FOLDER}"
    )
    return 1 if unsuccessful else 0


if __name__ == "__main__":
    sys.exit(main())
