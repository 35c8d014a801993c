"""Environments of all kinds with the checker and the algorithms of stable-baselines3."""

from __future__ import annotations

import pytest
from stable_baselines3 import DQN, PPO
from stable_baselines3.common.env_checker import check_env

from flatland.gym import (
    Costmap,
    DiscreteAction,
    FlatlandEnv,
    Goal,
    LocalMap,
    Observation,
    RandomGoal,
    Stacked,
    make_vec,
)
from flatland.gym.stable_baselines import StableVector

pytestmark = [
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
]
TURNS = DiscreteAction([(0.0, 1.5), (0.8, 0.0), (0.0, -1.5)])


def test_deep_q_learning_with_discrete_actions() -> None:
    single = FlatlandEnv("corridor", action=TURNS)
    check_env(single)
    single.close()
    envs = StableVector(
        make_vec("flatland/Corridor-v0", 4, autoreset_mode="SameStep", action=TURNS)
    )
    model = DQN("MlpPolicy", envs, learning_starts=50, buffer_size=1000, seed=0)
    model.learn(400)
    actions, _ = model.predict(envs.reset(), deterministic=True)
    assert actions.shape == (4,)
    assert model.num_timesteps >= 400
    envs.close()


@pytest.mark.parametrize(
    ("policy", "observation"),
    [
        ("CnnPolicy", Observation(Costmap(40))),
        ("CnnPolicy", Observation(Stacked(LocalMap(36, 0.2), 2))),
        ("MultiInputPolicy", Observation(Costmap(36), Goal(), as_dict=True)),
    ],
)
def test_a_convolutional_network_learns_from_images(policy: str, observation: Observation) -> None:
    single = FlatlandEnv("corridor", observation=observation)
    check_env(single)
    single.close()
    envs = StableVector(
        make_vec("flatland/Corridor-v0", 2, autoreset_mode="SameStep", observation=observation)
    )
    model = PPO(policy, envs, n_steps=16, batch_size=16, n_epochs=1, seed=0)
    model.learn(64)
    assert model.predict(envs.reset())[0].shape == (2, 2)
    envs.close()


def test_robots_of_fleets_learn_together() -> None:
    envs = StableVector(
        make_vec("flatland/Fleet-v0", 2, num_robots=3, autoreset_mode="SameStep", max_steps=8)
    )
    assert envs.num_envs == 6
    model = PPO("MlpPolicy", envs, n_steps=32, batch_size=32, n_epochs=1, seed=0)
    model.learn(6 * 64)
    lengths = [episode["l"] for episode in model.ep_info_buffer]
    assert len(lengths) > 6
    assert max(lengths) <= 8
    envs.close()


def test_a_callback_may_change_the_task() -> None:
    envs = StableVector(make_vec("flatland/Corridor-v0", 2, autoreset_mode="SameStep"))
    task = RandomGoal((4.0, 6.0))
    envs.set_attr("task", task)
    assert envs.get_attr("task") == [task, task]
    envs.seed(0)
    envs.reset()
    assert (envs.envs.episodes.situation.distance >= 4.0).all()
    for name, indices in (("task", [0]), ("goals", None)):
        with pytest.raises(AttributeError, match="share"):
            envs.set_attr(name, task, indices)
    envs.close()
