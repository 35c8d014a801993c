"""Steps of many worlds over all cores."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from typing import TYPE_CHECKING

from flatland.physics import run_worlds

if TYPE_CHECKING:
    from flatland.world import World


def step_worlds(worlds: Sequence[World], n: int = 1, num_threads: int = 0) -> None:
    """Steps each of several worlds n times; the same as `for world in worlds: world.step(n)`.

    Steps in which no hook is due are performed in the core, with the worlds in parallel and
    without the GIL; the results do not depend on the number of threads. Worlds that are observed,
    recorded or paused, and those with hooks that are called in every step, are stepped one after
    the other.

    Args:
        worlds: The worlds, each at most once.
        n: Number of steps.
        num_threads: Maximum number of threads; 0 for one per core.

    Raises:
        ValueError: A world is given twice, or the number of threads is negative.
        WorldError: As `World.step`.
        Exception: As `World.step`. If several worlds raise, the exception of the first one is
            raised after all other worlds have been stepped.
    """
    if num_threads < 0:
        raise ValueError(f"num_threads must not be negative, got {num_threads}")
    if len({id(world) for world in worlds}) != len(worlds):
        raise ValueError("each world must be given at most once")
    batch = _Batch(worlds, n)
    while batch.left:
        batch.run(num_threads)
    if batch.errors:
        raise batch.errors[min(batch.errors)]


class _Batch:
    """Steps that remain to be performed.

    Attributes:
        left: Steps by the index of the world, in the order in which worlds are locked.
        errors: What the worlds raised, by index.
    """

    def __init__(self, worlds: Sequence[World], n: int) -> None:
        self._worlds = worlds
        # Threads that step overlapping sets of worlds lock them in the same order.
        order = sorted(range(len(worlds)), key=lambda index: id(worlds[index]))
        self.left = dict.fromkeys(order, n) if n > 0 else {}
        self.errors: dict[int, BaseException] = {}

    def run(self, num_threads: int) -> None:
        """Performs steps in the core as far as possible, and then those that call hooks."""
        with ExitStack() as locks:
            runs = {}
            for index in list(self.left):
                try:
                    run = self._worlds[index].stepping.begin_batch(self.left[index], locks)
                except Exception as error:
                    self._fail(index, error)
                    continue
                if run is not None:
                    runs[index] = run
            results = run_worlds(list(runs.values()), num_threads)
            for (index, run), result in zip(runs.items(), results, strict=True):
                try:
                    made = self._worlds[index].stepping.end_batch(run, result)
                except Exception as error:
                    self._fail(index, error)
                else:
                    self._take(index, made)
        for index in [index for index in self.left if index not in runs]:
            try:
                self._worlds[index].step(self.left[index])
            except Exception as error:
                self._fail(index, error)
            else:
                del self.left[index]

    def _take(self, index: int, made: int) -> None:
        self.left[index] -= made
        if not self.left[index]:
            del self.left[index]

    def _fail(self, index: int, error: Exception) -> None:
        self.errors[index] = error
        del self.left[index]
