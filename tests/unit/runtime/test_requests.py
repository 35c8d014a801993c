"""Requests of other threads and of plugins: their order, times and threads."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from waiting import TIMEOUT

import flatland
from flatland import WorldError
from flatland.runtime.requests import Requests
from flatland.simulation import Simulation

EMPTY = "{properties: {}, layers: []}"


def test_actions_run_in_order_of_arrival_and_later_ones_wait() -> None:
    requests, done = Requests(), []
    requests.post(lambda: done.append(1))
    requests.post(lambda: requests.post(lambda: done.append(3)))
    requests.post(lambda: done.append(2))
    requests.process()
    assert done == [1, 2]
    requests.process()
    assert done == [1, 2, 3]


def test_a_cancelled_action_does_not_run() -> None:
    requests, done = Requests(), []
    assert requests.post(lambda: done.append(1)).cancel()
    requests.process()
    assert done == []


def test_a_change_within_an_action_runs_at_once() -> None:
    requests = Requests()
    outer = requests.post(lambda: requests.change(lambda: "inner", "test"))
    requests.process()
    assert outer.result(timeout=0) == "inner"


def test_a_change_within_a_hook_is_deferred_and_its_failure_logged(
    caplog: pytest.LogCaptureFixture,
) -> None:
    requests, done = Requests(), []
    with requests.hooks():
        assert requests.change(lambda: done.append(1), "change") is None
        assert requests.change(lambda: 1 / 0, "division") is None
        assert done == []
    requests.process()
    assert done == [1]
    assert "division: division by zero" in caplog.text


@pytest.mark.parametrize("kind", [KeyboardInterrupt, SystemExit])
def test_an_interrupt_in_an_action_reaches_the_caller_of_step(files: Any, kind: type) -> None:
    world = files.load(EMPTY)

    def interrupt() -> None:
        raise kind

    interrupted, later = world.post(interrupt), world.post(lambda: 7)
    with pytest.raises(kind):
        world.step()
    assert isinstance(interrupted.exception(timeout=0), kind)
    world.step()
    assert later.result(timeout=0) == 7


def test_a_step_whose_requests_close_the_world_raises(files: Any) -> None:
    world = files.load(EMPTY)
    world.post(world.close)
    with pytest.raises(WorldError, match="the world is closed"):
        world.step()


def test_requests_are_carried_out_while_another_thread_steps(files: Any) -> None:
    world, ended = files.load(EMPTY), threading.Event()

    def step() -> None:
        while not ended.is_set():
            world.step(100)

    with ThreadPoolExecutor(5) as pool:
        steps = pool.submit(step)
        reads = [pool.submit(world.between_steps, threading.get_ident) for _ in range(200)]
        for read in reads:
            read.result(TIMEOUT)
        ended.set()
        steps.result(TIMEOUT)


def test_a_waiting_thread_runs_its_action_when_the_lock_is_released() -> None:
    posted = threading.Event()
    requests = Requests(posted.set)
    with ThreadPoolExecutor(1) as pool:
        with requests.lock:  # as during the last step of a program
            waiting = pool.submit(requests.run, threading.get_ident)
            assert posted.wait(TIMEOUT)
        assert waiting.result(TIMEOUT) == pool.submit(threading.get_ident).result(TIMEOUT)


def test_without_a_server_the_thread_that_waits_runs_its_action(files: Any) -> None:
    world = files.load(EMPTY)
    with ThreadPoolExecutor(1) as pool:
        thread = pool.submit(threading.get_ident).result()
        assert pool.submit(world.between_steps, threading.get_ident).result() == thread


@pytest.mark.parametrize("update_rate", [0.0, 1000.0])
@pytest.mark.parametrize("is_paused", [False, True])
def test_while_a_simulation_runs_all_requests_run_in_its_thread(
    files: Any, update_rate: float, is_paused: bool
) -> None:
    world = files.load(EMPTY)
    simulation = Simulation(world, update_rate)
    running = threading.Event()
    world.post(running.set)
    if is_paused:
        world.pause()
    threads: list[int] = []

    class Recorder(flatland.WorldObserver):
        def model_added(self, model: flatland.Model) -> None:
            threads.append(threading.get_ident())

    world.add_observer(Recorder())
    with ThreadPoolExecutor(5) as pool:
        loop = pool.submit(lambda: (simulation.run(), threading.get_ident())[1])
        assert running.wait(TIMEOUT)

        def spawn(number: int) -> None:
            for turn in range(5):
                pose = (10.0 * turn, 10.0 * number, 0.0)
                world.spawn_model("minimal.model.yaml", f"{number}-{turn}", pose=pose)

        for spawned in [pool.submit(spawn, number) for number in range(4)]:
            spawned.result(TIMEOUT)
        simulation.stop()
        server = loop.result(TIMEOUT)
    assert set(threads) == {server}
    assert len(threads) == 20


def test_a_request_that_is_queued_when_the_simulation_ends_runs(files: Any) -> None:
    world = files.load(EMPTY)
    simulation = Simulation(world, 0)
    entered, release = threading.Event(), threading.Event()
    with ThreadPoolExecutor(2) as pool:
        world.post(lambda: (entered.set(), release.wait(TIMEOUT), simulation.stop()))
        loop = pool.submit(simulation.run, 0.0)
        loop.result(TIMEOUT)  # ends at once, before any action
        loop = pool.submit(simulation.run)
        assert entered.wait(TIMEOUT)
        late = pool.submit(world.spawn_model, "minimal.model.yaml", "late")
        release.set()
        loop.result(TIMEOUT)
        assert late.result(TIMEOUT) is world.model("late")


def test_a_world_cannot_be_run_by_two_simulations(files: Any) -> None:
    world = files.load(EMPTY)
    inner = Simulation(world, 0)
    outer = Simulation(world, 0)
    attempt = world.post(lambda: inner.run(0.0))
    outer.run(0.01)
    with pytest.raises(WorldError, match="already run by another simulation"):
        attempt.result(timeout=0)
    inner.run(0.01)
    assert world.time == pytest.approx(0.02)


# -- plugins that react to the removal of a model --------------------------------------------


class Reacting(flatland.ModelPlugin):
    """Calls a function in the hook that its parameter names."""

    act: Callable[[flatland.World], object] | None = None

    def on_initialize(self, config: Any) -> None:
        self.results: list[Any] = []
        setattr(self, config.get("hook", "string"), self.react)

    def react(self, *arguments: object) -> None:
        if self.act is not None:
            try:
                self.results.append(self.act(self.world))
            except Exception as error:
                self.results.append(error)


@pytest.fixture
def reacting(files: Any, declare_plugins: Any) -> Callable[..., Any]:
    """Returns a function that loads a world with a plugin that calls a function in a hook."""
    declare_plugins(Reacting)

    def load(hook: str, act: Callable[[flatland.World], object]) -> tuple[flatland.World, Any]:
        plugin = f'{{name: p, type: "test::Reacting", hook: {hook}}}'
        disc = "bodies: [{name: b, footprints: [{type: circle, radius: 0.5, density: 1}]}]"
        files.write("reacting.model.yaml", f"{disc}\nplugins: [{plugin}]")
        world = files.load(EMPTY)
        world.spawn_model("reacting.model.yaml", "a")
        world.spawn_model("minimal.model.yaml", "b", pose=(0.5, 0, 0), if_blocked="allow")
        world.step()
        found = world.model("a").plugin("p")
        found.act = act
        return world, found

    return load


@pytest.mark.parametrize(("hook", "deleted"), [("end_contact", "b"), ("on_shutdown", "a")])
def test_a_spawn_in_a_hook_during_the_removal_of_a_model_is_deferred(
    reacting: Callable[..., Any], hook: str, deleted: str
) -> None:
    world, plugin = reacting(
        hook, lambda world: world.spawn_model("minimal.model.yaml", "new", pose=(9, 9, 0))
    )
    world.delete_model(deleted)
    assert plugin.results == [None]
    assert "new" not in [model.name for model in world.models]
    world.step()
    assert "new" in [model.name for model in world.models]


@pytest.mark.parametrize(("hook", "deleted"), [("end_contact", "b"), ("on_shutdown", "a")])
def test_a_hook_during_the_removal_of_a_model_may_not_step(
    reacting: Callable[..., Any], hook: str, deleted: str
) -> None:
    world, plugin = reacting(hook, lambda world: world.step())
    time = world.time
    world.delete_model(deleted)
    [error] = plugin.results
    assert isinstance(error, WorldError)
    assert "step must not be called from a plugin's hook" in str(error)
    assert world.time == time


def test_actions_run_in_this_thread_only_if_no_other_serves_or_steps() -> None:
    requests, done = Requests(), []
    with ThreadPoolExecutor(1) as other:
        requests.post(lambda: done.append(1))
        assert other.submit(requests.process_if_idle).result()
        assert done == [1]
        requests.post(lambda: done.append(2))
        with requests.serving(lambda: None):
            assert requests.served
            assert not other.submit(requests.process_if_idle).result()
            assert requests.process_if_idle()
        assert not requests.served
        requests.post(lambda: done.append(3))
        with requests.lock:  # as during a step
            assert not other.submit(requests.process_if_idle).result()
        assert done == [1, 2]
        assert other.submit(requests.process_if_idle).result()
    assert done == [1, 2, 3]
