"""The pace of the loop in a time of its own: what is made up for, what is dropped, the warning."""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

import flatland
from flatland.plugins.diff_drive import DiffDrive
from flatland.plugins.laser import Laser
from flatland.runtime.plugin_costs import PluginCosts
from flatland.runtime.plugin_host import PluginHost
from flatland.simulation import MAX_LAG, Simulation, rate_monitor

# Powers of two, so that sums of times are exact.
RATE = 128.0
PERIOD = 1 / RATE
LAG = 16 * PERIOD


class FakeTime:
    """A wall clock that only moves in waits and where a test spends time."""

    def __init__(self) -> None:
        self.now = 1024.0

    def clock(self) -> float:
        return self.now

    def wait(self, event: threading.Event, seconds: float) -> bool:
        assert seconds > 0
        if not event.is_set():
            self.now += seconds
        return event.is_set()

    def spend(self, seconds: float) -> None:
        self.now += seconds


class Load(flatland.WorldObserver):
    """Spends time in each step and records when it started, relative to the first one [periods]."""

    def __init__(self, time: FakeTime) -> None:
        self.cost: Callable[[int], float] = lambda step: 0.0  # periods
        self.starts: list[float] = []
        self._time = time
        self._first = time.now

    def time_advanced(self, time_ns: int) -> None:
        self.starts.append((self._time.now - self._first) / PERIOD)
        self._time.spend(self.cost(len(self.starts) - 1) * PERIOD)


@pytest.fixture
def time() -> FakeTime:
    return FakeTime()


@pytest.fixture
def load(time: FakeTime) -> Load:
    return Load(time)


@pytest.fixture
def world(load: Load) -> Iterator[flatland.World]:
    with flatland.World(seed=1, step_size=PERIOD, observers=[load]) as world:
        yield world


@pytest.fixture
def simulate(world: flatland.World, time: FakeTime) -> Callable[..., Simulation]:
    def make(**options: Any) -> Simulation:
        options = {"update_rate": RATE, "max_lag": LAG, **options}
        return Simulation(world, clock=time.clock, wait=time.wait, **options)

    return make


def run(simulation: Simulation, steps: int) -> float:
    """Runs some steps and returns their wall time [periods]."""
    result = simulation.run(steps * PERIOD)
    assert result.steps == steps
    return result.wall_time / PERIOD


def test_lost_time_is_made_up_for_exactly(simulate: Any, load: Load) -> None:
    load.cost = lambda step: 12.0 if step == 10 else 0.0
    assert run(simulate(), 100) == 100
    expected: list[float] = list(range(100))
    expected[11:23] = [22] * 12  # steps 11 to 22 are due while step 10 lasts
    assert load.starts == expected


def test_work_that_comes_all_in_one_step_does_not_change_the_rate(
    simulate: Any, load: Load
) -> None:
    # As a hundred lasers at a tenth of the rate; 90 % of the time are spent.
    load.cost = lambda step: 7.125 if step % 10 == 0 else 0.1875
    assert run(simulate(), 1000) == 1000


def test_burst_is_not_longer_than_max_lag(simulate: Any, load: Load) -> None:
    load.cost = lambda step: 1000.0 if step == 10 else 0.0
    total = run(simulate(), 100)
    # Of the 999 periods that are lost, 16 are made up for; one more step is due at that time.
    assert load.starts[11:28] == [1010] * 17
    assert load.starts[28:] == [1010 + step for step in range(1, 73)]
    assert total == 100 + 999 - 16


def test_overload_leaves_a_burst_of_max_lag_at_most(simulate: Any, load: Load) -> None:
    load.cost = lambda step: 2.0 if step < 200 else 0.0
    run(simulate(), 300)
    assert load.starts[:201] == [2 * step for step in range(201)]
    assert load.starts.count(400) == 17
    assert load.starts[-1] == 400 + 300 - 217


@pytest.mark.parametrize("lost", [1, 12, 1000])
def test_without_lag_one_cycle_is_made_up_for(simulate: Any, load: Load, lost: int) -> None:
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


def test_long_request_is_made_up_for_like_a_long_step(
    simulate: Any, time: FakeTime, load: Load
) -> None:
    simulation = simulate()

    def cost(step: int) -> float:
        if step == 10:
            simulation.post(lambda: time.spend(1000 * PERIOD))
        return 0.0

    load.cost = cost
    run(simulation, 100)
    assert load.starts[10:13] == [10, 1010, 1010]
    assert load.starts.count(1010) == 17
    assert load.starts[28:31] == [1011, 1012, 1013]


