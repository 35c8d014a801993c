"""Steps of many worlds over all cores."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from flatland.checks import checked_count
from flatland.physics import run_worlds
from flatland.runtime.stepping import MAX_STEPS

if TYPE_CHECKING:
    from flatland.physics import Run
    from flatland.runtime.stepping import StepRun
    from flatland.world import World

MAX_THREADS: Final = 4096


def step_worlds(worlds: Sequence[World], n: int = 1, num_threads: int = 0) -> None:
    """Steps each of several worlds n times; the same as `for world in worlds: world.step(n)`.

    The core performs the steps of all worlds in parallel and without the GIL; code of plugins and
    observers is called in between, one world after the other. The results do not depend on the
    number of threads.

    Args:
        worlds: The worlds, each at most once.
        n: Number of steps.
        num_threads: Maximum number of threads; 0 for one per core.

    Raises:
        ValueError: A world is given twice, or a number is no integer or negative.
        WorldError: As `World.step`.
        Exception: As `World.step`. If several worlds raise, the exception of the first one is
            raised after all other worlds have been stepped.
    """
    n = checked_count("n", n, 0, MAX_STEPS)
    num_threads = checked_count("num_threads", num_threads, 0, MAX_THREADS)
    if len({id(world) for world in worlds}) != len(worlds):
        raise ValueError("each world must be given at most once")
    batch = _Batch(worlds, n)
    try:
        while batch.left:
            batch.perform(num_threads)
    finally:
        batch.end()
    if batch.errors:
        raise batch.errors[min(batch.errors)]


class _Batch:
    """The steps of several worlds, whose runs advance together.

    Attributes:
        left: Steps that remain to be begun or completed, by the index of the world, in the order in
            which worlds are locked.
        errors: What the worlds raised, by index.
    """

    def __init__(self, worlds: Sequence[World], n: int) -> None:
        self._worlds = worlds
        # Threads that step overlapping sets of worlds lock them in the same order.
        order = sorted(range(len(worlds)), key=lambda index: id(worlds[index]))
        self.left = dict.fromkeys(order, n) if n > 0 else {}
        self.errors: dict[int, BaseException] = {}
        self._runs: dict[int, StepRun] = {}

    def perform(self, num_threads: int) -> None:
        """Performs a run of each world."""
        waiting: dict[int, Run] = {}
        for index, left in list(self.left.items()):
            self._runs[index] = self._worlds[index].stepping.run(left)
            self._advance(index, None, waiting)
        while waiting:
            indices, runs = (
                list(waiting),
                [(self._worlds[index].physics, run) for index, run in waiting.items()],
            )
            waiting = {}
            for index, result in zip(indices, run_worlds(runs, num_threads), strict=True):
                self._advance(index, result, waiting)

    def _advance(self, index: int, result: object, waiting: dict[int, Run]) -> None:
        """Continues the run of a world with what the core returned or raised."""
        run = self._runs[index]
        try:
            if isinstance(result, Exception):
                waiting[index] = run.throw(result)
            else:
                waiting[index] = run.send(result)  # type: ignore[arg-type]  # None at the start
        except StopIteration as end:
            self.left[index] -= end.value
            if not self.left[index]:
                del self.left[index]
        except Exception as error:
            self.errors[index] = error
            del self.left[index]

    def end(self) -> None:
        """Releases the worlds, after an interrupt by the user."""
        for run in self._runs.values():
            run.close()
