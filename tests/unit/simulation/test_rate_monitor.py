"""The warning of a loop that does not hold its rate, with a fake clock."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

import pytest

import flatland
from flatland.plugins.diff_drive import DiffDrive
from flatland.plugins.laser import Laser
from flatland.runtime.plugin_costs import PluginCosts
from flatland.runtime.plugin_host import PluginHost
from flatland.simulation import Simulation, rate_monitor

# Powers of two: sums of times are exact.
RATE = 128.0
PERIOD = 1 / RATE
LAG = 16 * PERIOD

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
    files: Any, fake_time: Any, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., flatland.World]:
    """Returns a function that loads robots whose drives and lasers spend given wall times."""

    def loaded(*scan_costs: float) -> flatland.World:
        def scan(laser: Laser, _timekeeper: object) -> None:
            fake_time.spend(scan_costs[int(laser.model.name)] * PERIOD)

        def drive(_drive: DiffDrive, _timekeeper: object) -> None:
            fake_time.spend(DRIVE_COST * PERIOD)

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


def run_fleet(world: flatland.World, fake_time: Any, seconds: float, **options: Any) -> None:
    """Runs a world for some wall time."""
    options = {"update_rate": RATE, "max_lag": LAG, **options}
    simulation = Simulation(world, clock=fake_time.clock, wait=fake_time.wait, **options)
    end = fake_time.now + seconds

    class End(flatland.WorldObserver):
        def time_advanced(self, time_ns: int) -> None:
            if fake_time.now >= end:
                simulation.stop()

    world.add_observer(End())
    simulation.run()


def test_one_warning_names_the_most_expensive_plugins(
    fleet: Any, fake_time: Any, caplog: pytest.LogCaptureFixture
) -> None:
    # Each step takes 4 periods: 0.5, 1.5 and 0.5 of lasers, and 0.5 of each of 3 drives.
    world = fleet(0.25, 1.5, 0.75)
    run_fleet(world, fake_time, rate_monitor.WARNING_PERIOD - 1)
    (text,) = warnings(caplog)
    assert text.startswith(
        "the update rate of 128 Hz cannot be held: 32.0 steps per second. Steps take "
        "100 % of the wall time, and the CPU time of the loop is "
    )
    assert text.endswith(
        "% of it. The most expensive plugins, in percent of the wall time: "
        'Model Plugin "laser" type "Laser" model "1" 37.5 %, '
        'Model Plugin "laser" type "Laser" model "2" 18.8 %, '
        'Model Plugin "drive" type "DiffDrive" model "0" 12.5 %; '
        "by type: 3 x Laser 62.5 %, 3 x DiffDrive 37.5 %"
    )


def test_the_warning_is_repeated_after_its_period_and_after_a_change_of_the_rate(
    fleet: Any, fake_time: Any, caplog: pytest.LogCaptureFixture
) -> None:
    world = fleet(3.5)
    run_fleet(world, fake_time, rate_monitor.WARNING_PERIOD + 5)
    assert len(warnings(caplog)) == 2
    caplog.clear()
    simulation = Simulation(world, RATE, clock=fake_time.clock, wait=fake_time.wait)
    start = fake_time.now

    class Switch(flatland.WorldObserver):
        def time_advanced(self, time_ns: int) -> None:
            if fake_time.now > start + 5:
                simulation.set_rate(2 * RATE)
            if fake_time.now > start + 10:
                simulation.stop()

    world.add_observer(Switch())
    simulation.run()
    first, second = warnings(caplog)
    assert first.startswith("the update rate of 128 Hz")
    assert second.startswith("the update rate of 256 Hz")


@pytest.mark.parametrize(("scan_cost", "rate"), [(0.0, RATE), (0.5, RATE), (3.5, 0.0)])
def test_no_warning_while_the_rate_is_held_and_at_full_speed(
    fleet: Any, fake_time: Any, caplog: pytest.LogCaptureFixture, scan_cost: float, rate: float
) -> None:
    run_fleet(fleet(scan_cost), fake_time, 5, update_rate=rate)
    assert not warnings(caplog)


class Delays(flatland.WorldObserver):
    """Delays the loop for some wall time at given simulated times [s]."""

    def __init__(self, fake_time: Any, *when: float, duration: float = 1.0) -> None:
        self._time = fake_time
        self._duration = duration
        self._when_ns = [second * 1e9 for second in when]

    def time_advanced(self, time_ns: int) -> None:
        if time_ns in self._when_ns:
            self._time.spend(self._duration)


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """The changes of the measurement: whether plugins are measured."""
    changes = []

    def record(host: PluginHost, costs: Any) -> None:
        if "costs" in vars(host):
            changes.append(costs is not None)
        vars(host)["costs"] = costs

    costs = property(lambda host: vars(host)["costs"], record)
    monkeypatch.setattr(PluginHost, "costs", costs, raising=False)
    return changes


def test_a_single_delay_causes_no_warning_and_no_measurement(
    fleet: Any, fake_time: Any, measured: list[bool], caplog: pytest.LogCaptureFixture
) -> None:
    world = fleet(0.0)
    # Several delays within a second count as one loss, which is dropped before the last delay.
    world.add_observer(Delays(fake_time, 1, 1.25, 1.5, duration=0.25))
    world.add_observer(Delays(fake_time, 3 + rate_monitor.MAX_WATCH_TIME))
    run_fleet(world, fake_time, 20)
    assert not warnings(caplog)
    assert not measured


def test_the_measurement_ends_when_the_loop_holds_its_rate_again(
    fleet: Any, fake_time: Any, measured: list[bool], caplog: pytest.LogCaptureFixture
) -> None:
    world = fleet(0.0)
    world.add_observer(Delays(fake_time, 1, 3))
    run_fleet(world, fake_time, 6)
    assert measured == [True, False]  # at the end of the loop
    run_fleet(world, fake_time, 30)
    world.add_observer(Delays(fake_time, world.time + 1, world.time + 3))
    run_fleet(world, fake_time, 5 + rate_monitor.MAX_WATCH_TIME)
    assert measured == [True, False] * 2
    assert not warnings(caplog)


def test_the_measurement_ends_with_the_warning(
    fleet: Any, fake_time: Any, measured: list[bool], caplog: pytest.LogCaptureFixture
) -> None:
    world = fleet(0.0)
    world.add_observer(Delays(fake_time, 1, 3, 5, 7, 9))
    run_fleet(world, fake_time, 20)
    (text,) = warnings(caplog)
    assert "DiffDrive" in text
    assert measured == [True, False]


def test_costs_include_contacts(
    fleet: Any, fake_time: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    for hook, seconds in (("pre_solve", 1), ("begin_contact", 20), ("post_solve", 300)):
        monkeypatch.setattr(
            Laser,
            hook,
            lambda *_arguments, seconds=seconds: fake_time.spend(seconds),
            raising=False,
        )
    world = fleet(0.0, 0.0)
    costs = PluginCosts(fake_time.clock)
    world.plugin_host.costs = costs
    world.step()
    # Both robots are at the origin and in contact.
    assert costs.describe(1000.0, 1).startswith(
        'Model Plugin "laser" type "Laser" model "0" 32.1 %; by type: 2 x Laser 64.2 %'
    )


def test_an_overloaded_loop_without_plugins_is_reported(
    fleet: Any, fake_time: Any, caplog: pytest.LogCaptureFixture
) -> None:
    class Slow(flatland.WorldObserver):
        def time_advanced(self, time_ns: int) -> None:
            fake_time.spend(4 * PERIOD)

    world = fleet()
    world.add_observer(Slow())
    run_fleet(world, fake_time, 10)
    (text,) = warnings(caplog)
    assert text.endswith(": no plugin ran")
