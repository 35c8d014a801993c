"""Environments with other spaces, with the checker and the algorithms of stable-baselines3."""

from __future__ import annotations

import pytest
from stable_baselines3 import DQN
from stable_baselines3.common.env_checker import check_env

from flatland.gym import DiscreteAction, FlatlandEnv, make_vec
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
