"""Steps of many worlds over all cores."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from typing import TYPE_CHECKING

from flatland.physics import run_worlds

if TYPE_CHECKING:
    from flatland.world import World


def step_worlds(worlds: Sequence[World], n: int = 1, num_threads: int = 0) -> None:
    """Steps each of some worlds n times; the same as `for world in worlds: world.step(n)`.

    Steps in which no code of plugins is due are made in the core, with the worlds in parallel and
    without the GIL; the results do not depend on the number of threads. Worlds that are observed or
    recorded are stepped one after the other.

    Args:
        worlds: The worlds, each at most once.
        n: Number of steps.
        num_threads: Maximum number of threads; 0 for all processors.

    Raises:
        ValueError: A world is given twice, or the number of threads is negative.
        WorldError: As `World.step`.
        Exception: As `World.step`. If worlds raise, the first exception in their order is raised
            when all other worlds have made their steps.
    """
    if num_threads < 0:
        raise ValueError(f"num_threads must not be negative, got {num_threads}")
    if len({id(world) for world in worlds}) != len(worlds):
        raise ValueError("each world must be given at most once")
    left = {index: n for index in range(len(worlds))} if n > 0 else {}
    errors: dict[int, BaseException] = {}
    # Threads that step overlapping sets of worlds take their locks in the same order.
    by_address = sorted(left, key=lambda index: id(worlds[index]))
    while left:
        with ExitStack() as locks:
            runs, prepared = [], []
            for index in by_address:
                if index not in left:
                    continue
                try:
                    run = worlds[index]._begin_run(left[index], locks)
                except Exception as error:
                    errors[index] = error
                    del left[index]
                    continue
                if run is not None:
                    runs.append(run)
                    prepared.append(index)
            results = run_worlds(runs, num_threads)
            for index, result in zip(prepared, results, strict=True):
                ...
    if errors:
        raise errors[min(errors)]
