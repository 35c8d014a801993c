"""Environments for Gymnasium and PettingZoo."""
from flatland.gym.env import FlatlandEnv
from flatland.gym.vector import FlatlandVectorEnv
