"""Worlds in threads: they are independent, locked during a step, and deterministic."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from programs import run_program
from waiting import TIMEOUT

from flatland.errors import PhysicsError, StaleHandleError, WorldLockedError
from flatland.physics import (
    OldManifold,
    PhysicsBody,
    PhysicsWorld,
    PreSolveContact,
    RangeFinder,
    ScanRequest,
    boundary_edges,
    scan_all,
)

pytestmark = pytest.mark.threads
FINDER = RangeFinder([[1, 0]], 1.0, origin=(0, 0, 0), mask=1)


def crowd(seed: int) -> tuple[PhysicsWorld, list[PhysicsBody]]:
    """Creates bodies that collide with each other within four walls."""
    rng = np.random.default_rng(seed)
    world = PhysicsWorld()
    world.record_contacts = True
    wall = world.create_body("static", (0, 0, 0))
    wall.create_edges([[-4, -4, 4, -4], [4, -4, 4, 4], [4, 4, -4, 4], [-4, 4, -4, -4]])
    bodies = []
    for _ in range(20):
        body = world.create_body("dynamic", (*rng.uniform(-3, 3, 2), rng.uniform(-3, 3)))
        if rng.random() < 0.5:
            body.create_circle((0, 0), 0.3, density=1, restitution=0.9)
        else:
            body.create_polygon(rng.uniform(-0.4, 0.4, (6, 2)), density=1, friction=0.5)
        body.set_velocity(*rng.uniform(-3, 3, 3))
        bodies.append(body)
    return world, bodies


def history(seed: int, steps: int = 150) -> bytes:
    """Returns the observable state of each step of a run as bytes."""
    world, bodies = crowd(seed)
    angles = np.linspace(-np.pi, np.pi, 90)
    ends = 6 * np.stack([np.cos(angles), np.sin(angles)], 1).astype(np.float32)
    seen = []
    for _ in range(steps):
        world.step(0.01, 8, 3)
        seen.append(np.array([(*b.pose, *b.velocity) for b in bodies]).tobytes())
        seen.append(b"".join(a.tobytes() for a in world.cast_rays(bodies[0].pose, ends, 0xFFFF, 2)))
        for event in world.take_contact_events():
            ids = (event.contact_id, event.fixture_a, event.fixture_b)
            seen.append(f"{event.kind}{ids}".encode())
            seen.append(event.points.tobytes() + event.normal_impulses.tobytes())
    return b"".join(seen)


def test_parallel_worlds_have_the_same_results_as_sequential_ones() -> None:
    """Those in threads are first: Box2D fills a table at the first contact of a process."""
    seeds = range(8)
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(history, seeds))
    alone = [history(seed) for seed in seeds]
    assert together == alone
    assert len(set(alone)) == len(seeds)


class SlowStep:
    """A world that remains in a step until it is released.

    The step runs without the GIL and is blocked in a pre-solve hook, which waits for an event.
    """

    def __init__(self) -> None:
        self.world = PhysicsWorld()
        self.disc = self.world.create_body("dynamic", (0, 0, 0))
        self.disc.create_circle((0, 0), 1, density=1)
        self.wall = self.world.create_body("static", (0, 0, 0))
        self.wall.create_edges([[0.5, -1, 0.5, 1]])
        self.inside = threading.Event()
        self.release = threading.Event()
        self.world.pre_solve = self._block
        self.world.pre_solve_bodies = {self.disc.id}
        self._thread = threading.Thread(target=self.world.step, args=(0.01, 5, 5))

    def _block(self, _contact: PreSolveContact, _old: OldManifold) -> None:
        self.inside.set()
        assert self.release.wait(TIMEOUT)

    def __enter__(self) -> SlowStep:
        self._thread.start()
        assert self.inside.wait(TIMEOUT)
        return self

    def __exit__(self, *_: object) -> None:
        self.release.set()
        self._thread.join()


@pytest.fixture
def slow() -> Iterator[SlowStep]:
    with SlowStep() as slow:
        yield slow


def test_a_stepping_world_is_locked_for_other_threads(slow: SlowStep) -> None:
    """A hook of `pre_solve` cannot change it either, see `test_contacts.py`."""
    world, disc = slow.world, slow.disc
    uses: list[Callable[[], object]] = [
        lambda: disc.pose,
        lambda: disc.velocity,
        lambda: disc.set_pose(0, 0, 0),
        lambda: disc.fixtures,
        lambda: world.create_weld_joint(disc, slow.wall, (0, 0), (0, 0)),
        lambda: world.ray_cast((0, 0), (1, 0)),
        lambda: world.free_discs([(0, 0, 0)], 1, 1),
        lambda: world.overlapping_bodies([disc], (0, 0, 0)),
        lambda: FINDER.scan(disc, 0, 0),
        lambda: scan_all([ScanRequest(FINDER, disc, 0, 0)] * 3),
        lambda: world.contacts(),
    ]
    for use in uses:
        with pytest.raises(WorldLockedError, match="the world is stepping"):
            use()


def test_other_worlds_can_step_while_one_is_stepping(slow: SlowStep) -> None:
    assert len(history(3, steps=5)) > 0


def releases_gil(work: Callable[[], object]) -> bool:
    """Returns whether another Python thread runs during a call of `work`.

    With a very long switch interval, the interpreter switches threads only if the GIL is released.
    On a busy machine the other thread may start too late for one call, so `work` is repeated.
    """
    end = time.monotonic() + TIMEOUT
    while not _runs_another_thread(work):
        if time.monotonic() > end:
            return False
    return True


def _runs_another_thread(work: Callable[[], object]) -> bool:
    ticks = 0
    stop = threading.Event()

    def tick() -> None:
        nonlocal ticks
        while not stop.is_set():
            ticks += 1
            time.sleep(0)

    interval = sys.getswitchinterval()
    sys.setswitchinterval(60)
    thread = threading.Thread(target=tick)
    try:
        thread.start()
        before = ticks
        work()
        after = ticks
    finally:
        sys.setswitchinterval(interval)
        stop.set()
        thread.join()
    return after > before


def test_long_calls_release_the_gil() -> None:
    world = PhysicsWorld()
    # Unlike with a static body, the step is long: Box2D searches the neighbors of each edge.
    wall = world.create_body("kinematic", (0, 0, 0))
    rng = np.random.default_rng(1)
    start = rng.uniform(0, 100, (10_000, 2))
    edges = np.hstack([start, start + 0.5]).astype(np.float32)
    ends = rng.uniform(-50, 50, (50_000, 2)).astype(np.float32)
    mask = np.indices((400, 400)).sum(axis=0) % 2 == 0
    assert releases_gil(lambda: boundary_edges(mask, 1.0))
    assert releases_gil(lambda: wall.create_edges(edges))
    assert releases_gil(lambda: world.step(0.01, 1, 1))
    assert releases_gil(lambda: world.cast_rays((50, 50, 0), ends, 0xFFFF))
    finder = RangeFinder(ends, 50.0, origin=(0, 0, 0), mask=0xFFFF)
    assert releases_gil(lambda: [finder.scan(wall, 0, 0) for _ in range(10)])
    assert releases_gil(lambda: scan_all([ScanRequest(finder, wall, 0, 0)] * 10, num_threads=2))
    assert releases_gil(lambda: world.cast_rays_reference((50, 50, 0), ends[:5_000], 0xFFFF))
    assert not _runs_another_thread(lambda: sum(range(1000))), "the check must be able to fail"


# Scans in a process in which the garbage collector runs often and lets another thread step.
COLLECTS_GARBAGE_DURING_SCANS = """
import gc
import threading
import time

