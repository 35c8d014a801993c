"""Calls the physics engine at random for some time: physics.py SECONDS [SEED]."""

from __future__ import annotations

import faulthandler
import random
import resource
import sys
import time
from pathlib import Path

from physics_calls import CallError, RandomCalls

CALLS = 300
WARM_UP = 0.25  # the share of the time after which the memory must not grow
GROWTH = 1.05  # the largest growth that is not a leak
SHORT = 30.0  # a shorter run is a part of the warm-up [s]


def resident_memory() -> int:
    """Returns the resident memory of this process [bytes]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize()


def main() -> int:
    """Returns 1 after a failure or with a leak."""
    faulthandler.enable()
    seconds = float(sys.argv[1])
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else random.SystemRandom().randrange(2**40)
    start = time.monotonic()
    runs, calls, errors, before = 0, 0, 0, 0
    while time.monotonic() - start < seconds:
        # The process may crash: the seed is printed before the calls.
        print(f"\rseed {seed + runs}", end="", flush=True)
        sequence = RandomCalls(seed + runs)
        try:
            sequence.run(CALLS)
        except CallError as failure:
            print(f"\nRandomCalls({seed + runs}).run({CALLS}) fails: {failure}")
            return 1
        runs, calls, errors = runs + 1, calls + sequence.calls, errors + sequence.errors
        if not before and time.monotonic() - start > WARM_UP * seconds:
            before = resident_memory()
    after = resident_memory()
    print(f"\n{runs} sequences of {CALLS} calls, {errors} of {calls} calls raised an error;")
    print(f"memory: {before / 1e6:.1f} MB after {WARM_UP:.0%}, {after / 1e6:.1f} MB at the end")
    if seconds >= SHORT and after > GROWTH * before:
        print("the memory grows")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
