"""Several buildings, one of which is drawn for each episode."""

from __future__ import annotations

import pickle
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from web_client import WebClient

import flatland
from flatland.gym import (
    Buildings,
    FlatlandEnv,
    FlatlandVectorEnv,
    RandomBuildings,
    RandomGoal,
    find_world,
    make_parallel,
    make_vec,
    stage,
)

Make = Callable[..., Any]

OFFICES = RandomBuildings("office", 3, size=(14, 12))
MODES = [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP]


def actions(n: int, steps: int) -> np.ndarray:
    numbers = np.random.default_rng(0).uniform(-1, 1, (steps, n, 2))
    numbers[..., 0] = np.abs(numbers[..., 0])
    return numbers.astype(np.float32)


def run(envs: Any, n: int, steps: int) -> list[bytes]:
    """Returns all numbers of random episodes."""
    results = [envs.reset(seed=7)[0].tobytes()]
    for action in actions(n, steps):
        observations, rewards, terminated, truncated, _ = envs.step(action)
        results += [each.tobytes() for each in (observations, rewards, terminated, truncated)]
    return results


def name_of(world: flatland.World) -> str:
    return Path(world.path).parent.name


@pytest.mark.parametrize("mode", MODES)
def test_a_vector_equals_single_environments(
    make: Make, mode: AutoresetMode, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stage, "_IDLE_PER_WORLD", 0.5)  # Some worlds are closed and made again.
    vector = make(FlatlandVectorEnv, 2, OFFICES, max_steps=6, autoreset_mode=mode)
    single = make(
        SyncVectorEnv,
        [partial(FlatlandEnv, OFFICES, max_steps=6) for _ in range(2)],
        autoreset_mode=mode,
    )
    assert run(vector, 2, 40) == run(single, 2, 40)


def test_results_do_not_depend_on_threads_and_other_environments(make: Make) -> None:
    vectors = [
        make(FlatlandVectorEnv, 3, OFFICES, max_steps=5, num_threads=threads) for threads in (1, 3)
    ]
    first, second = (run(envs, 3, 20) for envs in vectors)
    assert first == second
    # An environment beside others has the episodes that it has alone.
    alone, beside = make(FlatlandVectorEnv, 1, OFFICES, max_steps=5), vectors[0]
    alone.reset(seed=9)
    beside.reset(seed=9)
    for action in actions(3, 20):
        one, many = alone.step(action[:1]), beside.step(action)
        assert one[0].tobytes() == many[0][:1].tobytes()
        assert name_of(alone.worlds[0]) == name_of(beside.worlds[0])


def test_each_episode_draws_its_building(make: Make) -> None:
    envs = make(FlatlandVectorEnv, 3, OFFICES, max_steps=3, autoreset_mode="SameStep")
    envs.reset(seed=0)
    seen: list[set[str]] = [set() for _ in range(3)]
    for action in actions(3, 50):
        for row, world in enumerate(envs.worlds):
            seen[row].add(name_of(world))
            pose = world.model("robot").pose
            assert pose == pytest.approx(tuple(envs.poses[row]), abs=1e-9)
        assert len(set(map(id, envs.worlds))) == 3
        envs.step(action)
    assert seen == [{"office_0", "office_1", "office_2"}] * 3


def test_starts_and_goals_are_in_the_building(make: Make) -> None:
    env = make(FlatlandEnv, OFFICES)
    walls = set()
    for seed in range(12):
        env.reset(seed=seed)
        robot = env.world.model("robot")
        walls.add((name_of(env.world), len(env.world.layer("walls").edges)))
        assert env.world.is_free(env.goal, 0.2, ignore=[robot])
        env.world.sample_free(1, 0.2, connected_to=env.goal, ignore=[robot])
    assert len(walls) == 3


def test_options_apply_to_the_drawn_building(make: Make) -> None:
    envs = make(FlatlandVectorEnv, 3, OFFICES)
    with pytest.raises(flatland.WorldError, match=r"environment 0: .* outside of the walls"):
        envs.reset(seed=0, options={"goal": (60, 0)})
    envs.reset(seed=0)
    envs.reset(seed=0, options={"start": envs.poses, "goal": envs.goals})


def test_buildings_are_files_or_included_worlds(make: Make, tmp_path: Path) -> None:
    env = make(FlatlandEnv, Buildings(["corridor", flatland.gym.find_world("navigate")]))
    check_env(env, skip_render_check=True)
    names = set()
    for seed in range(8):
        env.reset(seed=seed)
        names.add(Path(env.world.path).stem)
    assert names == {"corridor", "navigate"}


