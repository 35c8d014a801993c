"""Several worlds with several robots as one vector: equal to as many fleets."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from gymnasium.error import InvalidAction, ResetNeeded
from gymnasium.vector import AutoresetMode
from nested import assert_same

from flatland.errors import WorldError
from flatland.gym import (
    CommandLatency,
    DiscreteAction,
    FleetVectorEnv,
    Goal,
    Observation,
    RandomGoal,
    Scan,
    ScanNoise,
    Stacked,
    Velocity,
    make_parallel,
)

Make = Callable[..., Any]
WORLDS, ROBOTS = 3, 2
ROWS = WORLDS * ROBOTS
RANDOMIZED = {
    "randomization": ScanNoise((0.0, 0.1)) + CommandLatency((0, 2)),
    "observation": Observation(Stacked(Scan(12), 2), Goal(), Velocity()),
}


class Fleets:
    """Fleets that are stepped one after the other, with the results of a vector."""

    def __init__(self, make: Make, mode: AutoresetMode, **kwargs: Any) -> None:
        self.mode = mode
        self.envs = [make(make_parallel, num_robots=ROBOTS, **kwargs) for _ in range(WORLDS)]
        self.over = [False] * WORLDS

    def reset(self, seed: int) -> list[Any]:
        found = []
        for number, env in enumerate(self.envs):
            observations, _ = env.reset(seed=seed + number * ROBOTS)
            found += [observations[name] for name in env.possible_agents]
        return found

    def step(self, actions: np.ndarray) -> list[dict[str, Any]]:
        """Returns what is known of each robot: a robot without an episode has nothing."""
        found: list[dict[str, Any]] = []
        for number, env in enumerate(self.envs):
            rows = dict(zip(env.possible_agents, range(number * ROBOTS, ROWS), strict=False))
            known: dict[str, dict[str, Any]] = {name: {} for name in rows}
            if self.mode is AutoresetMode.NEXT_STEP and self.over[number]:
                self.over[number] = False
                for name, each in env.reset()[0].items():
                    known[name] = {"observation": each, "fresh": True}
            else:
                results = env.step({name: actions[rows[name]] for name in env.agents})
                keys = ("observation", "reward", "terminated", "truncated", "info")
                for name in results[0]:
                    known[name] = dict(zip(keys, (r[name] for r in results), strict=True))
                self.over[number] = not env.agents
            if self.mode is AutoresetMode.SAME_STEP and self.over[number]:
                self.over[number] = False
                for name, each in env.reset()[0].items():
                    known[name]["next"] = each
            found += [known[name] for name in rows]
        return found


def check_row(row: int, known: dict[str, Any], result: Any, mode: AutoresetMode) -> None:
    observations, rewards, terminated, truncated, infos = result
    ended = bool(terminated[row] or truncated[row])
    assert infos["is_active"][row] == ("reward" in known)
    if "reward" not in known:
        assert rewards[row] == 0.0
        assert not ended
    else:
        assert rewards[row] == known["reward"]
        assert (terminated[row], truncated[row]) == (known["terminated"], known["truncated"])
        is_final = ended and mode is AutoresetMode.SAME_STEP
        observed = infos["final_obs"][row] if is_final else observations[row]
        assert_same(observed, known["observation"])
        info = infos["final_info"] if is_final else infos
        assert {name: info[name][row] for name in known["info"]} == known["info"]
    if "next" in known or "fresh" in known:
        first = known["next" if "next" in known else "observation"]
        assert_same(observations[row], first)
    elif "reward" not in known or (ended and mode is AutoresetMode.SAME_STEP):
        assert not observations[row].any()


@pytest.mark.parametrize(
    ("mode", "num_threads", "kwargs"),
    [
        (AutoresetMode.NEXT_STEP, 0, {}),
        (AutoresetMode.SAME_STEP, 1, RANDOMIZED),
        (AutoresetMode.DISABLED, 5, RANDOMIZED),
    ],
)
def test_it_equals_fleets(
    make: Make, mode: AutoresetMode, num_threads: int, kwargs: dict[str, Any]
) -> None:
    kwargs = {"max_steps": 15, "task": RandomGoal((0.5, 2.0)), **kwargs}
    vector = {"autoreset_mode": mode, "num_threads": num_threads}
    envs = make(FleetVectorEnv, WORLDS, num_robots=ROBOTS, **vector, **kwargs)
    fleets = Fleets(make, mode, **kwargs)
    observations, infos = envs.reset(seed=7)
    assert_same(list(observations), fleets.reset(7))
    assert infos["_distance"].all()
    rng = np.random.default_rng(0)
    ends = idle = 0
    for _ in range(60):
        actions = rng.uniform([0.0, -1.0], [1.0, 1.0], (ROWS, 2)).astype(np.float32)
        result = envs.step(actions)
        for row, known in enumerate(fleets.step(actions)):
            check_row(row, known, result, mode)
        ends += (result[2] | result[3]).sum()
        idle += (~result[4]["is_active"]).sum()
        over = np.repeat([not env.agents for env in fleets.envs], ROBOTS)
        if mode is AutoresetMode.DISABLED and over.any():
            first = envs.reset(options={"reset_mask": over})[0]
            for number, env in enumerate(fleets.envs):
                if not env.agents:
                    expected = list(env.reset()[0].values())
                    assert_same(list(first[number * ROBOTS :][:ROBOTS]), expected)
    assert ends > 2 * ROWS
    assert idle > ROWS


def test_spaces_and_attributes(make: Make) -> None:
    action = DiscreteAction([(1.0, 0.0), (0.0, 1.0)])
    observation = Observation(Scan(6), Goal(), as_dict=True)
    envs = make(FleetVectorEnv, 2, num_robots=3, action=action, observation=observation)
    observations, infos = envs.reset(seed=0)
    assert (envs.num_envs, envs.num_worlds, envs.num_robots) == (6, 2, 3)
    assert envs.observation_space.contains(observations)
    observations, *_ = envs.step(envs.action_space.sample())
    assert envs.observation_space.contains(observations)
    assert envs.poses.shape == (6, 3)
    gaps = np.hypot(*(envs.goals - envs.poses[:, :2]).T)
    assert gaps == pytest.approx(envs.episodes.situation.distance)
    assert len(envs.worlds) == 2
    assert envs.np_random_seed == (0, 0, 0, 3, 3, 3)
    assert len(envs.np_random) == 6
    assert infos["distance"].shape == (6,)


def test_a_copy_continues_with_the_next_episodes(make: Make) -> None:
    envs = make(FleetVectorEnv, 2, num_robots=2)
    envs.reset(seed=5)
    envs.task = RandomGoal((3.0, 4.0))
    other = make(lambda: copy.deepcopy(envs))
    first = envs.reset()
    assert_same(other.reset(), first)
    assert (first[1]["distance"] >= 3.0).all()


def test_a_world_without_room_is_an_error(make: Make) -> None:
    envs = make(FleetVectorEnv, 1, world="corridor", num_robots=40)
    with pytest.raises(WorldError, match="world 0: no free place"):
        envs.reset(seed=0)
    with pytest.raises(ResetNeeded):
        envs.step(np.zeros((40, 2)))


def test_misuse_is_an_error(make: Make) -> None:
    envs = make(FleetVectorEnv, 2, num_robots=2, autoreset_mode="Disabled", max_steps=1)
    with pytest.raises(ResetNeeded, match="no episode has begun"):
        envs.step(np.zeros((4, 2)))
    envs.reset(seed=0)
    for actions in (np.zeros((2, 2)), np.full((4, 2), np.nan)):
        with pytest.raises(InvalidAction):
            envs.step(actions)
    envs.step(np.zeros((4, 2)))
    with pytest.raises(ResetNeeded, match="all episodes of world 0 have ended"):
        envs.step(np.zeros((4, 2)))
    for options, error in (
        ({"start": (1, 1, 0)}, ValueError),
        ({"reset_mask": np.array([True, False, False, False])}, ValueError),
        ({"reset_mask": np.zeros(4, np.bool_)}, ValueError),
        ({"reset_mask": [True] * 4}, TypeError),
    ):
        with pytest.raises(error, match="reset_mask"):
            envs.reset(options=options)


@pytest.mark.parametrize(
    ("kwargs", "error", "message"),
    [
        ({"num_envs": 0}, ValueError, "num_envs"),
        ({"num_robots": 0}, ValueError, "num_robots"),
        ({"agent": "robot_1"}, TypeError, "agent"),
        ({"autoreset_mode": "Never"}, ValueError, "Never"),
    ],
)
def test_an_invalid_argument_is_an_error(
    kwargs: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        FleetVectorEnv(**kwargs)
