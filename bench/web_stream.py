"""The server of the viewer in the browser: bandwidth, processor time, and the cost of nobody."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import flatland
from flatland.simulation import Simulation
from flatland.web import WebViewer

from crowd import MAX_ROBOTS, crowd  # isort: skip
from table import Row

STEP_SIZE = 0.005  # s
WINDOW = 2.0  # s of wall time
WINDOWS = 8
STEPS = 200  # of the comparison without clients
REPETITIONS = 40


class Shares:
    """Processor time of the viewer in both threads.

    The simulation is charged with everything that its thread carries out for the viewer between two
    steps.
    """

    def __init__(self, world: flatland.World, viewer: WebViewer) -> None:
        self.requests = 0.0  # s
        self.longest = 0.0  # s
        self._clock = time.pthread_getcpuclockid(_thread("flatland-web").ident or 0)
        process = world.requests.process

        def timed() -> None:
            start = time.thread_time()
            process()
            spent = time.thread_time() - start
            self.requests += spent
            self.longest = max(self.longest, spent)

        world.requests.process = timed  # type: ignore[method-assign]

    def total(self) -> float:
        """Returns the processor time since the start [s]."""
        return self.requests + time.clock_gettime(self._clock)


def rows(_unit: float) -> list[Row]:
    """Measures 100 robots with 360 beams each at 10 Hz, for one client that looks at all scans."""
    # Without scans, the pool of threads does not disturb the comparison.
    with crowd(slice(None), scans=False) as world, WebViewer(port=0) as viewer:
        unseen, plain = _without_clients(world, viewer)
    with crowd(slice(None), scans=True) as world, WebViewer(port=0) as viewer:
        viewer.add_world(world, simulation=(simulation := Simulation(world, 1 / STEP_SIZE)))
        shares = Shares(world, viewer)
        thread = threading.Thread(target=simulation.run)
        thread.start()
        try:
            with _watcher(viewer.url) as received:
                bandwidth, share = _watched(received, shares)
        finally:
            simulation.stop()
            thread.join()
    what = f"{MAX_ROBOTS} robots with 360 beams at 10 Hz"
    return [
        Row(f"web: {what}, per client", bandwidth / 1e6, "MB/s", 0.9),
        Row(
            f"web: {what}, share of a core",
            100 * share,
            "%",
            3.0,
            note=f"both threads; at most {1e3 * shares.longest:.2f} ms between two steps",
        ),
        Row("web: steps with a viewer and no client", unseen / plain, "times without", 1.03),
    ]


def _watched(received: Callable[[], tuple[int, float]], shares: Shares) -> tuple[float, float]:
    """Returns the bytes per second, and the least share of a core of all windows."""
    least, (bytes_start, start) = float("inf"), received()
    shares.longest = 0.0
    for _ in range(WINDOWS):
        before, begin = shares.total(), time.perf_counter()
        time.sleep(WINDOW)
        least = min(least, (shares.total() - before) / (time.perf_counter() - begin))
    bytes_end, end = received()
    return (bytes_end - bytes_start) / (end - start), least


def _without_clients(world: flatland.World, viewer: WebViewer) -> tuple[float, float]:
    """Returns the least processor times of some steps with and without a viewer [s]."""
    unseen = plain = float("inf")
    for _ in range(REPETITIONS):
        handle = viewer.add_world(world)
        unseen = min(unseen, _step_time(world))
        viewer.remove_world(handle)
        world.between_steps(lambda: None)  # The observer of the viewer is removed.
        plain = min(plain, _step_time(world))
    return unseen, plain


def _step_time(world: flatland.World) -> float:
    """Returns the least processor time of some steps [s]."""
    least = float("inf")
    for _ in range(5):
        start = time.thread_time()
        world.step(STEPS)
        least = min(least, time.thread_time() - start)
    return least


@contextmanager
def _watcher(url: str) -> Iterator[Callable[[], tuple[int, float]]]:
    """Starts a client; yields a function that returns what `watcher.py` prints."""
    program = Path(__file__).with_name("watcher.py")
    process = subprocess.Popen(
        [sys.executable, str(program), url],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    pipe_in, pipe_out = process.stdin, process.stdout
    assert pipe_in is not None
    assert pipe_out is not None

    def received() -> tuple[int, float]:
        pipe_in.write("\n")
        pipe_in.flush()
        size, arrival = pipe_out.readline().split()
        return int(size), float(arrival)

    try:
        received()
        time.sleep(1.0)  # until the models and edges have arrived
        yield received
    finally:
        pipe_in.close()
        process.wait(30)
        pipe_out.close()


def _thread(name: str) -> threading.Thread:
    return next(thread for thread in threading.enumerate() if thread.name == name)