@pytest.mark.parametrize("lag", [-1e-9, math.nan, math.inf, -math.inf])
def test_invalid_lag_is_refused(world: flatland.World, lag: float) -> None:
    with pytest.raises(ValueError, match=r"^max_lag must be finite and not negative \[s\], got "):
        Simulation(world, max_lag=lag)


def test_default_lag(world: flatland.World, time: FakeTime, load: Load) -> None:
    load.cost = lambda step: 1000.0 if step == 10 else 0.0
    run(Simulation(world, RATE, clock=time.clock, wait=time.wait), 100)
    assert load.starts.count(1010) == math.floor(MAX_LAG / PERIOD) + 1


# -- the warning ------------------------------------------------------------------------------

MODEL = """
bodies:
  - {name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}
plugins:
  - {type: DiffDrive, name: drive, body: base}
  - {type: Laser, name: laser, body: base, range: 5, angle: {min: 0, max: 1, increment: 0.5}}
"""
WORLD = """
properties: {{}}
layers: [{{name: 2d}}]
models: {models}
"""
DRIVE_COST = 0.25  # periods in each of its two hooks


@pytest.fixture
def fleet(
    files: Any, time: FakeTime, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., flatland.World]:
    """Loads robots whose plugins spend a known time: drives little, lasers by their robots."""

    def loaded(*scan_costs: float) -> flatland.World:
        def scan(laser: Laser, _timekeeper: object) -> None:
            time.spend(scan_costs[int(laser.model.name)] * PERIOD)

        def drive(_drive: DiffDrive, _timekeeper: object) -> None:
            time.spend(DRIVE_COST * PERIOD)

        monkeypatch.setattr(Laser, "before_physics_step", scan)
        monkeypatch.setattr(DiffDrive, "before_physics_step", drive)
        monkeypatch.setattr(DiffDrive, "after_physics_step", drive)
        files.write("robot.model.yaml", MODEL)
        models = [{"name": str(i), "model": "robot.model.yaml"} for i in range(len(scan_costs))]
        world: flatland.World = files.load(WORLD.format(models=models), step_size=PERIOD)
        return world

    return loaded


def warnings(caplog: pytest.LogCaptureFixture) -> list[str]:
    return [
        record.getMessage()
        for record in caplog.records
        if record.levelno == logging.WARNING and "cannot be held" in record.getMessage()
    ]


def run_fleet(world: flatland.World, time: FakeTime, seconds: float, **options: Any) -> None:
    """Runs a world for some wall time."""
    options = {"update_rate": RATE, "max_lag": LAG, **options}
    simulation = Simulation(world, clock=time.clock, wait=time.wait, **options)
    end = time.now + seconds

    class End(flatland.WorldObserver):
        def time_advanced(self, time_ns: int) -> None:
            if time.now >= end:
                simulation.stop()

    world.add_observer(End())
    simulation.run()


def test_one_warning_names_the_most_expensive_plugins(
    fleet: Any, time: FakeTime, caplog: pytest.LogCaptureFixture
) -> None:
    # Each step takes 4 periods: 0.5, 1.5 and 0.5 of lasers, and 0.5 of each of 3 drives.
    world = fleet(0.25, 1.5, 0.75)
    run_fleet(world, time, rate_monitor.WARNING_PERIOD - 1)
    (text,) = warnings(caplog)
    assert text.startswith(
        "the update rate of 128 Hz cannot be held: 32.0 steps a second. Steps take "
        "100 % of the wall time, and the loop has a processor for "
    )
    assert text.endswith(
        "% of it. The most expensive plugins, in percent of the wall time: "
        'Model Plugin "laser" type "Laser" model "1" 37.5 %, '
        'Model Plugin "laser" type "Laser" model "2" 18.8 %, '
        'Model Plugin "drive" type "DiffDrive" model "0" 12.5 %; '
        "by type: 3 x Laser 62.5 %, 3 x DiffDrive 37.5 %"
    )


def test_types_are_only_added_where_plugins_share_one(
    fleet: Any, time: FakeTime, caplog: pytest.LogCaptureFixture
) -> None:
    run_fleet(fleet(3.5), time, 10)
    (text,) = warnings(caplog)
    assert text.endswith(
        'Model Plugin "laser" type "Laser" model "0" 87.5 %, '
        'Model Plugin "drive" type "DiffDrive" model "0" 12.5 %'
    )


