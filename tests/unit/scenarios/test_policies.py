from __future__ import annotations

import shutil
import sys

import numpy as np
import pytest

from flatland.gym.policies import INCLUDED
from flatland.scenarios.controllers import ControllerError, controller_digest, find_controller
from flatland.scenarios.policies import _ranges_of_hits
from flatland.scenarios.task import Scan

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
    # `vars`, because hasattr() of a lazily imported module would change sys.modules.
    (module,) = [m for m in sys.modules.values() if {"SEEN", "Learned"} <= vars(m).keys()]
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


def test_the_included_policy_and_one_in_a_file_drive_to_the_goals(run, room):
    shutil.copy(INCLUDED, room / "other.onnx")
    row, included = (run("goals: [[5, 5], [3, 7]]", name).row for name in ("other.onnx", "policy"))
    assert row["outcome"] == "reached", row["error"]
    assert row["path_length"] == included["path_length"]


@pytest.mark.parametrize(
    ("content", "message"), [(None, "file not found"), (b"x", "not a valid ONNX file")]
)
def test_an_invalid_file_of_a_policy_is_an_error(content, message, tmp_path):
    if content is not None:
        (tmp_path / "other.onnx").write_bytes(content)
    with pytest.raises(ControllerError, match=message):
        find_controller("other.onnx", str(tmp_path))


def test_the_digest_of_a_policy_is_that_of_its_file(tmp_path):
    path = tmp_path / "other.onnx"
    shutil.copy(INCLUDED, path)
    first = controller_digest("other.onnx", str(tmp_path))
    path.write_bytes(path.read_bytes().replace(b'"dt": 0.1', b'"dt": 0.2'))
    assert first != controller_digest("other.onnx", str(tmp_path))
    assert controller_digest("policy", str(tmp_path)) == ""


def test_hits_become_the_ranges_of_another_laser():
    points = np.array([(2.0, 0.0), (1.5, 0.01), (0.0, -3.0), (-1.0, 0.0), (9.0, 9.0)])
    scan = Scan(np.hypot(*points.T), 20.0, points)
    ranges, max_range = _ranges_of_hits(8, 6.0, 0.1, scan)
    assert max_range == 6.0
    np.testing.assert_allclose(ranges, [0.9, 6, 2.9, 6, 1.4, 6, 6, 6], atol=1e-4)


def test_another_period_than_that_of_the_training_is_an_error(run):
    row = run("goal: [5, 5]\nrobot: {period: 0.5}", "policy").row
    assert row["outcome"] == "error"
    assert "was trained with actions of 0.1 s, here they last 0.5 s" in row["error"]
