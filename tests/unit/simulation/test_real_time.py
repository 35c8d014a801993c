"""The timing of the loop with a fake clock: lag that is caught up on, and lag that is dropped."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import pytest

import flatland
from flatland.simulation import MAX_LAG, Simulation

# Powers of two: sums of times are exact.
RATE = 128.0
PERIOD = 1 / RATE
LAG = 16 * PERIOD


class Load(flatland.WorldObserver):
    """Spends time in each step and records its start, relative to the first one [periods]."""

    def __init__(self, fake_time: Any) -> None:
        self.cost: Callable[[int], float] = lambda step: 0.0  # periods
        self.starts: list[float] = []
        self._time = fake_time
        self._first = fake_time.now

    def time_advanced(self, time_ns: int) -> None:
        self.starts.append((self._time.now - self._first) / PERIOD)
        self._time.spend(self.cost(len(self.starts) - 1) * PERIOD)


@pytest.fixture
def load(fake_time: Any) -> Load:
    return Load(fake_time)


@pytest.fixture
def world(load: Load) -> Iterator[flatland.World]:
    with flatland.World(seed=1, step_size=PERIOD, observers=[load]) as world:
        yield world


@pytest.fixture
def simulate(world: flatland.World, fake_time: Any) -> Callable[..., Simulation]:
    def make(**options: Any) -> Simulation:
        options = {"update_rate": RATE, "max_lag": LAG, **options}
        return Simulation(world, clock=fake_time.clock, wait=fake_time.wait, **options)

    return make


def run(simulation: Simulation, steps: int) -> float:
    """Runs some steps and returns their wall time [periods]."""
    result = simulation.run(steps * PERIOD)
    assert result.steps == steps
    return result.wall_time / PERIOD


def test_the_loop_catches_up_exactly(simulate: Any, load: Load) -> None:
    load.cost = lambda step: 12.0 if step == 10 else 0.0
    assert run(simulate(), 100) == 100
    expected: list[float] = list(range(100))
    expected[11:23] = [22] * 12  # steps 11 to 22 are due during step 10
    assert load.starts == expected


def test_burst_is_not_longer_than_max_lag(simulate: Any, load: Load) -> None:
    load.cost = lambda step: 1000.0 if step == 10 else 0.0
    total = run(simulate(), 100)
    # Of the lag of 999 periods, 16 are caught up on; one more step is due at that time.
    assert load.starts[11:28] == [1010] * 17
    assert load.starts[28:] == [1010 + step for step in range(1, 73)]
    assert total == 100 + 999 - 16


@pytest.mark.parametrize("lost", [1, 12, 1000])
def test_without_max_lag_the_loop_catches_up_on_one_cycle(
    simulate: Any, load: Load, lost: int
) -> None:
    load.cost = lambda step: 1.0 + lost if step == 10 else 0.0
    total = run(simulate(max_lag=0), 100)
    made_up = 1 if lost == 1 else 0
    assert total == 100 + lost - made_up
    assert load.starts[11:15] == [11 + lost + max(0, step - made_up) for step in range(4)]


def test_change_of_the_rate_drops_the_lag(simulate: Any, world: flatland.World, load: Load) -> None:
    simulation = simulate()

    def cost(step: int) -> float:
        if step == 12:
            world.post(lambda: simulation.set_rate(RATE / 2))
        return 12.0 if step == 10 else 0.0

    load.cost = cost
    run(simulation, 20)
    assert load.starts[10:14] == [10, 22, 22, 22]
    assert load.starts[14:] == [24, 26, 28, 30, 32, 34]


def test_pause_drops_the_lag(simulate: Any, world: flatland.World, load: Load) -> None:
    simulation = simulate()
    cycles = []

    def resume_later() -> None:
        cycles.append(None)
        if len(cycles) == 5:
            world.resume()
        else:
            world.post(resume_later)

    def cost(step: int) -> float:
        if step == 12:
            world.post(world.pause)
            world.post(resume_later)
        return 12.0 if step == 10 else 0.0

    load.cost = cost
    run(simulation, 20)
    assert load.starts[10:13] == [10, 22, 22]
    resumed = load.starts[13]
    assert resumed >= 23
    assert load.starts[13:] == [resumed + step for step in range(7)]


def test_the_loop_catches_up_after_a_long_request(
    simulate: Any, fake_time: Any, load: Load
) -> None:
    simulation = simulate()

    def cost(step: int) -> float:
        if step == 10:
            simulation.post(lambda: fake_time.spend(1000 * PERIOD))
        return 0.0

    load.cost = cost
    run(simulation, 100)
    assert load.starts[10:13] == [10, 1010, 1010]
    assert load.starts.count(1010) == 17
    assert load.starts[28:31] == [1011, 1012, 1013]


@pytest.mark.parametrize("lag", [-1e-9, math.nan, math.inf, -math.inf])
def test_an_invalid_lag_raises(world: flatland.World, lag: float) -> None:
    with pytest.raises(ValueError, match=r"^max_lag must be finite and not negative \[s\], got "):
        Simulation(world, max_lag=lag)


def test_default_max_lag(world: flatland.World, fake_time: Any, load: Load) -> None:
    load.cost = lambda step: 1000.0 if step == 10 else 0.0
    run(Simulation(world, RATE, clock=fake_time.clock, wait=fake_time.wait), 100)
    assert load.starts.count(1010) == math.floor(MAX_LAG / PERIOD) + 1
