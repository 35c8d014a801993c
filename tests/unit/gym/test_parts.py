"""Observations, actions, rewards and endings."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from gymnasium import spaces

from flatland.gym import (
    Arrival,
    Arrived,
    Collided,
    Contact,
    Goal,
    Jerkiness,
    LastAction,
    Observation,
    Progress,
    Proximity,
    Reward,
    Scan,
    Situation,
    Step,
    Strayed,
    Velocity,
    VelocityAction,
    navigation_reward,
)
from flatland.gym.rewards import Sum


@pytest.fixture
def situation() -> Situation:
    """Two agents with six beams of 4 m; the second has arrived."""
    s = Situation(2, 6, 4.0, np.array([0.0, -2.0]), np.array([1.0, 2.0]))
    s.ranges[0] = [1.0, 2.0, math.nan, math.inf, -math.inf, 4.0]
    s.ranges[1] = math.nan
    s.poses[:] = [(1.0, 1.0, math.pi / 2), (5.0, 5.0, 0.0)]
    s.velocities[:] = [(0.1, 0.5, -1.0), (9.0, 0.0, 9.0)]
    s.goals[:] = [(1.0, 3.0), (5.0, 5.0)]
    s.locate(0.3)
    return s


def written(observation: Observation, situation: Situation) -> np.ndarray:
    layout = observation.layout(6)
    out = np.full((2, layout.size), np.nan, np.float32)
    layout.write(situation, out)
    assert all(layout.space.contains(layout.present(row)) for row in out)
    return out


def test_parts_are_columns_or_entries(situation: Situation) -> None:
    situation.actions[:] = [(0.5, -0.5), (1.0, 0.0)]
    parts = (Goal(), LastAction(), Velocity())
    flat = written(Observation(*parts), situation)
    layout = Observation(*parts, as_dict=True).layout(6)
    assert isinstance(layout.space, spaces.Dict)
    entries = layout.present(flat)
    assert list(entries) == list(layout.space) == ["goal", "last_action", "velocity"]
    np.testing.assert_array_equal(np.concatenate(list(entries.values()), axis=1), flat)
    np.testing.assert_array_equal(entries["last_action"], situation.actions)


def test_two_parts_of_one_name_are_an_error() -> None:
    with pytest.raises(ValueError, match="different names"):
        Observation(Scan(2), Scan(3))


@pytest.mark.parametrize(
    "make",
    [
        lambda: Scan(0),
        lambda: Scan(half=0.0),
        lambda: Goal(scale=0.0),
        lambda: Proximity(-1.0),
        lambda: Strayed(math.nan),
        lambda: VelocityAction(speed=(1.0, 0.0)),
        lambda: VelocityAction(yaw_rate=math.inf),
    ],
)
def test_a_number_out_of_range_is_an_error(make: Callable[[], object]) -> None:
    with pytest.raises(ValueError, match="must be"):
        make()


def test_rewards_are_scaled_and_added_up(situation: Situation) -> None:
    situation.previous_distance[:] = [2.5, 0.4]
    situation.collided[:] = [True, False]
    reward = 2.0 * Progress() + Contact() * -3.0 + Step()
    np.testing.assert_allclose(reward.compute(situation), [2 * 0.5 - 3 + 1, 2 * 0.4 + 1])
    np.testing.assert_array_equal(Arrival().compute(situation), [0, 1])
    np.testing.assert_allclose(
        navigation_reward().compute(situation), [0.5 - 5 - 0.02, 0.4 + 5 - 0.02]
    )


def test_the_core_adds_up_the_included_rewards_like_any_others(situation: Situation) -> None:
    class Other(Progress):
        """Computed in Python, since it could be something else."""

    situation.previous_distance[:] = [2.7, 0.1]
    situation.collided[:] = [True, False]
    terms = [0.3 * Progress(), -0.7 * Contact(), 0.1 * Step(), 1.7 * Arrival()]
    expected = np.zeros(2)
    for term in terms:
        expected += term.compute(situation)
    np.testing.assert_array_equal(Sum(*terms).compute(situation), expected)
    terms[0] = 0.3 * Other()
    np.testing.assert_array_equal(Sum(*terms).compute(situation), expected)
    terms[1].factor = 0.0  # type: ignore[attr-defined]
    expected = terms[0].compute(situation) + 0.1 + terms[3].compute(situation)
    np.testing.assert_allclose(Sum(*terms).compute(situation), expected)
    assert Sum().compute(situation).tolist() == [0.0, 0.0]
    with pytest.raises(ValueError, match="no rewarded quantity 4"):
        situation.core.rewards([(4, 1.0)])


def test_a_change_of_the_action_is_jerky(situation: Situation) -> None:
    situation.actions[:] = [(1.0, 1.0), (0.0, 0.0)]
    situation.previous_actions[:] = [(0.5, 0.0), (0.0, 0.0)]
    np.testing.assert_allclose(Jerkiness().compute(situation), [1.25, 0.0])


def test_proximity_counts_the_nearest_obstacle(situation: Situation) -> None:
    situation.ranges[0, 4] = 2.0
    np.testing.assert_allclose(Proximity(4.0).compute(situation), [0.75, 0.0])


def test_endings_are_combined(situation: Situation) -> None:
    situation.collided[:] = [True, False]
    assert Arrived().check(situation).tolist() == [False, True]
    assert Collided().check(situation).tolist() == [True, False]
    assert (Arrived() | Collided()).check(situation).tolist() == [True, True]
    assert Strayed(1.0).check(situation).tolist() == [True, False]


def test_rows_are_taken_and_put_back(situation: Situation) -> None:
    rows = np.array([1])
    part = situation.take(rows)
    part.goals[:] = 7.0
    assert situation.goals[1].tolist() == [5.0, 5.0]
    situation.put(rows, part)
    assert situation.goals.tolist() == [[1.0, 3.0], [7.0, 7.0]]


def random_situation(n: int, beams: int) -> Situation:
    rng = np.random.default_rng(0)
    situation = Situation(n, beams, 4.0, np.array([-0.5, -2.0]), np.array([1.0, 2.0]))
    for array in (situation.poses, situation.velocities, situation.goals):
        array[:] = rng.uniform(-5, 5, array.shape)
    situation.ranges[:] = rng.uniform(0.0, 6.0, (n, beams))
    for value in (np.nan, np.inf, -np.inf, 4.0):
        situation.ranges[rng.random((n, beams)) < 0.1] = value
    situation.goals[0] = situation.poses[0, :2]  # at the goal
    return situation


def test_observations_are_those_of_their_formulas() -> None:
    n, beams = 50, 12
    s = random_situation(n, beams)
    s.locate(0.8)
    dx, dy = (s.goals - s.poses[:, :2]).T
    theta = s.poses[:, 2]
    ahead, left = dx * np.cos(theta) + dy * np.sin(theta), dy * np.cos(theta) - dx * np.sin(theta)
    assert s.goal_ahead == pytest.approx(ahead, abs=1e-12)
    assert s.goal_left == pytest.approx(left, abs=1e-12)
    assert s.distance == pytest.approx(np.hypot(dx, dy))
    assert (s.arrived == (np.hypot(dx, dy) <= 0.8)).all()
    assert 0 < s.arrived.sum() < n
    vx, vy, omega = s.velocities.T
    assert s.speed == pytest.approx(vx * np.cos(theta) + vy * np.sin(theta), abs=1e-12)
    assert (s.yaw_rate == omega).all()

    layout = Observation(Scan(), Goal(3.0), Velocity()).layout(beams)
    out = np.full((n, layout.size), 9.0, np.float32)
    layout.write(s, out)
    scan = np.maximum(np.fmin(s.ranges, np.float32(4.0)), np.float32(0.0)) / np.float32(4.0)
    assert out[:, :beams].tobytes() == scan.tobytes()
    unit = np.maximum(s.distance, 1e-9)
    goal = np.column_stack(
        (np.minimum(s.distance / 3.0, 1), s.goal_ahead / unit, s.goal_left / unit)
    )
    velocity = np.column_stack((s.speed / 1.0, s.yaw_rate / 2.0))
    rest = np.clip(np.hstack((goal, velocity)).astype(np.float32), -1, 1)
    assert out[:, beams:].tobytes() == rest.tobytes()
    assert (out[0, beams : beams + 3] == 0).all()


def test_sectors_of_random_scans_have_their_nearest_ranges() -> None:
    n, beams, sectors = 50, 12, 4
    s = random_situation(n, beams)
    out = np.full((n, sectors), 9.0, np.float32)
    Scan(sectors, half=1.5).write(s, out)
    nearest = np.fmin.reduce(s.ranges.reshape(n, sectors, -1), axis=2)
    scaled = np.maximum(nearest, np.float32(0.0))
    with np.errstate(invalid="ignore"):
        expected = np.where(nearest < 4.0, scaled / (scaled + np.float32(1.5)), np.float32(1.0))
    assert out.tobytes() == expected.astype(np.float32).tobytes()


def test_a_sum_is_independent_of_the_arrays_of_its_terms(situation: Situation) -> None:
    class Constant(Reward):
        numbers = np.array([1, 2])

        def compute(self, situation: Situation) -> np.ndarray:
            return self.numbers

    total = Sum(Constant()).compute(situation)
    total[:] = 0.5
    assert Constant.numbers.tolist() == [1, 2]
    assert total.dtype == np.float64