def test_people_begin_each_episode_at_other_places(make: Make) -> None:
    envs = make(make_vec, "flatland/Crowd-v0", 2, autoreset_mode="SameStep")

    def people() -> list[tuple[float, ...]]:
        names = [f"person_{number}" for number in range(20)]
        return [
            tuple(x for name in names for x in world.model(name).pose[:2]) for world in envs.worlds
        ]

    starts: set[tuple[float, ...]] = set()
    ends: set[tuple[float, ...]] = set()
    for seed in (0, 100, 0):
        envs.reset(seed=seed)
        starts |= set(people())
        for _ in range(10):
            envs.step(np.array([[-1.0, 0.0]] * 2))
        ends |= set(people())
    assert len(starts) == len(ends) == 4  # The last episodes repeat the first ones.


def test_episodes_among_people_equal_those_of_single_environments(
    make: Make, tmp_path: Path
) -> None:
    path = tmp_path / "world.yaml"
    walls, robot = (
        find_world("corridor").with_name(name) for name in ("corridor.map.yaml", "robot.model.yaml")
    )
    path.write_text(
        f"properties: {{}}\nlayers: [{{name: walls, map: {walls}}}]\n"
        f"models: [{{name: robot, model: {robot}, pose: [1, 1.25, 0]}}]\n"
        "plugins: [{name: people, type: Pedestrians, groups: [{name: person, count: 3}]}]\n"
    )
    single = make(SyncVectorEnv, [partial(FlatlandEnv, path, max_steps=25)] * 4)
    expected = run(single, 4, 80)
    for threads in (1, 3):
        vector = make(FlatlandVectorEnv, 4, path, max_steps=25, num_threads=threads)
        assert run(vector, 4, 80) == expected


def test_buildings_survive_a_copy_of_the_environment(make: Make) -> None:
    env = make(FlatlandEnv, OFFICES)
    env.reset(seed=3)
    other = make(pickle.loads, pickle.dumps(env))
    assert other.reset()[0].tobytes() == env.reset()[0].tobytes()


def test_all_worlds_are_closed(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    created = []
    initialize = flatland.World.__init__

    def recorded(self: flatland.World, *arguments: Any, **options: Any) -> None:
        initialize(self, *arguments, **options)
        created.append(self)

    monkeypatch.setattr(flatland.World, "__init__", recorded)
    envs = FlatlandVectorEnv(2, OFFICES, max_steps=3)
    run(envs, 2, 20)
    envs.close()
    assert len(created) > 5
    assert all(world.closed for world in created)
    created.clear()
    with pytest.raises(flatland.WorldError, match="no place is free"):
        FlatlandVectorEnv(2, OFFICES, task=RandomGoal(clearance=9.0))
    assert created
    assert all(world.closed for world in created)


def test_the_viewer_shows_the_present_building(
    make: Make, capsys: pytest.CaptureFixture[str]
) -> None:
    env = make(FlatlandEnv, OFFICES, render_mode="human")
    buildings = set()
    for seed in range(6):
        env.reset(seed=seed)
        buildings.add(name_of(env.world))
        if seed == 0:
            (url,) = re.findall(r"http://\S+", capsys.readouterr().err)
        with WebClient(url) as client:
            (world,) = client.hello["worlds"]
            assert world["name"] == "3 buildings"
            pose = pytest.approx(env.world.model("robot").pose, abs=1e-5)
            client.until("the start", lambda pose=pose: client.pose("robot") == pose)
    assert len(buildings) > 1


def test_different_robots_are_an_error(room: Path) -> None:
    with pytest.raises(flatland.WorldError, match="lasers of the agents must be alike"):
        FlatlandEnv(Buildings(["corridor", room]))
    path = room.parent / "robot.model.yaml"
    same = room.parent / "same.yaml"
    same.write_text(room.read_text().replace("robot.model", "fast.model"))
    limits = "linear_dynamics: {velocity_limit: 0.5}"
    (room.parent / "fast.model.yaml").write_text(
        path.read_text().replace("body: base}", f"body: base, {limits}}}", 1)
    )
    with pytest.raises(flatland.WorldError, match="drives of the agents must have the same limits"):
        FlatlandEnv(Buildings([room, same]))


@pytest.mark.parametrize(
    ("create", "error", "message"),
    [
        (lambda: Buildings([]), ValueError, "at least one"),
        (lambda: Buildings("navigate"), TypeError, "several files"),
        (lambda: RandomBuildings("castle"), ValueError, "kind must be one of"),
        (lambda: RandomBuildings("office", 0), ValueError, "count"),
        (lambda: RandomBuildings("office", 1, first_seed=-1), ValueError, "first_seed"),
        (lambda: FlatlandEnv(RandomBuildings("office", 2, size=(1, 1))), ValueError, "size"),
        (lambda: FlatlandEnv(["navigate"]), TypeError, "world must be"),
        (lambda: FlatlandEnv(Buildings(["atlantis"])), flatland.WorldError, "atlantis"),
        (lambda: make_parallel(world=OFFICES), TypeError, "several robots have one building"),
    ],
)
def test_an_invalid_argument_is_an_error(
    create: Callable[[], Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        create()