from flatland.errors import WorldLockedError
from flatland.physics import PhysicsWorld, RangeFinder, ScanRequest, scan_all

world = PhysicsWorld()
body = world.create_body("dynamic", (0, 0, 0))
finder = RangeFinder([[1, 0]], 1.0, origin=(0, 0, 0), mask=1)
requests = [ScanRequest(finder, body, 0, 0)] * 300
is_done = False
steps = []

def step():
    while not is_done:
        world.step(0.01, 1, 1)
        steps.append(1)
        time.sleep(1e-4)

world.step(0.01, 1, 1)  # the first step releases the GIL, and a scan in it would be refused
thread = threading.Thread(target=step, daemon=True)
thread.start()
gc.callbacks.append(lambda phase, info: time.sleep(1e-3))
gc.set_threshold(1)
scans, during = [], 0
while not (scans and during):
    before = len(steps)
    try:
        scans = scan_all(requests)
        during = len(steps) - before
    except WorldLockedError:  # during a step that releases the GIL, such as the first one
        pass
assert len(scans) == 300
gc.callbacks.clear()
is_done = True
thread.join()
print("done")
"""


def test_a_world_can_be_changed_while_a_scan_waits_for_the_garbage_collector() -> None:
    """In a process of its own: a change that waits for the end of the scan holds the GIL."""
    command = [sys.executable, "-c", COLLECTS_GARBAGE_DURING_SCANS]
    result = run_program(command)
    assert (result.stdout, result.returncode) == ("done\n", 0), result.stderr


def test_several_threads_cast_rays_in_one_world() -> None:
    world, bodies = crowd(9)
    rng = np.random.default_rng(1)
    fans = [rng.uniform(-9, 9, (50 + i, 2)).astype(np.float32) for i in range(40)]
    poses = [body.pose for body in bodies]
    expected = [world.cast_rays_reference(pose, fan, 0xFFFF)[0] for pose in poses for fan in fans]
    jobs = [(pose, fan) for pose in poses for fan in fans]
    world.create_body("static", (0, 0, 0)).create_edges([[20, 20, 30, 30]])  # rebuilds the tree
    with ThreadPoolExecutor(4) as pool:
        got = list(pool.map(lambda job: world.cast_rays(job[0], job[1], 0xFFFF)[0], jobs))
    for fast, slow in zip(got, expected, strict=True):
        np.testing.assert_allclose(fast, slow, atol=1e-5)


def test_scans_beside_steps_spawns_deletions_and_closes() -> None:
    """Threads scan and query one world after the other while another thread changes and closes it.

    Scans are long and short, with and without the GIL. They fail only because the world is stepping
    or closed.
    """
    seed = 1
    rng = np.random.default_rng(seed)
    angles = np.linspace(-np.pi, np.pi, 5000)
    fan = 8 * np.stack([np.cos(angles), np.sin(angles)], 1).astype(np.float32)
    poses = rng.uniform(-4, 4, (300, 3))
    finder = RangeFinder(fan[::20], 8.0, origin=(0, 0, 0), mask=0xFFFF, reflect_mask=1)
    # Another world is used together with each of them.
    current, other = [crowd(seed)], crowd(seed)[1][0]
    stop = threading.Event()
    done = [0, 0, 0, 0]
    refused: set[type[PhysicsError]] = set()

    def scan(number: int) -> None:
        while not stop.wait(1e-5):
            world, bodies = current[0]
            try:
                if number == 3:
                    requests = [ScanRequest(finder, body, 1, 1) for body in (other, bodies[0])]
                    scan_all(requests * 20, num_threads=3)
                elif number == 2:
                    world.free_discs(poses, 0.2, 0xFFFF)
                    world.object_counts()
                else:
                    world.cast_rays((0, 0, 0), fan[: 5000 if number else 100], 0xFFFF, 1)
            except PhysicsError as error:
                refused.add(type(error))
                continue
            done[number] += 1

    def change(world: PhysicsWorld) -> None:
        spawned: list[PhysicsBody] = []
        for _ in range(20):
            world.step(0.01, 4, 2)
            body = world.create_body("dynamic", (*rng.uniform(-3, 3, 2), 0))
            body.create_circle((0, 0), 0.2, density=1)
            wall = world.create_body("static", (*rng.uniform(-3, 3, 2), 0))
            wall.create_edges(rng.uniform(-1, 1, (5, 4)))
            joint = world.create_revolute_joint(body, wall, (0, 0), (0, 0))
            spawned += [body, wall]
            spawned[0].set_pose(*rng.uniform(-3, 3, 3))
            if rng.random() < 0.5:
                joint.destroy()
            spawned.pop(int(rng.integers(len(spawned)))).destroy()

    threads = [threading.Thread(target=scan, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    worlds = 0
    deadline = time.monotonic() + TIMEOUT
    try:
        while (worlds < 10 or min(done) < 10) and time.monotonic() < deadline:
            change(current[0][0])
            old, current[0] = current[0][0], crowd(seed + worlds)
            old.close()
            worlds += 1
    finally:
        stop.set()
        for thread in threads:
            thread.join()
    assert min(done) >= 10
    assert refused <= {WorldLockedError, StaleHandleError}