def test_warning_comes_again_after_a_while_and_after_a_change_of_the_rate(
    fleet: Any, time: FakeTime, caplog: pytest.LogCaptureFixture
) -> None:
    world = fleet(3.5)
    run_fleet(world, time, rate_monitor.WARNING_PERIOD + 5)
    assert len(warnings(caplog)) == 2
    caplog.clear()
    simulation = Simulation(world, RATE, clock=time.clock, wait=time.wait)
    start = time.now

    class Switch(flatland.WorldObserver):
        def time_advanced(self, time_ns: int) -> None:
            if time.now > start + 5:
                simulation.set_rate(2 * RATE)
            if time.now > start + 10:
                simulation.stop()

    world.add_observer(Switch())
    simulation.run()
    first, second = warnings(caplog)
    assert first.startswith("the update rate of 128 Hz")
    assert second.startswith("the update rate of 256 Hz")


@pytest.mark.parametrize("scan_cost", [0.0, 0.5])
def test_no_warning_while_the_rate_is_held(
    fleet: Any, time: FakeTime, caplog: pytest.LogCaptureFixture, scan_cost: float
) -> None:
    run_fleet(fleet(scan_cost), time, 30)
    assert not warnings(caplog)


class Stops(flatland.WorldObserver):
    """Stops the loop for some wall time at some simulated times [s]."""

    def __init__(self, time: FakeTime, *when: float, duration: float = 1.0) -> None:
        self._time = time
        self._duration = duration
        self._when_ns = [second * 1e9 for second in when]

    def time_advanced(self, time_ns: int) -> None:
        if time_ns in self._when_ns:
            self._time.spend(self._duration)


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Whether plugins are measured, after each change."""
    changes = []
    measure = PluginHost.measure

    def record(host: PluginHost, costs: Any) -> None:
        changes.append(costs is not None)
        measure(host, costs)

    monkeypatch.setattr(PluginHost, "measure", record)
    return changes


def test_single_stop_gives_no_warning_and_no_measurement(
    fleet: Any, time: FakeTime, measured: list[bool], caplog: pytest.LogCaptureFixture
) -> None:
    world = fleet(0.0)
    # Several stops within a second count as one; it is forgotten before the last one comes.
    world.add_observer(Stops(time, 1, 1.25, 1.5, duration=0.25))
    world.add_observer(Stops(time, 3 + rate_monitor.LONGEST_WATCH))
    run_fleet(world, time, 20)
    assert not warnings(caplog)
    assert not measured


def test_measurement_ends_when_the_loop_keeps_up_again(
    fleet: Any, time: FakeTime, measured: list[bool], caplog: pytest.LogCaptureFixture
) -> None:
    world = fleet(0.0)
    world.add_observer(Stops(time, 1, 3))
    run_fleet(world, time, 6)
    assert measured == [True, False]  # by the end of the loop
    run_fleet(world, time, 30)
    world.add_observer(Stops(time, world.time + 1, world.time + 3))
    run_fleet(world, time, 5 + rate_monitor.LONGEST_WATCH)
    assert measured == [True, False] * 2
    assert not warnings(caplog)


def test_measurement_ends_with_the_warning(
    fleet: Any, time: FakeTime, measured: list[bool], caplog: pytest.LogCaptureFixture
) -> None:
    world = fleet(0.0)
    world.add_observer(Stops(time, 1, 3, 5, 7, 9))
    run_fleet(world, time, 20)
    (text,) = warnings(caplog)
    assert "DiffDrive" in text
    assert measured == [True, False]


def test_costs_include_contacts(
    fleet: Any, time: FakeTime, monkeypatch: pytest.MonkeyPatch
) -> None:
    for hook, seconds in (("pre_solve", 1), ("begin_contact", 20), ("post_solve", 300)):
        monkeypatch.setattr(
            Laser, hook, lambda *_arguments, seconds=seconds: time.spend(seconds), raising=False
        )
    world = fleet(0.0, 0.0)
    costs = PluginCosts(time.clock)
    world.plugin_host.measure(costs)
    world.step()
    # Both robots are at the origin and touch each other.
    assert costs.describe(1000.0, 1).startswith(
        'Model Plugin "laser" type "Laser" model "0" 32.1 %; by type: 2 x Laser 64.2 %'
    )


def test_no_warning_at_full_speed(
    fleet: Any, time: FakeTime, caplog: pytest.LogCaptureFixture
) -> None:
    run_fleet(fleet(3.5), time, 10, update_rate=0)
    assert not warnings(caplog)


def test_loop_without_plugins_is_reported_as_well(
    simulate: Any, load: Load, caplog: pytest.LogCaptureFixture
) -> None:
    load.cost = lambda step: 4.0
    run(simulate(), 200)
    (text,) = warnings(caplog)
    assert text.endswith(": no plugin ran")
