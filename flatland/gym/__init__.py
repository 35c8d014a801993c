"""Environments for Gymnasium and PettingZoo: robots that learn to navigate.

Importing this package registers `flatland/Navigate-v0` and other environments with Gymnasium.
`gymnasium.make("flatland.gym:flatland/Navigate-v0")` imports it. `docs/learning.md` describes the
environments.
"""

from flatland.extras import require

# Otherwise, a missing package results in a traceback without a remedy.
require("gymnasium", "flatland.gym requires")

from flatland.gym.actions import (
    Action,
    DiscreteAction,
    HolonomicAction,
    SteeringAction,
    VelocityAction,
)
from flatland.gym.agents import Agent
from flatland.gym.buildings import Buildings, RandomBuildings
from flatland.gym.endings import AnyOf, Arrived, Collided, Ending, Strayed
from flatland.gym.env import FlatlandEnv
from flatland.gym.evaluation import Outcomes, evaluate
from flatland.gym.fleet_vector import FleetVectorEnv
from flatland.gym.maps import Costmap, LocalMap
from flatland.gym.observations import (
    Goal,
    LastAction,
    Observation,
    ObservationPart,
    Scan,
    Stacked,
    Velocity,
)
from flatland.gym.places import Places
from flatland.gym.randomization import (
    BeamDropout,
    CommandLatency,
    DriveLimits,
    Friction,
    ObservationLatency,
    ObstacleSize,
    Payload,
    Randomization,
    RandomizationSum,
    RobotSize,
    ScanDropout,
    ScanNoise,
)
from flatland.gym.registration import make_parallel, make_vec, register_all
from flatland.gym.rewards import (
    Arrival,
    Contact,
    Jerkiness,
    Progress,
    Proximity,
    Reward,
    Step,
    navigation_reward,
)
from flatland.gym.settings import Settings
from flatland.gym.situation import Situation
from flatland.gym.tasks import FixedGoal, Occupied, RandomGoal, Task
from flatland.gym.vector import FlatlandVectorEnv
from flatland.gym.worlds import find_world, included_robot

register_all()

__all__ = [
    "Action",
    "Agent",
    "AnyOf",
    "Arrival",
    "Arrived",
    "BeamDropout",
    "Buildings",
    "Collided",
    "CommandLatency",
    "Contact",
    "Costmap",
    "DiscreteAction",
    "DriveLimits",
    "Ending",
    "FixedGoal",
    "FlatlandEnv",
    "FlatlandVectorEnv",
    "FleetVectorEnv",
    "Friction",
    "Goal",
    "HolonomicAction",
    "Jerkiness",
    "LastAction",
    "LocalMap",
    "Observation",
    "ObservationLatency",
    "ObservationPart",
    "ObstacleSize",
    "Occupied",
    "Outcomes",
    "Payload",
    "Places",
    "Progress",
    "Proximity",
    "RandomBuildings",
    "RandomGoal",
    "Randomization",
    "RandomizationSum",
    "Reward",
    "RobotSize",
    "Scan",
    "ScanDropout",
    "ScanNoise",
    "Settings",
    "Situation",
    "Stacked",
    "SteeringAction",
    "Step",
    "Strayed",
    "Task",
    "Velocity",
    "VelocityAction",
    "evaluate",
    "find_world",
    "included_robot",
    "make_parallel",
    "make_vec",
    "navigation_reward",
]
