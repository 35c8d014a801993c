"""The loop: rate, pause, requests, reports and end, without ROS."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest
from waiting import TIMEOUT, wait_until

import flatland
from flatland.physics import Run, RunEnd
from flatland.simulation import CycleStatistics, Simulation

pytestmark = pytest.mark.threads


class Counter(flatland.WorldObserver):
    """Records the times of steps; other threads can wait for a number of steps."""

    def __init__(self) -> None:
        self.times: list[float] = []
        self._condition = threading.Condition()

    def time_advanced(self, time_ns: int) -> None:
        del time_ns
        with self._condition:
            self.times.append(time.perf_counter())
            self._condition.notify_all()

    def wait_for(self, count: int) -> None:
        with self._condition:
            assert self._condition.wait_for(lambda: len(self.times) >= count, TIMEOUT)


@pytest.fixture
def counter() -> Counter:
    return Counter()


@pytest.fixture
def world(counter: Counter) -> Iterator[flatland.World]:
    with flatland.World(seed=1, step_size=0.01, observers=[counter]) as world:
        yield world


class Running:
    """A simulation that runs in a thread during a with block."""

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation
        self.thread = threading.Thread(target=simulation.run)

    def __enter__(self) -> Simulation:
        self.thread.start()
        return self.simulation

    def __exit__(self, *_: object) -> None:
        self.simulation.stop()
        self.thread.join(TIMEOUT)
        assert not self.thread.is_alive()


def test_run_ends_after_an_exact_simulated_time(world: flatland.World) -> None:
    result = Simulation(world, 0).run(2.5)
    assert result.steps == 250
    assert world.time == 2.5
    assert result.steps_per_second == pytest.approx(result.steps / result.wall_time)
    assert Simulation(world, math.inf).run(0.1).steps == 10
    assert world.time == 2.6


def test_a_run_whose_world_returns_to_an_earlier_time_lasts_as_long(world: flatland.World) -> None:
    start = world.snapshot()
    simulation = Simulation(world, 0)

    class Return(flatland.WorldObserver):
        def time_advanced(self, time_ns: int) -> None:
            if time_ns == 500_000_000:
                simulation.post(lambda: world.restore(start))

    world.add_observer(Return())
    assert simulation.run(2.5).steps == 250
    assert simulation.run(0.1).steps == 10


def test_a_change_of_the_rate_takes_effect_immediately(
    world: flatland.World, counter: Counter
) -> None:
    simulation = Simulation(world, 0.001, max_lag=0)
    with Running(simulation):
        counter.wait_for(1)  # The next step is due after 1000 s.
        simulation.post(lambda: simulation.set_rate(50)).result(TIMEOUT)
        counter.wait_for(12)
        simulation.post(lambda: simulation.set_rate(math.inf)).result(TIMEOUT)
        counter.wait_for(400)


def test_an_invalid_rate_is_refused_and_has_no_effect(world: flatland.World) -> None:
    simulation = Simulation(world, 500)
    for rate in (-1.0, math.nan, -math.inf):
        for use in (simulation.set_rate, lambda rate: Simulation(world, rate)):
            with pytest.raises(ValueError, match="update_rate must not be negative"):
                use(rate)
    assert simulation.run(0.3).wall_time >= 29 * 0.002


def test_pause_and_resume_by_requests(world: flatland.World, counter: Counter) -> None:
    for rate in (200, 0):
        simulation = Simulation(world, rate)
        with Running(simulation):
            counter.wait_for(len(counter.times) + 3)
            simulation.post(world.pause).result(TIMEOUT)
            steps = len(counter.times)
            assert simulation.post(lambda: world.paused).result(TIMEOUT) is True
            assert len(counter.times) == steps
            simulation.post(world.resume).result(TIMEOUT)
            counter.wait_for(steps + 3)


def test_stop_before_run(world: flatland.World) -> None:
    simulation = Simulation(world)
    simulation.stop()
    assert simulation.stopped
    assert simulation.run().steps == 0


def test_reports_are_periodic_in_wall_time_and_not_sent_while_paused(world: flatland.World) -> None:
    reports: list[CycleStatistics] = []
    came = threading.Event()

    def report(statistics: CycleStatistics) -> None:
        reports.append(statistics)
        came.set()

    simulation = Simulation(world, 200, report=report, report_period=0.05)
    with Running(simulation):
        assert came.wait(TIMEOUT)
        simulation.post(world.pause).result(TIMEOUT)
        simulation.post(lambda: time.sleep(0.1)).result(TIMEOUT)
        count = len(reports)
        for _ in range(3):  # several reports are due meanwhile
            simulation.post(lambda: time.sleep(0.06)).result(TIMEOUT)
        assert len(reports) <= count + 1  # that of the cycle in which the pause took effect
    assert reports[0].cycles >= 1


def statistics_of_steps_of_5_ms(fake_time: Any, rate: float) -> CycleStatistics:
    """Returns the first report of a loop whose steps simulate 10 ms and take 5 ms."""
    reports: list[CycleStatistics] = []

    class Load(flatland.WorldObserver):
        def time_advanced(self, time_ns: int) -> None:
            fake_time.spend(0.005)

    options = {"clock": fake_time.clock, "wait": fake_time.wait, "report_period": 0.5}
    with flatland.World(seed=1, step_size=0.01, observers=[Load()]) as world:
        Simulation(world, rate, report=reports.append, **options).run(2)
    return reports[0]


def test_statistics_of_a_loop(fake_time: Any) -> None:
    found = statistics_of_steps_of_5_ms(fake_time, 50)
    assert found.use_min == found.use_mean == found.use_max == pytest.approx(25)
    assert found.target == pytest.approx(0.5)
    assert found.actual == pytest.approx(0.5, abs=0.03)


def test_statistics_of_a_loop_without_a_rate(fake_time: Any) -> None:
    found = statistics_of_steps_of_5_ms(fake_time, 0)
    assert math.isinf(found.target)
    assert found.actual == pytest.approx(2.0, abs=0.03)
    text = str(found)
    assert text.startswith("cycle use min ")
    assert "real-time factor: target inf, actual " in text


def test_a_closed_world_ends_the_loop_with_an_error(world: flatland.World) -> None:
    simulation = Simulation(world, 0)
    world.close()
    with pytest.raises(flatland.WorldError, match="closed"):
        simulation.run()


class LastStep(flatland.WorldObserver):
    """Needs no notification of each step."""

    watches_steps = False
    watches_time = False

    def __init__(self) -> None:
        self.times: list[int] = []
        self.delay = 0.0  # s

    def time_advanced(self, time_ns: int) -> None:
        self.times.append(time_ns)
        time.sleep(self.delay)


@pytest.fixture
def unwatched(world: flatland.World, counter: Counter) -> tuple[flatland.World, LastStep]:
    world.remove_observer(counter)
    observer = LastStep()
    world.add_observer(observer)
    return world, observer


def test_without_a_rate_a_cycle_has_many_steps_if_nothing_watches_them(unwatched: Any) -> None:
    world, observer = unwatched
    result = Simulation(world, 0).run(123.45)
    assert result.steps == 12345
    assert world.time == 123.45
    assert observer.times == sorted(set(observer.times))
    assert observer.times[-1] == 123_450_000_000
    assert len(observer.times) < 5000


def test_the_core_waits_between_steps_that_nothing_watches(unwatched: Any) -> None:
    world, observer = unwatched

    def has_several_steps_in_a_cycle() -> bool:
        observer.times.clear()
        before = world.timekeeper.sim_time_ns
        result = Simulation(world, 1000.0).run(1.0)
        assert result.steps == 100
        assert result.wall_time >= 0.099
        assert observer.times == sorted(set(observer.times))
        assert observer.times[-1] == before + 1_000_000_000
        return len(observer.times) < 100

    # On a busy machine, each step may be late, which ends the cycle.
    wait_until("several steps follow each other", has_several_steps_in_a_cycle)


def test_an_observer_that_watches_the_time_is_notified_of_each_step(unwatched: Any) -> None:
    world, observer = unwatched
    observer.watches_time = True
    Simulation(world, 1000.0).run(0.2)
    assert observer.times == [10_000_000 * (i + 1) for i in range(20)]


def test_the_world_can_be_read_while_the_core_waits(unwatched: Any) -> None:
    world, observer = unwatched
    reads = refusals = 0
    with Running(Simulation(world, 500.0)):
        while len(observer.times) < 10:
            try:
                world.physics.body_states()
                reads += 1
            except (
                flatland.WorldLockedError
            ):  # during a step, which may take long on a busy machine
                refusals += 1
                time.sleep(0.001)
    assert reads > refusals


def test_statistics_contain_the_work_after_steps_of_the_core(unwatched: Any) -> None:
    world, observer = unwatched
    observer.delay = 0.03
    reports: list[CycleStatistics] = []
    Simulation(world, 1000.0, report=reports.append, report_period=0.05, max_lag=0).run(2.0)
    assert max(report.use_max for report in reports) >= 3000  # 30 ms, in percent of 1 ms
    assert min(report.use_min for report in reports) < 3000


def test_stop_ends_a_wait_of_the_core(unwatched: Any) -> None:
    world, _ = unwatched
    jobs = world.physics.jobs
    run = Run(0, 10_000_000, 100, 0.01, 8, 3)
    jobs.interrupt()
    assert jobs.run_paced(run, time.perf_counter(), 0.01)[0] == (0, RunEnd.DONE, [], [], None)
    jobs.clear_interrupt()
    (made, end, *_), times = jobs.run_paced(run, time.perf_counter(), 0.02)
    assert 1 <= made < 100
    assert end == RunEnd.DONE
    assert 0 < times.least <= times.most <= times.total
    with pytest.raises(ValueError, match="the period"):
        jobs.run_paced(run, time.perf_counter(), 0.0)
    with pytest.raises(ValueError, match="due must be finite"):
        jobs.run_paced(run, math.inf, 0.01)


def test_steps_that_are_due_precede_an_interrupt(unwatched: Any) -> None:
    """Nothing observes the steps, so they are performed together when the last one is due."""
    world, _ = unwatched
    jobs, period, made = world.physics.jobs, 0.004, 0
    interrupts: list[float] = []

    def interrupt() -> None:
        interrupts.append(time.perf_counter())
        jobs.interrupt()

    while made < 2:  # a run ends at once if its first step was late
        jobs.clear_interrupt()
        timer = threading.Timer(0.01, interrupt)
        timer.start()
        due = time.perf_counter()
        run = Run(0, 10_000_000, 100, 0.01, 8, 3)
        (made, end, *_), times = jobs.run_paced(run, due, period)
        timer.join()
    assert end == RunEnd.DONE
    assert made >= min(int((interrupts[-1] - due) / period), 6)
    assert times.waited > 0.0


def test_a_request_interrupts_the_steps_of_a_cycle(unwatched: Any) -> None:
    world, observer = unwatched
    with Running(Simulation(world, 0)) as simulation:
        simulation.post(lambda: simulation.set_rate(100.0)).result(TIMEOUT)
        simulation.post(lambda: None).result(TIMEOUT)
        before = list(observer.times)
        last = simulation.post(lambda: world.timekeeper.sim_time_ns).result(TIMEOUT)
    assert last >= max(before, default=0)


def test_cycles_without_a_rate_have_more_steps_as_long_as_they_are_short(
    unwatched: Any, fake_time: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    world, _ = unwatched
    asked: list[int] = []
    step_up_to = world.stepping.step_up_to

    def step(count: int) -> int:
        asked.append(count)
        fake_time.spend(0.002 if 11 <= len(asked) <= 15 else 0.0005)
        for _ in range(count):  # not interrupted after 50 ms
            step_up_to(1)
        return count

    monkeypatch.setattr(world.stepping, "step_up_to", step)
    Simulation(world, 0, clock=fake_time.clock, wait=fake_time.wait).run(11.14)
    assert asked[:10] == [1, 2, 4, 8, 16, 32, 64, 128, 256, 256]
    assert asked[10:15] == [256, 64, 16, 4, 1]  # long ones
    assert asked[15:] == [1, 2, 3]  # up to the end
