"""Calls the physics engine at random for some time: physics.py SECONDS [SEED]."""

from __future__ import annotations

import ctypes
import faulthandler
import gc
import random
import sys
import time

from physics_calls import CallError, RandomCalls

CALLS = 300
WARM_UP = 0.25  # the share of the time after which the memory must not grow
GROWTH = 0.05  # the largest relative growth that is not a leak
SHORT = 30.0  # a shorter run is a part of the warm-up [s]


class MallocInfo(ctypes.Structure):
    """The result of `mallinfo2` of the C library [bytes]."""

    _fields_ = tuple(
        (name, ctypes.c_size_t)
        for name in (
            *("arena", "ordblks", "smblks", "hblks", "hblkhd"),
            *("usmblks", "fsmblks", "uordblks", "fordblks", "keepcost"),
        )
    )


def memory_in_use() -> tuple[int, int]:
    """Returns the memory allocated by C++ [bytes], and the number of blocks allocated by Python.

    Unlike the resident memory, they do not depend on fragmentation. The address sanitizer has an
    allocator of its own, for which the first number is 0.
    """
    gc.collect()
    get = ctypes.CDLL("libc.so.6").mallinfo2
    get.restype = MallocInfo
    info = get()
    return info.uordblks + info.hblkhd, sys.getallocatedblocks()


def main() -> int:
    """Returns 1 after a failure or with a leak."""
    faulthandler.enable()
    seconds = float(sys.argv[1])
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else random.SystemRandom().randrange(2**40)
    start = time.monotonic()
    runs, calls, errors = 0, 0, 0
    before: tuple[int, int] | None = None
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
        if before is None and time.monotonic() - start > WARM_UP * seconds:
            before = memory_in_use()
    after = memory_in_use()
    before = before or after
    print(f"\n{runs} sequences of {CALLS} calls, {errors} of {calls} calls raised an error;")
    growth = [new / max(old, 1) - 1 for old, new in zip(before, after, strict=True)]
    print(f"growth after the first quarter: C++ {growth[0]:.1%}, Python {growth[1]:.1%}")
    if seconds >= SHORT and max(growth) > GROWTH:
        print("the memory grows")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
