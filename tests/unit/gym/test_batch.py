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
from flatland.gym import (
    CommandLatency,
    FlatlandVectorEnv,
    FleetVectorEnv,
    RandomGoal,
    ScanNoise,
    make_parallel,
)
from flatland.gym.endings import Arrived
from flatland.plugins.laser import Laser
from flatland.runtime.observer import WorldObserver
from flatland.values import Twist

Make = Callable[..., Any]
COUNT, STEPS = 3, 40
COMMANDS = np.tile([0.1, 0.0, 0.1], (COUNT, 1))


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
        results.append([(world.state_hash(), world.time) for world in env.worlds])
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


@pytest.fixture
def env(make: Make, room: Path) -> Any:
    """Environments whose episodes have begun, and last."""
    env = make(FlatlandVectorEnv, COUNT, room, ending=Arrived(), max_steps=1000, num_threads=2)
    env.reset(seed=0)
    return env


def with_timeout(room: Path, timeout: float) -> Path:
    """Gives the drive of the robot of a room a time limit of commands [s]."""
    model = room.parent / "robot.model.yaml"
    drive = "{type: DiffDrive, name: drive, body: base"
    model.write_text(model.read_text().replace(drive, f"{drive}, command_timeout: {timeout}"))
    return room


def test_the_core_stops_agents_whose_commands_are_too_old(make: Make, room: Path) -> None:
    with_timeout(room, 0.05)
    text = r'"robot" stops between two actions: .* 0\.05 s .* 0\.1 s'
    with pytest.warns(UserWarning, match=text):
        env, attended = create(make, room), create(make, room)
    results = run(env)
    for world in attended.worlds:
        world.add_observer(Watcher())  # Python steps it.
    assert run(attended) == results
    speeds = env.episodes.situation.velocities[:, 0]
    assert not speeds.any()


def test_a_time_limit_of_the_length_of_a_period_has_no_effect(make: Make, room: Path) -> None:
    def observations(world: Path) -> list[Any]:
        return run(create(make, world))[::2]

    before = observations(room)
    assert observations(with_timeout(room, 0.1)) == before


@pytest.mark.parametrize("world", ["room", "corridor"])
def test_an_observer_does_not_change_results(make: Make, room: Path, world: str) -> None:
    env, watched = (create(make, room if world == "room" else world) for _ in range(2))
    watcher = Watcher()
    watched.worlds[1].add_observer(watcher)
    assert run(watched) == run(env)
    # The core performs all steps between two calls of code at once.
    assert watcher.starts >= STEPS - 3


def test_requests_and_hooks_are_performed_in_their_step(make: Make, room: Path) -> None:
    env, other = create(make, room), create(make, room)
    first, second = env.worlds[0], other.worlds[0]

    def post(step: int) -> None:
        if step % 7 == 3:
            first.post(lambda: first.move_model("robot", (3.0, 2.0, 1.0), "allow"))

    def move(step: int) -> None:
        if step % 7 == 3:
            second.move_model("robot", (3.0, 2.0, 1.0), "allow")

    assert run(env, post) == run(other, move)


def test_a_paused_world_stands_still(env: Any) -> None:
    env.worlds[0].pause()
    env.step(np.ones((COUNT, 2), np.float32))
    times = [world.time for world in env.worlds]
    assert times[0] == 0
    assert times[1] == times[2] > 0


def test_an_exception_of_one_world_ends_the_steps_of_all(env: Any) -> None:
    env.step(np.zeros((COUNT, 2), np.float32))
    env.worlds[1].delete_model("robot")
    with pytest.raises(StaleHandleError, match="removed"):
        env.step(np.ones((COUNT, 2), np.float32))
    # No world remains locked, and the other worlds have been stepped.
    assert env.worlds[0].time == env.worlds[2].time == pytest.approx(0.2)
    assert not env.worlds[1].requests.lock._is_owned()


def test_subscribers_do_not_change_results(make: Make, room: Path) -> None:
    env, subscribed = create(make, room), create(make, room)
    scans: list[Any] = []
    subscribed.worlds[1].output("/scan").subscribe(scans.append)
    assert run(subscribed) == run(env)
    assert len(scans) >= STEPS - 3


def test_a_function_that_requests_itself_is_called_once_before_each_step(env: Any) -> None:
    world, plugin = env.worlds[1], env.episodes.agents[1].laser
    times: list[int] = []

    def repeat() -> None:
        times.append(world.timekeeper.sim_time_ns)
        plugin.set_before_step(repeat)

    env.step(np.zeros((COUNT, 2)))
    start = world.timekeeper.sim_time_ns
    plugin.set_before_step(repeat)
    for _ in range(3):
        env.step(np.zeros((COUNT, 2)))
    assert times == list(range(start, world.timekeeper.sim_time_ns, 5_000_000))
    assert len({each.time for each in env.worlds}) == 1


def test_a_first_update_is_called_if_it_is_wanted(env: Any) -> None:
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


def test_a_command_has_the_last_value_of_the_core(env: Any) -> None:
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
def test_changes_from_outside_end_the_permission_of_the_core(env: Any, change: str) -> None:
    for _ in range(2):  # with the first updates of plugins
        env.step(np.full((COUNT, 2), 0.1))
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
        assert batch.perform(
            COMMANDS, np.ones(COUNT, np.bool_), None, 20, lambda: None
        ).tolist() == [1]
        assert len(values) == (count if change == "on_set" else 0)


