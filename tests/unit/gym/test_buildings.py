"""Several buildings, one of which is drawn for each episode."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode
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
from flatland.plugins.pedestrians import Pedestrians
from flatland.values import PeopleStates

Make = Callable[..., Any]

OFFICES = RandomBuildings("office", 3, size=(14, 12))
MODES = [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP]


def name_of(world: flatland.World) -> str:
    return Path(world.path).parent.name


@pytest.mark.parametrize("mode", MODES)
def test_a_vector_equals_single_environments(
    equals_singles: Callable[..., Any], mode: AutoresetMode, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stage, "_IDLE_PER_WORLD", 0.5)  # Some worlds are closed and made again.
    _, ended = equals_singles(2, 40, mode, world=OFFICES, max_steps=6)
    assert ended > 9


def test_each_episode_draws_its_building(make: Make) -> None:
    envs = make(FlatlandVectorEnv, 3, OFFICES, max_steps=3, autoreset_mode="SameStep")
    envs.reset(seed=0)
    seen: list[set[str]] = [set() for _ in range(3)]
    for _ in range(50):
        for row, world in enumerate(envs.worlds):
            seen[row].add(name_of(world))
            pose = world.model("robot").pose
            assert pose == pytest.approx(tuple(envs.poses[row]), abs=1e-9)
        assert len(set(map(id, envs.worlds))) == 3
        envs.step(np.zeros((3, 2)))
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

    def people() -> list[Any]:
        return [tuple(world.model(f"person_{n}").pose for n in range(20)) for world in envs.worlds]

    starts, ends = set(), set()
    for seed in (0, 100, 0):
        envs.reset(seed=seed)
        starts.update(people())
        for _ in range(5):
            envs.step(np.array([[-1.0, 0.0]] * 2))
        ends.update(people())
    assert len(starts) == len(ends) == 4  # The last episodes repeat the first ones.


def test_people_that_nothing_wants_are_not_read(
    make: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[float] = []
    original = Pedestrians._read_people

    def read_people(plugin: Pedestrians, stamp: int) -> PeopleStates:
        read.append(plugin.world.time)
        return original(plugin, stamp)

    monkeypatch.setattr(Pedestrians, "_read_people", read_people)
    envs = make(make_vec, "flatland/Crowd-v0", 2, autoreset_mode="SameStep")
    envs.reset(seed=0)
    envs.step(np.zeros((2, 2)))
    assert read == []
    people: list[PeopleStates] = []
    envs.worlds[0].output("/people/states").subscribe(people.append)
    envs.step(np.zeros((2, 2)))
    assert len(people) == len(read) == 1
    assert people[0].poses[0] == pytest.approx(envs.worlds[0].model("person_0").pose, abs=0.2)


def test_episodes_among_people_equal_those_of_single_environments(
    equals_singles: Callable[..., Any], tmp_path: Path
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
    equals_singles(4, 60, world=path, max_steps=25)


def test_all_worlds_are_closed(created: list[flatland.World]) -> None:
    envs = FlatlandVectorEnv(2, OFFICES, max_steps=3)
    envs.reset(seed=7)
    for _ in range(20):
        envs.step(np.zeros((2, 2)))
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
    for seed in range(3):
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
