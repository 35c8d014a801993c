"""Steps that the core performs alone have the results of steps that Python attends."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from flatland.errors import StaleHandleError, WorldError, WorldLockedError
from flatland.gym import FlatlandVectorEnv
from flatland.gym.endings import Arrived
from flatland.plugins.laser import Laser
from flatland.runtime.jobs import Jobs
from flatland.runtime.observer import WorldObserver
from flatland.values import Twist

Make = Callable[..., Any]
COUNT, STEPS = 3, 40


class Watcher(WorldObserver):
    """Its world is stepped by Python."""

    def __init__(self) -> None:
        self.starts = 0

    def step_started(self) -> None:
        self.starts += 1


def run(env: FlatlandVectorEnv, disturb: Callable[[int], None] | None = None) -> list[Any]:
    """Returns all results of random episodes, and the hashes of the worlds."""
    rng = np.random.default_rng(1)
    results: list[Any] = []
    env.reset(seed=3)
    for step in range(STEPS):
        if disturb is not None:
            disturb(step)
        actions = rng.uniform([0.0, -1.0], [1.0, 1.0], (COUNT, 2)).astype(np.float32)
        observations, rewards, terminated, truncated, infos = env.step(actions)
        values = [observations, rewards, terminated, truncated, *map(infos.get, sorted(infos))]
        results.append([np.asarray(value).tobytes() for value in values])
        results.append([world.state_hash() for world in env._stage.worlds])
        results.append([world.time for world in env._stage.worlds])
    return results


def create(make: Make, world: str | Path) -> Any:
    # Robots that hit a wall go on: the core reports bodies that are jammed.
    return make(
        FlatlandVectorEnv,
        COUNT,
        world,
        ending=Arrived(),
        max_steps=25,
        autoreset_mode=AutoresetMode.NEXT_STEP,
    )


def begun(make: Make, room: Path) -> tuple[Any, Any, Any]:
    """Returns environments after the first updates of plugins, commands, and who acts."""
    env = make(FlatlandVectorEnv, COUNT, room, ending=Arrived(), max_steps=1000)
    env.reset(seed=0)
    for _ in range(2):
        env.step(np.full((COUNT, 2), 0.1))
    return env, np.tile([0.1, 0.0, 0.1], (COUNT, 1)), np.ones(COUNT, np.bool_)


@pytest.mark.parametrize("world", ["room", "corridor"])
def test_an_observer_does_not_change_results(make: Make, room: Path, world: str) -> None:
    env = create(make, room if world == "room" else world)
    watched = create(make, room if world == "room" else world)
    watcher = Watcher()
    watched._stage.worlds[1].add_observer(watcher)
    assert run(watched) == run(env)
    # The core performs all steps between two calls of code at once.
    assert watcher.starts >= STEPS - 3


def test_requests_and_hooks_are_performed_in_their_step(make: Make, room: Path) -> None:
    env, other = create(make, room), create(make, room)
    first, second = env._stage.worlds[0], other._stage.worlds[0]

    def post(step: int) -> None:
        if step % 7 == 3:
            first.post(lambda: first.move_model("robot", (3.0, 2.0, 1.0), "allow"))

    def move(step: int) -> None:
        if step % 7 == 3:
            second.move_model("robot", (3.0, 2.0, 1.0), "allow")

    assert run(env, post) == run(other, move)


def test_a_paused_world_stands_still(make: Make, room: Path) -> None:
    env = create(make, room)
    env.reset(seed=0)
    env._stage.worlds[0].pause()
    env.step(np.ones((COUNT, 2), np.float32))
    times = [world.time for world in env._stage.worlds]
    assert times[0] == 0
    assert times[1] == times[2] > 0


def test_an_exception_of_one_world_ends_the_steps_of_all(make: Make, room: Path) -> None:
    env = create(make, room)
    env.reset(seed=0)
    env.step(np.zeros((COUNT, 2), np.float32))
    env._stage.worlds[1].delete_model("robot")
    with pytest.raises(StaleHandleError, match="removed"):
        env.step(np.ones((COUNT, 2), np.float32))
    # No world remains locked, and the other worlds have been stepped.
    assert env._stage.worlds[0].time == env._stage.worlds[2].time == pytest.approx(0.2)
    assert not env._stage.worlds[1].requests.lock._is_owned()


def test_first_updates_without_calls_have_the_same_results(
    make: Make, room: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    env = create(make, room)
    monkeypatch.setattr(Jobs, "omit_first_calls", lambda *_: None)
    called = create(make, room)
    assert run(env) == run(called)


def test_a_first_update_is_called_if_it_is_wanted(make: Make, room: Path) -> None:
    env = make(FlatlandVectorEnv, COUNT, room, ending=Arrived())
    env.reset(seed=0)
    first, second = (agent.laser for agent in env.episodes.agents[:2])
    calls: list[Laser] = []
    for laser in (first, second):
        laser._update.function = lambda _, laser=laser: calls.append(laser)
    (output,) = second._update.outputs
    unsubscribe = output.subscribe(lambda _: None)
    env.step(np.zeros((COUNT, 2)))
    count = len(calls)
    assert calls == [second] * count
    assert count > 0
    unsubscribe()
    env.step(np.zeros((COUNT, 2)))
    assert len(calls) == count


def test_a_command_has_the_last_value_of_the_core(make: Make, room: Path) -> None:
    env = make(FlatlandVectorEnv, COUNT, room, ending=Arrived(), max_steps=1000)
    env.reset(seed=0)
    commands = [agent.command for agent in env.episodes.agents]
    for step in range(1, 5):
        actions = np.full((COUNT, 2), 0.1 * step)
        env.step(actions)
        low, high = env.episodes.situation.low, env.episodes.situation.high
        forward, turn = low + (actions[0] + 1.0) * (0.5 * (high - low))
        assert [command.value for command in commands] == [Twist(forward, 0.0, turn)] * COUNT
        assert [command.received for command in commands] == [step] * COUNT
    world = env.worlds[0]
    saved, clone = world.snapshot(), world.clone()
    env.step(np.zeros((COUNT, 2)))
    assert (commands[0].received, commands[1].received) == (5, 5)
    world.restore(saved)
    assert (commands[0].value, commands[0].received) == (Twist(forward, 0.0, turn), 4)
    topic = commands[0].topic
    assert clone.command(topic).value == Twist(forward, 0.0, turn)
    clone.close()


@pytest.mark.parametrize("change", ["on_set", "iterations", "pre_solve", "pause"])
def test_changes_from_outside_end_the_permission_of_the_core(
    make: Make, room: Path, change: str
) -> None:
    env, commands, ones = begun(make, room)
    world = env.worlds[1]
    values: list[Twist] = []
    if change == "on_set":
        env.episodes.agents[1].command.on_set = lambda _, value: values.append(value)
    elif change == "iterations":
        world.velocity_iterations += 1
    elif change == "pre_solve":
        world.physics.pre_solve = lambda *_: None
    else:
        world.pause()
    batch = env._episodes._batch
    for count in (1, 2):
        assert batch.perform(commands, ones, 20, lambda: None).tolist() == [1]
        assert len(values) == (count if change == "on_set" else 0)


def test_a_hook_cannot_step_the_environment(make: Make, room: Path) -> None:
    env = make(FlatlandVectorEnv, COUNT, room, ending=Arrived(), max_steps=1000)
    env.reset(seed=0)
    actions = np.zeros((COUNT, 2))
    errors: list[str] = []

    def step() -> None:
        with pytest.raises(WorldError, match="must not be called from a plugin's hook") as caught:
            env.step(actions)
        errors.append(str(caught.value))

    drive = next(iter(env.worlds[1].models)).plugins[0]
    env.worlds[1].plugin_host.jobs.set_later(drive, step)
    env.worlds[1].step()
    assert len(errors) == 1
    env.step(actions)


def test_requests_wait_for_the_end_of_all_steps(make: Make, room: Path) -> None:
    env = create(make, room)
    env.reset(seed=0)
    world, posted = env.worlds[1], threading.Event()
    world.requests._on_post = posted.set
    with env.worlds[0].requests.lock:
        mover = threading.Thread(target=world.move_model, args=("robot", (3, 2, 1), "allow"))
        mover.start()
        # The lock is that of all worlds: the request waits, and the next step carries it out.
        assert posted.wait(60)
        assert mover.is_alive()
    env.step(np.tile([-1.0, 0.0], (COUNT, 1)))
    mover.join(60)
    assert not mover.is_alive()
    assert env.poses[1].tolist() == pytest.approx([3, 2, 1], abs=1e-4)


def test_the_next_episodes_begin_while_other_worlds_step(make: Make, room: Path) -> None:
    env = make(FlatlandVectorEnv, COUNT, room, ending=Arrived(), max_steps=1000, num_threads=2)
    env.reset(seed=0)
    actions, acting = np.full((COUNT, 2), 0.1), np.array([True, False, True])
    env.step(actions)
    refused: list[int] = []

    def meanwhile() -> None:
        for row, world in enumerate(env.worlds):
            try:
                world.move_model("robot", (3.0, 2.0, 1.0), "allow")
            except WorldLockedError:
                refused.append(row)

    batch, commands = env._episodes._batch, np.tile([0.1, 0.0, 0.1], (COUNT, 1))
    assert batch.perform(commands, acting, 20, meanwhile).tolist() == []
    assert refused == [0, 2]
    assert env.poses[1].tolist() == pytest.approx([3.0, 2.0, 1.0])
    assert [world.time for world in env.worlds] == pytest.approx([0.2, 0.1, 0.2])


def test_an_exception_while_worlds_step_leaves_them_complete(make: Make, room: Path) -> None:
    env = make(FlatlandVectorEnv, COUNT, room, ending=Arrived(), max_steps=1000)
    env.reset(seed=0)
    actions, acting = np.full((COUNT, 2), 0.1), np.array([True, False, True])

    def fail() -> None:
        raise ValueError("no start")

    commands = np.tile([0.1, 0.0, 0.1], (COUNT, 1))
    with pytest.raises(ValueError, match="no start"):
        env._episodes._batch.perform(commands, acting, 20, fail)
    assert [world.time for world in env.worlds] == pytest.approx([0.1, 0.0, 0.1])
    env.step(actions)
    assert [world.time for world in env.worlds] == pytest.approx([0.2, 0.1, 0.2])
