from __future__ import annotations

import sys

import numpy as np
import pytest

POLICY = """
import numpy as np
from flatland.gym import Goal, Observation, Scan, Velocity
from flatland.scenarios.policies import policy_controller

SEEN = []

def act(observation):
    SEEN.append(observation)
    cos, sin = observation["goal"][1:]
    return [2.0 * max(cos, 0.0) - 1.0, np.arctan2(sin, cos)]

Learned = policy_controller(
    act,
    low=(0.0, -1.0),
    high=(0.6, 1.0),
    observation=Observation(Scan(half=2.0), Goal(10.0), Velocity(), as_dict=True),
)
Nothing = policy_controller(lambda observation: [np.nan, 0.0], low=(0, -1), high=(1, 1))
"""


@pytest.fixture
def policy(room):
    (room / "policy.py").write_text(POLICY)


@pytest.mark.usefixtures("policy")
def test_a_policy_drives_to_the_goals(run):
    row = run("goals: [[5, 5], [3, 7]]", "policy.py:Learned").row
    assert row["outcome"] == "reached", row["error"]
    (module,) = [m for m in sys.modules.values() if hasattr(m, "SEEN") and hasattr(m, "Learned")]
    first = module.SEEN[0]
    # The goal is 3 m straight ahead, the wall 1 m behind, and the robot is at rest.
    assert first["goal"] == pytest.approx([0.3, 1.0, 0.0], abs=1e-3)
    assert first["velocity"] == pytest.approx([0.0, 0.0], abs=1e-3)
    speeds = np.array([seen["velocity"][0] for seen in module.SEEN])
    assert speeds.max() == pytest.approx(1.0, abs=0.01)


@pytest.mark.usefixtures("policy")
def test_an_action_that_is_not_finite_is_an_error(run):
    row = run("goal: [5, 5]", "policy.py:Nothing").row
    assert "not finite" in row["error"]
