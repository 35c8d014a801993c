"""Odometry of both drives: `odom_drift`, and models that are moved."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
import tricycle

import flatland
from flatland.geometry import Pose, compose, invert

Collect = Callable[[flatland.World, str], list[Any]]
Load = Callable[..., flatland.World]

TRUTH, ODOMETRY = "/odometry/ground_truth", "/odometry/filtered"
DRIFT = "odom_drift: [0.05, 0.02, 0.05, 0.02]"
START = (1.0, 2.0, 0.5)

_DIFF = "- {name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}"


@pytest.fixture(params=["DiffDrive", "TricycleDrive"])
def robot(request: pytest.FixtureRequest, plugin_world: Any) -> Load:
    """Loads a world with a robot at `START`, once with each of the drives."""

    def load(extra: str = "", **options: Any) -> flatland.World:
        drive, bodies, joints = "type: DiffDrive, name: drive, body: base", _DIFF, ""
        if request.param == "TricycleDrive":
            drive, bodies, joints = (
                f"{tricycle.DRIVE}, command: twist",
                tricycle.BODIES,
                tricycle.JOINTS,
            )
        drive += f", enable_odom_tf_pub: true, {extra}"
        options = {"pose": START, **options}
        world: flatland.World = plugin_world(
            f"- {{{drive}}}", bodies=bodies, joints=joints, **options
        )
        command(world, 0.5, 0.4)
        return world

    return load


def command(world: flatland.World, v: float, omega: float) -> None:
    world.command("/cmd_vel").set(flatland.Twist(linear_x=v, angular_z=omega))


def transform(world: flatland.World) -> Pose:
    sent = world.transforms["odom", "base"]
    return (sent.x, sent.y, sent.yaw)


def poses(values: Sequence[Any]) -> list[Pose]:
    return [value.pose for value in values]


class TestDrift:
    def test_the_ground_truth_and_the_motion_are_exact(self, robot: Load, collect: Collect) -> None:
        exact, drifting = robot(), robot(DRIFT)
        for world in (exact, drifting):
            world.output(TRUTH)
            world.step(300)
        assert poses([drifting.output(TRUTH).latest]) == poses([exact.output(TRUTH).latest])
        assert drifting.output(TRUTH).latest.twist == exact.output(TRUTH).latest.twist

    def test_does_not_depend_on_subscribers_and_rates(self, robot: Load, collect: Collect) -> None:
        def end(extra: str, connects_at: int = 0, topics: Sequence[str] = (ODOMETRY,)) -> Pose:
            world = robot(f"{DRIFT}, {extra}")
            world.step(connects_at)
            for topic in topics:
                world.output(topic)
            world.step(401 - connects_at)
            return transform(world)

        alone = end("", topics=())
        exact = robot()
        exact.step(401)
        assert alone != pytest.approx(transform(exact), abs=1e-3)
        assert end("") == alone
        assert end("", 400) == alone
        assert end("pub_rate: 10") == alone
        assert end("", 200, (TRUTH,)) == alone

    def test_transform_and_odometry_agree(self, robot: Load, collect: Collect) -> None:
        world = robot(f"{DRIFT}, odom_pose_noise: [0.01, 0.01, 0.01]")
        odometry = collect(world, ODOMETRY)
        world.step(50)
        assert transform(world) == odometry[-1].pose

    def test_white_noise_is_added_to_the_drifting_pose(self, robot: Load, collect: Collect) -> None:
        drifting, noisy = robot(DRIFT), robot(f"{DRIFT}, odom_pose_noise: [0.04, 0.09, 0.16]")
        exact, measured = collect(drifting, ODOMETRY), collect(noisy, ODOMETRY)
        drifting.step(1000)
        noisy.step(1000)
        noise = np.array(poses(measured)) - poses(exact)
        assert noise.std(axis=0) == pytest.approx([0.2, 0.3, 0.4], rel=0.08)
        assert abs(np.corrcoef(noise[1:, 0], noise[:-1, 0])[0, 1]) < 0.1
        added = measured[-1].pose_covariance - exact[-1].pose_covariance
        assert added == pytest.approx(np.diag([0.04, 0.09, 0, 0, 0, 0.16]))

    @pytest.mark.parametrize("local", ["true", "false"])
    def test_the_twist_is_that_of_the_drifting_pose(
        self, robot: Load, collect: Collect, local: str
    ) -> None:
        world = robot(f"{DRIFT}, twist_in_local_frame: {local}")
        odometry, truths = collect(world, ODOMETRY), collect(world, TRUTH)
        world.step(1000)
        assert odometry[0].pose == truths[0].pose == pytest.approx(START)
        found = np.array([value.twist for value in odometry])
        # The derivative of the pose [1/s], in the frame of the odometry.
        moved = np.diff(np.array(poses(odometry)), axis=0) / 0.005
        if local == "true":
            middle = np.array(poses(odometry))[:-1, 2] + moved[:, 2] * 0.0025
            c, s = np.cos(middle), np.sin(middle)
            x, y = moved[:, 0], moved[:, 1]
            moved[:, 0], moved[:, 1] = c * x + s * y, c * y - s * x
        # The first steps accelerate; segments end between two values.
        matches = np.abs(found[10:-1] - moved[10:]).max(axis=1) < 0.01
        assert matches.mean() > 0.95
        assert np.abs(found[10:] - [value.twist for value in truths[10:]]).max() > 0.02

    def test_covariances_grow(self, robot: Load, collect: Collect) -> None:
        world = robot(f"{DRIFT}, odom_twist_noise: [0.1, 0.2, 0.3]")
        odometry = collect(world, ODOMETRY)
        world.step(1000)
        assert not odometry[0].pose_covariance.any()
        traces = [np.trace(value.pose_covariance) for value in odometry]
        assert traces[200] < traces[500] < traces[-1]
        drift = odometry[-1].twist_covariance - np.diag([0.1, 0.2, 0, 0, 0, 0.3])
        # a3 v² + a4 omega² and a1 omega² + 2 a2 v²
        assert drift[0, 0] == pytest.approx(0.05 * 0.25 + 0.02 * 0.16, rel=0.2)
        assert drift[5, 5] == pytest.approx(0.05 * 0.16 + 2 * 0.02 * 0.25, rel=0.01)

    def test_configured_covariances_are_published(self, robot: Load, collect: Collect) -> None:
        pose, twist = list(range(36)), list(range(100, 136))
        world = robot(f"{DRIFT}, odom_pose_covariance: {pose}, odom_twist_covariance: {twist}")
        odometry = collect(world, ODOMETRY)
        world.step(100)
        assert odometry[-1].pose_covariance.ravel().tolist() == pose
        assert odometry[-1].twist_covariance.ravel().tolist() == twist


def test_the_twist_topic_has_the_errors_of_the_odometry(
    plugin_world: Any, collect: Collect
) -> None:
    world = plugin_world(f"- {{type: DiffDrive, name: drive, body: base, {DRIFT}}}")
    odometry, twists = collect(world, ODOMETRY), collect(world, "/twist")
    command(world, 0.5, 0.4)
    world.step(100)
    assert twists[-1].twist == pytest.approx(odometry[-1].twist, abs=1e-6)
    assert twists[-1].twist != pytest.approx((0.5, 0.0, 0.4), abs=1e-3)
    assert twists[-1].covariance == pytest.approx(odometry[-1].twist_covariance)


@pytest.mark.parametrize("extra", ["", f"{DRIFT}, after_step: true"])
class TestMovedModel:
    FAR = (-7.0, 4.0, 2.5)

    def test_the_odometry_is_kept(self, robot: Load, collect: Collect, extra: str) -> None:
        world = robot(extra)
        truths, odometry = collect(world, TRUTH), collect(world, ODOMETRY)
        world.step(300)
        world.move_model("robot", self.FAR, keep_odometry=True)
        world.step(1)
        before, after = odometry[-2:]
        assert math.dist(before.pose[:2], after.pose[:2]) < 0.01
        assert truths[-1].pose == pytest.approx(self.FAR, abs=0.01)
        assert transform(world) == after.pose
        # From there it moves as the robot does.
        world.step(200)
        moved = compose(invert(after.pose), odometry[-1].pose)
        true_moved = compose(invert(truths[-201].pose), truths[-1].pose)
        assert moved == pytest.approx(true_moved, abs=0.2 if DRIFT in extra else 1e-4)
        assert true_moved[2] == pytest.approx(0.4, abs=0.01)

    def test_the_odometry_jumps_along_by_default(
        self, robot: Load, collect: Collect, extra: str
    ) -> None:
        world = robot(extra)
        truths, odometry = collect(world, TRUTH), collect(world, ODOMETRY)
        world.step(300)

        def correction() -> Pose:
            """Pose of the world frame in the odometry frame."""
            return compose(odometry[-1].pose, invert(truths[-1].pose))

        before = correction()
        world.move_model("robot", self.FAR)
        world.step(1)
        assert correction() == pytest.approx(before, abs=0.01)
        assert (before != pytest.approx((0, 0, 0), abs=1e-6)) == (DRIFT in extra)

    def test_the_twist_is_in_the_frame_of_the_odometry(
        self, robot: Load, collect: Collect, extra: str
    ) -> None:
        world = robot(
            f"{extra}, twist_in_local_frame: false" if extra else "twist_in_local_frame: false"
        )
        odometry = collect(world, ODOMETRY)
        world.step(300)
        world.move_model("robot", self.FAR, keep_odometry=True)
        world.step(20)
        x, y, _ = (np.array(odometry[-1].pose) - odometry[-2].pose) / 0.005
        assert odometry[-1].twist[:2] == pytest.approx((x, y), abs=0.01)

    def test_two_moves(self, robot: Load, collect: Collect, extra: str) -> None:
        world = robot(extra)
        odometry = collect(world, ODOMETRY)
        world.step(100)
        world.move_model("robot", self.FAR, keep_odometry=True)
        world.move_model("robot", START, keep_odometry=True)
        command(world, 0.0, 0.0)
        world.step(1)
        assert math.dist(odometry[-1].pose[:2], odometry[-2].pose[:2]) < 0.01
        world.move_model("robot", self.FAR, keep_odometry=True)
        world.step(5)
        assert odometry[-1].pose == pytest.approx(odometry[-5].pose, abs=1e-5)


@pytest.mark.parametrize("extra", ["", DRIFT])
def test_the_odometry_is_part_of_the_state(robot: Load, extra: str) -> None:
    def state(keep: bool) -> str:
        world = robot(extra)
        world.step(100)
        world.move_model("robot", (0.0, 0.0, 0.0), keep_odometry=keep)
        world.step(10)
        return world.state_hash()

    assert state(True) == state(True)
    assert state(True) != state(False)