def test_a_hook_cannot_step_the_environment(env: Any) -> None:
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


def test_requests_wait_for_the_end_of_all_steps(env: Any) -> None:
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


def test_the_next_episodes_begin_while_other_worlds_step(env: Any) -> None:
    env.step(np.full((COUNT, 2), 0.1))
    refused: list[int] = []

    def meanwhile() -> None:
        for row, world in enumerate(env.worlds):
            try:
                world.move_model("robot", (3.0, 2.0, 1.0), "allow")
            except WorldLockedError:
                refused.append(row)

    acting = np.array([True, False, True])
    assert env._episodes._batch.perform(COMMANDS, acting, None, 20, meanwhile).tolist() == []
    assert refused == [0, 2]
    assert env.poses[1].tolist() == pytest.approx([3.0, 2.0, 1.0])
    assert [world.time for world in env.worlds] == pytest.approx([0.2, 0.1, 0.2])


def test_an_exception_while_worlds_step_leaves_them_complete(env: Any) -> None:
    def fail() -> None:
        raise ValueError("no start")

    with pytest.raises(ValueError, match="no start"):
        env._episodes._batch.perform(COMMANDS, np.array([True, False, True]), None, 20, fail)
    assert [world.time for world in env.worlds] == pytest.approx([0.1, 0.0, 0.1])
    env.step(np.full((COUNT, 2), 0.1))
    assert [world.time for world in env.worlds] == pytest.approx([0.2, 0.1, 0.2])


ROBOTS = 3
FLEET: dict[str, Any] = {
    "num_robots": ROBOTS,
    "max_steps": 30,
    "randomization": ScanNoise((0.0, 0.1)) + CommandLatency((0, 2)),
    "task": RandomGoal((0.4, 2.0)),
}


def run_fleets(
    env: FleetVectorEnv, disturb: Callable[[int], None] = lambda _: None
) -> tuple[list[Any], int]:
    """Returns all results of random episodes, and how often a robot had none beside others."""
    rng = np.random.default_rng(2)
    results: list[Any] = []
    waits = 0
    env.reset(seed=5)
    for step in range(2 * STEPS):
        disturb(step)
        actions = rng.uniform([0.0, -1.0], [1.0, 1.0], (env.num_envs, 2)).astype(np.float32)
        *values, infos = env.step(actions)
        results.append([np.asarray(value).tobytes() for value in values])
        results.append([infos["distance"].tobytes(), infos["collision"].tobytes()])
        results.append([(world.state_hash(), world.time) for world in env.worlds])
        active = infos["is_active"].reshape(-1, ROBOTS)
        waits += int((active.any(axis=1) & ~active.all(axis=1)).sum())
    return results, waits


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_robots_of_one_world_have_the_results_of_steps_in_python(
    make: Make, mode: AutoresetMode
) -> None:
    env, attended, watched = (
        make(FleetVectorEnv, COUNT, autoreset_mode=mode, num_threads=2, **FLEET) for _ in range(3)
    )
    attended._episodes._batch = None
    watcher = Watcher()
    watched.worlds[1].add_observer(watcher)
    expected, waits = run_fleets(attended)
    assert waits > STEPS
    assert run_fleets(env) == run_fleets(watched) == (expected, waits)
    assert watcher.starts > STEPS
    # Without such questions about the worlds, the core performs the steps alone.
    env.reset(seed=0)
    env.step(np.zeros((env.num_envs, 2), np.float32))
    batch = env._episodes._batch
    assert batch is not None
    assert batch._core.not_permitted(np.ones(env.num_envs, np.bool_)) == []


def test_changes_of_a_world_of_several_robots_are_performed_in_their_step(make: Make) -> None:
    env, attended = (make(FleetVectorEnv, COUNT, **FLEET) for _ in range(2))
    attended._episodes._batch = None

    def disturb(env: FleetVectorEnv, step: int) -> None:
        world, agents = env.worlds[1], env._episodes.agents
        if step % 9 == 4:
            agents[ROBOTS].command.set(Twist(0.2, 0.0, 0.5))
        if step % 9 == 6:
            world.post(lambda: world.move_model("robot_1", (3.0, 2.0, 1.0), "allow"))
        if step % 9 == 8:
            world.pause() if not world.paused else world.resume()

    assert run_fleets(env, lambda step: disturb(env, step)) == run_fleets(
        attended, lambda step: disturb(attended, step)
    )


def test_a_fleet_observes_robots_whose_episodes_have_ended(make: Make) -> None:
    env, attended = (make(make_parallel, **FLEET) for _ in range(2))
    attended._episodes._batch = None
    found: list[list[Any]] = [[], []]
    for fleet, results in zip((env, attended), found, strict=True):
        rng = np.random.default_rng(0)
        for seed in range(3):
            fleet.reset(seed=seed)
            while fleet.agents:
                live = list(fleet.agents)
                fleet.step({name: rng.uniform(-1, 1, 2).astype(np.float32) for name in live})
                results.append((live, fleet.state().tobytes(), fleet.world.state_hash()))
    assert found[0] == found[1]
    assert any(0 < len(live) < ROBOTS for live, *_ in found[0])
