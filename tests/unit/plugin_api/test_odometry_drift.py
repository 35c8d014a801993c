"""The odometry motion model against its closed-form moments."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import pytest

from flatland.geometry import Pose, compose, invert
from flatland.plugin_api.noise import NoiseStream
from flatland.plugin_api.odometry_drift import (
    SEGMENT_ANGLE,
    SEGMENT_LENGTH,
    DriftParameters,
    OdometryDrift,
)

SEEDS = 2000
START = (1.0, -2.0, 0.7)
LEVER = (-1.0, 0.2)


def arc(v: float, omega: float, duration: float, steps: int, start: Pose = START) -> list[Pose]:
    """Returns the poses after each step of a motion with constant velocities."""
    poses = []
    for t in (np.arange(1, steps + 1) * (duration / steps)).tolist():
        turn = omega * t
        chord = v * t * (math.sin(turn / 2) / (turn / 2) if turn else 1.0)
        x, y, _ = compose(start, (chord * math.cos(turn / 2), chord * math.sin(turn / 2), 0.0))
        poses.append((x, y, start[2] + turn))
    return poses


def drift(
    parameters: DriftParameters,
    seed: int = 1,
    start: Pose = START,
    center: tuple[float, float] = (0.0, 0.0),
) -> OdometryDrift:
    return OdometryDrift(parameters, NoiseStream([seed]), start, center)


def follow(estimator: OdometryDrift, poses: Sequence[Pose]) -> OdometryDrift:
    for pose in poses:
        estimator.advance(pose)
    return estimator


def errors(parameters: DriftParameters, poses: Sequence[Pose]) -> npt.NDArray[np.float64]:
    """Returns the end of the estimate relative to the start for each seed, shape (SEEDS, 3)."""
    to_start = invert(START)
    return np.array(
        [
            compose(to_start, follow(drift(parameters, seed), poses).pose)
            for seed in range(1, SEEDS + 1)
        ]
    )


def check_covariance(samples: npt.NDArray[np.float64], expected: npt.NDArray[np.float64]) -> None:
    """Compares a sample covariance, each entry relative to the standard deviations."""
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    scale[scale == 0.0] = 1.0
    # The standard error of a variance is sqrt(2 / SEEDS) = 3 %.
    assert np.abs((np.cov(samples.T) - expected) / scale).max() < 0.12


class TestMoments:
    def test_straight_line(self) -> None:
        a2, a3, n = 0.002, 0.01, 10
        samples = errors((0.5, a2, a3, 0.5), arc(1.0, 0.0, n * SEGMENT_LENGTH, 4 * n))
        length, total = SEGMENT_LENGTH, n * SEGMENT_LENGTH
        # Each segment adds a rotation, of which the lateral error is that at its middle.
        levers = total - (np.arange(n) + 0.5) * length
        turn = 2 * a2 * length**2
        expected = np.diag([n * a3 * length**2, turn * (levers**2).sum(), n * turn])
        expected[1, 2] = expected[2, 1] = turn * levers.sum()
        check_covariance(samples, expected)
        # The heading has a variance of up to n * turn, which shortens the path to second order.
        assert samples.mean(axis=0) == pytest.approx((total, 0.0, 0.0), abs=0.005)

    @pytest.mark.parametrize("side", [1.0, -1.0])
    def test_turn_in_place(self, side: float) -> None:
        a1, a4, n = 0.01, 0.0004, 6
        samples = errors((a1, 0.5, 0.5, a4), arc(0.0, side, n * SEGMENT_ANGLE, 4 * n))
        ends = side * np.arange(n + 1) * SEGMENT_ANGLE
        # A segment adds a translation along the headings in it.
        moves = np.stack([np.diff(np.sin(ends)), -np.diff(np.cos(ends))])
        expected = np.zeros((3, 3))
        expected[:2, :2] = a4 * moves @ moves.T
        expected[2, 2] = n * a1 * SEGMENT_ANGLE**2
        check_covariance(samples, expected)
        assert samples.mean(axis=0) == pytest.approx((0.0, 0.0, side * math.pi), abs=0.01)

    def test_reported_covariance_on_an_arc(self) -> None:
        parameters = (0.005, 0.002, 0.005, 0.002)
        poses = arc(0.6, 0.5, 8.0, 60)
        samples = errors(parameters, poses)
        turned = np.eye(3)
        c, s = math.cos(START[2]), math.sin(START[2])
        turned[:2, :2] = [[c, -s], [s, c]]
        # The mean over the seeds, since each is that at its own estimate.
        found = np.mean(
            [follow(drift(parameters, k), poses).pose_covariance() for k in range(1, 21)], axis=0
        )
        assert not found[2:5].any()
        planar = found[np.ix_((0, 1, 5), (0, 1, 5))]
        expected = turned @ np.cov(samples.T) @ turned.T
        scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
        assert np.abs((planar - expected) / scale).max() < 0.15

    def test_backward_motion_has_the_errors_of_forward_motion(self) -> None:
        parameters = (0.0, 0.002, 0.01, 0.0)
        ahead, back = (errors(parameters, arc(v, 0.0, 1.1, 12)) for v in (1.0, -1.0))
        assert np.std(ahead, axis=0) == pytest.approx(np.std(back, axis=0), rel=0.03)
        assert back[:, 0].mean() == pytest.approx(-1.1, abs=0.01)


class TestEstimate:
    PARAMETERS = (0.05, 0.02, 0.05, 0.02)

    def test_does_not_depend_on_the_step_size(self) -> None:
        ends = [
            follow(drift(self.PARAMETERS), arc(0.6, 0.5, 10.0, steps)).pose
            for steps in (400, 10000)
        ]
        truth = arc(0.6, 0.5, 10.0, 1)[0]
        # The steps in which segments end differ.
        assert ends[1] == pytest.approx(ends[0], abs=0.03)
        assert math.dist(ends[0], truth) > 0.2

    def test_parameters_of_zero_yield_the_true_pose(self) -> None:
        poses = arc(-0.6, 0.9, 5.0, 300)
        for pose, center in zip([poses[-1]] * 2, [(0.0, 0.0), LEVER], strict=True):
            exact = follow(drift((0.0, 0.0, 0.0, 0.0), center=center), poses)
            assert exact.pose == pytest.approx(pose, abs=1e-9)
            assert not exact.pose_covariance().any()

    def test_is_continuous_and_does_not_drift_at_rest(self) -> None:
        estimator, truth = drift(self.PARAMETERS), START
        for pose in arc(0.5, 0.3, 4.0, 800):
            before = estimator.pose
            estimator.advance(pose)
            moved = math.dist(truth[:2], pose[:2])
            assert math.dist(before[:2], estimator.pose[:2]) < 2 * moved
            truth = pose
        rest = estimator.pose
        follow(estimator, [truth] * 100)
        assert estimator.pose == rest

    def test_tiny_motions_accumulate(self) -> None:
        start = (0.0, 0.0, 0.0)
        estimator = drift((0.0, 0.0, 0.05, 0.0), start=start)
        for k in range(1, 20_001):
            estimator.advance((k * 5e-5, 0.0, 0.0))
        coarse = follow(drift((0.0, 0.0, 0.05, 0.0), start=start), arc(1.0, 0.0, 1.0, 50, start))
        assert estimator.pose == pytest.approx(coarse.pose, abs=0.01)
        assert abs(estimator.pose[0] - 1.0) > 0.01

    def test_sideways_motion_is_measured(self) -> None:
        estimator = drift((0.0, 0.0, 0.01, 0.0), start=(0.0, 0.0, 0.0))
        follow(estimator, [(0.0, 0.01 * k, 0.0) for k in range(1, 101)])
        x, y, yaw = estimator.pose
        assert (y, yaw) == pytest.approx((1.0, 0.0))
        assert x != 0.0

    def test_poses_that_are_not_finite_are_ignored(self) -> None:
        estimator = drift(self.PARAMETERS)
        follow(estimator, [(math.nan, 0.0, 0.0), (0.0, math.inf, 0.0), (0.0, 0.0, math.nan)])
        assert estimator.pose == START

    def test_another_center_has_the_errors_of_the_center(self) -> None:
        poses = arc(0.6, 0.5, 4.0, 400)
        of_center = follow(drift(self.PARAMETERS), poses)
        to_origin = (-LEVER[0], -LEVER[1], 0.0)
        start = compose(START, to_origin)
        of_origin = follow(
            drift(self.PARAMETERS, start=start, center=LEVER),
            [compose(pose, to_origin) for pose in poses],
        )
        assert of_origin.pose == pytest.approx(compose(of_center.pose, to_origin), abs=1e-9)
        # First order: the origin is displaced by the error of the yaw times the lever.
        x, y, _ = (np.array(of_origin.pose) - of_center.pose).tolist()
        shift = np.array([[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]])
        planar = np.ix_((0, 1, 5), (0, 1, 5))
        expected = shift @ of_center.pose_covariance()[planar] @ shift.T
        assert of_origin.pose_covariance()[planar] == pytest.approx(expected)


class TestVelocity:
    PARAMETERS = (0.05, 0.02, 0.05, 0.02)

    @pytest.mark.parametrize("center", [(0.0, 0.0), LEVER])
    def test_is_the_derivative_of_the_estimate(self, center: tuple[float, float]) -> None:
        dt, v, omega = 1e-4, 0.6, 0.5
        # The center moves along the x axis of the body.
        start = compose(START, (-center[0], -center[1], 0.0))
        estimator = drift(self.PARAMETERS, start=start, center=center)
        velocity = (v + omega * center[1], -omega * center[0], omega)
        measured = estimator.measure(velocity)
        estimator.advance(compose(arc(v, omega, dt, 1)[0], (-center[0], -center[1], 0.0)))
        moved = compose(invert(start), estimator.pose)
        assert np.array(moved) / dt == pytest.approx(measured, abs=1e-3)
        assert measured != pytest.approx(velocity, abs=1e-3)

    def test_covariance(self) -> None:
        velocity = (0.6, 0.5 * 1.0, 0.5)
        samples = np.array(
            [drift(self.PARAMETERS, k, center=LEVER).measure(velocity) for k in range(1, SEEDS + 1)]
        )
        found = drift(self.PARAMETERS, center=LEVER).twist_covariance(velocity)
        check_covariance(samples, found[np.ix_((0, 1, 5), (0, 1, 5))])
        c, s = math.cos(0.7), math.sin(0.7)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        turned = drift(self.PARAMETERS, center=LEVER).twist_covariance(velocity, 0.7)
        check_covariance(samples @ turn.T, turned[np.ix_((0, 1, 5), (0, 1, 5))])


class TestMove:
    PARAMETERS = (0.05, 0.02, 0.05, 0.02)
    FAR = (10.0, 20.0, -2.0)

    @pytest.fixture(params=[(0.0, 0.0), LEVER])
    def moving(self, request: pytest.FixtureRequest) -> OdometryDrift:
        return follow(drift(self.PARAMETERS, center=request.param), arc(0.6, 0.5, 4.0, 400))

    def test_the_estimate_is_kept(self, moving: OdometryDrift) -> None:
        last, before, covariance = arc(0.6, 0.5, 4.0, 1)[0], moving.pose, moving.pose_covariance()
        moving.move(last, self.FAR, keep=True)
        moving.advance(self.FAR)
        assert moving.pose == before
        assert np.array_equal(moving.pose_covariance(), covariance)
        moving.advance(compose(self.FAR, (0.001, 0.0, 0.0)))
        assert compose(invert(before), moving.pose) == pytest.approx((0.001, 0, 0), abs=5e-4)

    def test_the_estimate_jumps_along(self, moving: OdometryDrift) -> None:
        last, before = arc(0.6, 0.5, 4.0, 1)[0], moving.pose
        correction = compose(before, invert(last))
        moving.move(last, self.FAR, keep=False)
        assert moving.pose == pytest.approx(compose(correction, self.FAR), abs=1e-9)

    def test_a_motion_before_the_move_is_integrated(self, moving: OdometryDrift) -> None:
        last, before = arc(0.6, 0.5, 4.0, 1)[0], moving.pose
        moving.move(compose(last, (0.01, 0.0, 0.0)), self.FAR, keep=True)
        assert compose(invert(before), moving.pose)[0] == pytest.approx(0.01, rel=0.7)

    def test_a_pose_before_the_move_that_is_not_finite(self, moving: OdometryDrift) -> None:
        before = moving.pose
        moving.move((math.nan, math.nan, math.nan), self.FAR, keep=True)
        assert moving.pose == before
        moving.advance(self.FAR)
        assert moving.pose == before
