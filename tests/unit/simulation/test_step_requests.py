"""Steps on request: lockstep, additional steps, order, withdrawal and end, without ROS."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Future
from contextlib import contextmanager

import pytest
from waiting import TIMEOUT, wait_until

import flatland
from flatland.simulation import Simulation

pytestmark = pytest.mark.threads

STEP_NS = 10_000_000


@pytest.fixture
def world() -> Iterator[flatland.World]:
    with flatland.World(seed=1, step_size=0.01) as world:
        yield world


@contextmanager
def running(simulation: Simulation) -> Iterator[Simulation]:
    thread = threading.Thread(target=simulation.run)
    thread.start()
    try:
        yield simulation
    finally:
        simulation.stop()
        thread.join(TIMEOUT)
        assert not thread.is_alive()


def blocker(simulation: Simulation) -> tuple[Callable[[], None], Future[bool]]:
    """Blocks the loop in a request until the returned function is called."""
    go = threading.Event()
    return go.set, simulation.post(lambda: go.wait(TIMEOUT))


def test_in_lockstep_time_passes_only_on_request(world: flatland.World) -> None:
    with running(Simulation(world, math.inf, lockstep=True)) as simulation:
        assert simulation.post(lambda: world.time).result(TIMEOUT) == 0
        assert simulation.request_steps(1).result(TIMEOUT) == STEP_NS
        assert simulation.request_steps(25).result(TIMEOUT) == 26 * STEP_NS
        assert simulation.post(lambda: world.time).result(TIMEOUT) == 0.26


def test_requests_before_the_start_are_served_in_lockstep(world: flatland.World) -> None:
    simulation = Simulation(world, lockstep=True)
    done = world.post(lambda: world.time)
    with running(simulation):
        assert done.result(TIMEOUT) == 0


def test_a_paused_world_is_stepped_and_stays_paused(world: flatland.World) -> None:
    for lockstep, rate in ((True, 200.0), (False, 200.0), (False, 0.0), (False, 1e-3)):
        simulation = Simulation(world, rate, lockstep=lockstep)
        world.pause()
        with running(simulation):
            before = simulation.post(lambda: world.timekeeper.sim_time_ns).result(TIMEOUT)
            assert simulation.request_steps(3).result(TIMEOUT) == before + 3 * STEP_NS
            assert simulation.post(lambda: world.paused).result(TIMEOUT)
            now = simulation.post(lambda: world.timekeeper.sim_time_ns).result(TIMEOUT)
            assert now == before + 3 * STEP_NS


def test_additional_steps_of_a_running_world_are_not_delayed(world: flatland.World) -> None:
    with running(Simulation(world, 1e-3)) as simulation:  # The second step is due after 1000 s.
        wait_until("the first step", lambda: world.time == 0.01)
        assert simulation.request_steps(2).result(TIMEOUT) == 3 * STEP_NS


def test_additional_steps_are_not_counted_as_lost_time(world: flatland.World) -> None:
    times = iter(range(10_000))
    simulation = Simulation(world, 1.0, max_lag=0.1, clock=lambda: next(times) * 0.3)
    done = simulation.request_steps(40)  # 80 or more readings of this clock: 24 s
    simulation.run(0.41)
    assert done.result(0) == 40 * STEP_NS
    assert simulation.lost_time == 0


def test_requests_of_several_clients_are_served_in_order(world: flatland.World) -> None:
    with running(Simulation(world, lockstep=True)) as simulation:
        go, _ = blocker(simulation)
        calls = [simulation.request_steps(count) for count in (3, 1, 5)]
        go()
        assert [call.result(TIMEOUT) for call in calls] == [n * STEP_NS for n in (3, 4, 9)]


def test_other_requests_are_served_in_between(world: flatland.World) -> None:
    with running(Simulation(world, lockstep=True)) as simulation:
        steps = simulation.request_steps(10**9)
        for _ in range(3):
            time = simulation.post(lambda: world.time).result(TIMEOUT)
            wait_until("a later time", lambda: world.time > time)  # noqa: B023
        assert not steps.done()


def test_a_cancelled_request_ends_between_two_steps(world: flatland.World) -> None:
    with running(Simulation(world, lockstep=True)) as simulation:
        steps = simulation.request_steps(10**9)
        after = simulation.request_steps(1)
        wait_until("the first steps", lambda: world.time > 0)
        assert steps.cancel()
        time_ns = after.result(TIMEOUT)
        assert simulation.post(lambda: world.timekeeper.sim_time_ns).result(TIMEOUT) == time_ns
        with pytest.raises(CancelledError):
            steps.result(TIMEOUT)


def test_stop_ends_a_long_request_and_those_that_wait(world: flatland.World) -> None:
    simulation = Simulation(world, lockstep=True)
    with running(simulation):
        steps, waiting = simulation.request_steps(10**9), simulation.request_steps(1)
        wait_until("the first steps", lambda: world.time > 0)
    text = r"stopped after \d+ of 1000000000 steps"
    with pytest.raises(flatland.WorldError, match=text):
        steps.result(TIMEOUT)
    with pytest.raises(flatland.WorldError, match="the simulation has stopped"):
        waiting.result(TIMEOUT)
    with pytest.raises(flatland.WorldError, match="the simulation has stopped"):
        simulation.request_steps(1).result(TIMEOUT)


def test_an_error_of_a_step_is_that_of_its_request(world: flatland.World) -> None:
    class Failing(flatland.WorldObserver):
        def step_started(self) -> None:
            raise RuntimeError("broken")

    simulation = Simulation(world, lockstep=True)
    world.add_observer(Failing())
    steps = simulation.request_steps(1)
    with pytest.raises(RuntimeError, match="broken"):
        simulation.run()
    with pytest.raises(RuntimeError, match="broken"):
        steps.result(TIMEOUT)


@pytest.mark.parametrize("count", [0, -1])
def test_less_than_one_step_is_refused(world: flatland.World, count: int) -> None:
    with pytest.raises(ValueError, match="at least 1"):
        Simulation(world).request_steps(count)


def test_the_rate_cannot_be_set_in_lockstep(world: flatland.World) -> None:
    with pytest.raises(flatland.WorldError, match="lockstep"):
        Simulation(world, lockstep=True).set_rate(100)


def test_a_run_in_lockstep_ends_at_its_duration(world: flatland.World) -> None:
    simulation = Simulation(world, lockstep=True)
    simulation.request_steps(2)
    simulation.request_steps(5)
    assert simulation.run(0.03).steps == 7
