from __future__ import annotations

import logging
import math
from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import flatland
from flatland.values import Odometry, TwistWithCovariance
from tests.support.steps import control_bodies

Collect = Callable[[flatland.World, str], list[Any]]

# The center of mass is 0.3 m ahead of and 0.2 m to the left of the origin.
LOPSIDED = """
- name: base
  footprints: [{type: circle, radius: 0.2, center: [0.3, 0.2], density: 1}]
"""
TRUTH = "/odometry/ground_truth"
ODOMETRY = "/odometry/filtered"


def drive(extra: str = "") -> str:
    return f"- {{type: DiffDrive, name: wheels, body: base, {extra}}}"


def command(world: flatland.World, v: float, omega: float, topic: str = "/cmd_vel") -> None:
    world.command(topic).set(flatland.Twist(linear_x=v, angular_z=omega))


def base(world: flatland.World) -> flatland.Body:
    return world.model("robot").body("base")


class TestMotion:
    def test_robot_drives_along_its_heading(self, plugin_world: Any) -> None:
        world = plugin_world(drive(), pose=(1.0, 2.0, 0.5))
        command(world, 0.8, 0.0)
        world.step(200)
        expected = (1.0 + 0.8 * math.cos(0.5), 2.0 + 0.8 * math.sin(0.5), 0.5)
        assert base(world).pose == pytest.approx(expected, abs=1e-4)

    def test_the_commanded_velocity_is_that_of_the_origin(self, plugin_world: Any) -> None:
        world = plugin_world(drive(), bodies=LOPSIDED, pose=(0.0, 0.0, 0.7))
        command(world, 0.5, 2.0)
        control_bodies(world)
        assert base(world).velocity == pytest.approx(
            (0.5 * math.cos(0.7), 0.5 * math.sin(0.7), 2.0), abs=1e-5
        )

    def test_the_velocity_is_set_in_every_step(self, plugin_world: Any) -> None:
        bodies = """
        - name: base
          linear_damping: 5
          angular_damping: 5
          footprints: [{type: circle, radius: 0.2, density: 1}]
        """
        world = plugin_world(drive("pub_rate: 1"), bodies=bodies)
        command(world, 1.0, 0.0)
        world.step(100)
        # Damping reduces the velocity within each step, but does not accumulate.
        assert base(world).pose[0] == pytest.approx(0.5 / (1 + 5 * 0.005), rel=1e-3)

    def test_the_lateral_component_of_a_command_is_ignored(self, plugin_world: Any) -> None:
        world = plugin_world(drive())
        world.command("/cmd_vel").set(flatland.Twist(linear_y=3.0))
        world.step(10)
        assert base(world).pose == pytest.approx((0.0, 0.0, 0.0), abs=1e-7)


class TestDynamics:
    def test_linear_dynamics(self, plugin_world: Any) -> None:
        limits = "{acceleration_limit: 1.0, deceleration_limit: 2.0, velocity_limit: 0.012}"
        world = plugin_world(drive(f"linear_dynamics: {limits}"))
        command(world, 5.0, 0.0)
        speeds = []
        for step in range(6):
            if step == 4:
                command(world, 0.0, 0.0)
            world.step()
            speeds.append(base(world).velocity[0])
        assert speeds == pytest.approx([0.005, 0.01, 0.012, 0.012, 0.002, 0.0], abs=1e-6)

    def test_angular_dynamics(self, plugin_world: Any) -> None:
        world = plugin_world(drive("angular_dynamics: {acceleration_limit: 2.0}"))
        command(world, 0.0, -5.0)
        rates = []
        for _ in range(3):
            world.step()
            rates.append(base(world).velocity[2])
        assert rates == pytest.approx([-0.01, -0.02, -0.03], abs=1e-6)


class TestGroundTruth:
    def test_message(self, plugin_world: Any, collect: Collect) -> None:
        world = plugin_world(drive(), namespace="r1", pose=(1.0, 2.0, 0.5), bodies=LOPSIDED)
        truths, odometry = collect(world, "/r1" + TRUTH), collect(world, "/r1" + ODOMETRY)
        command(world, 0.6, 0.4, "/r1/cmd_vel")
        world.step(2)
        first, second = truths
        assert isinstance(first, Odometry)
        assert (first.stamp, second.stamp) == (0, 5_000_000)
        assert (first.frame_id, first.child_frame_id) == ("map", "r1_base")
        assert first.pose == pytest.approx((1.0, 2.0, 0.5), abs=1e-6)
        assert second.pose[2] == pytest.approx(0.502, abs=1e-6)
        assert second.pose[0] == pytest.approx(1.0 + 0.003 * math.cos(0.5), abs=1e-5)
        # Without noise, the odometry is exact.
        for exact, measured in zip(truths, odometry, strict=True):
            assert (measured.frame_id, measured.child_frame_id) == ("odom", "r1_base")
            assert (measured.stamp, measured.pose) == (exact.stamp, exact.pose)
            assert measured.twist == exact.twist

    @pytest.mark.parametrize(("local", "heading"), [("true", 0.0), ("false", 1.0)])
    def test_velocity_is_that_after_the_command_of_this_step(
        self, plugin_world: Any, collect: Collect, local: str, heading: float
    ) -> None:
        extra = f"twist_in_local_frame: {local}"
        world = plugin_world(drive(extra), bodies=LOPSIDED, pose=(0.0, 0.0, 1.0))
        truths, odometry = collect(world, TRUTH), collect(world, ODOMETRY)
        command(world, 0.6, 0.4)
        world.step()
        expected = (0.6 * math.cos(heading), 0.6 * math.sin(heading), 0.4)
        assert truths[0].twist == pytest.approx(expected, abs=1e-5)
        assert odometry[0].twist == pytest.approx(expected, abs=1e-5)


class TestOdometry:
    def test_noise_has_the_configured_variances(self, plugin_world: Any, collect: Collect) -> None:
        extra = (
            "odom_pose_noise: [0.04, 0.09, 0.16], odom_twist_noise: [0.25, 0.36, 0.49], "
            "twist_in_local_frame: false"
        )
        world = plugin_world(drive(extra))
        truths, odometry = collect(world, TRUTH), collect(world, ODOMETRY)
        twists = collect(world, "/twist")
        command(world, 0.5, 0.0)
        world.step(2000)
        exact = np.array([[*value.pose, *value.twist] for value in truths])
        error = np.array([[*value.pose, *value.twist] for value in odometry]) - exact
        forward = np.array([value.twist for value in twists]) - (0.5, 0.0, 0.0)
        assert not forward[:, 1].any()
        errors = np.hstack([error, forward[:, ::2]])
        deviations = [0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.5, 0.7]
        assert errors.std(axis=0) == pytest.approx(deviations, rel=0.08)
        assert np.abs(errors.mean(axis=0)).max() < 0.07
        # All noises are independent.
        assert np.abs(np.corrcoef(errors.T) - np.eye(8)).max() < 0.1

    def test_noise_does_not_depend_on_subscribers_of_other_outputs(self, plugin_world: Any) -> None:
        noise = "odom_pose_noise: [1, 1, 1], odom_twist_noise: [1, 1, 1]"

        def last_odometry(others: Sequence[str], connects_at: int = 0) -> Odometry:
            world = plugin_world(drive(noise), seed=7)
            for topic in others:
                world.output(topic)
            world.step(connects_at)
            odometry = world.output(ODOMETRY)
            world.step(10 - connects_at)
            value: Odometry = odometry.latest
            return value

        alone = last_odometry([])
        assert alone.pose[0] != 0.0
        assert last_odometry(["/twist"]).pose == alone.pose
        assert last_odometry([TRUTH, "/twist"]).twist == alone.twist
        assert last_odometry(["/twist"], connects_at=9).pose == alone.pose

    @pytest.mark.parametrize("frame", ["wheel_odom", "/wheel_odom"])
    def test_frame_has_no_namespace(self, plugin_world: Any, collect: Collect, frame: str) -> None:
        frames = f"odom_frame_id: {frame}, ground_truth_frame_id: {frame}"
        world = plugin_world(drive(frames), namespace="r1")
        odometry, truths = collect(world, "/r1" + ODOMETRY), collect(world, "/r1" + TRUTH)
        world.step()
        assert odometry[0].frame_id == truths[0].frame_id == frame
        assert list(world.transforms) == [(frame, "r1_base")]


class TestTwist:
    def test_forward_velocity_and_yaw_rate(self, plugin_world: Any, collect: Collect) -> None:
        world = plugin_world(drive(), bodies=LOPSIDED, namespace="r1", pose=(0.0, 0.0, 2.0))
        twists = collect(world, "/r1/twist")
        command(world, -0.6, 0.4, "/r1/cmd_vel")
        world.step(2)
        twist = twists[1]
        assert isinstance(twist, TwistWithCovariance)
        assert twist.stamp == 5_000_000
        assert twist.frame_id == "r1_base"
        assert twist.twist == pytest.approx((-0.6, 0.0, 0.4), abs=1e-5)

    def test_default_covariances_have_the_variances(
        self, plugin_world: Any, collect: Collect
    ) -> None:
        world = plugin_world(drive("odom_pose_noise: [1, 2, 3], odom_twist_noise: [4, 5, 6]"))
        odometry, truths, twists = (collect(world, t) for t in (ODOMETRY, TRUTH, "/twist"))
        world.step()
        assert np.array_equal(odometry[0].pose_covariance, np.diag([1, 2, 0, 0, 0, 3]))
        for covariance in (odometry[0].twist_covariance, twists[0].covariance):
            assert np.array_equal(covariance, np.diag([4, 5, 0, 0, 0, 6]))
        assert not truths[0].pose_covariance.any()
        assert not truths[0].twist_covariance.any()


class TestEnableParameters:
    def test_topic_parameters(self, plugin_world: Any) -> None:
        extra = "twist_sub: go, odom_pub: a, ground_truth_pub: b/c, twist_pub: /d"
        world = plugin_world(drive(extra), namespace="r1")
        assert list(world.ports.commands) == ["/r1/go"]
        outputs = world.ports.outputs
        types = {topic: output.value_type for topic, output in outputs.items()}
        assert types == {"/r1/a": Odometry, "/r1/b/c": Odometry, "/d": TwistWithCovariance}

    @pytest.mark.parametrize(
        ("extra", "topics", "frames"),
        [
            ("", [ODOMETRY, TRUTH, "/twist"], [("odom", "base")]),
            ("enable_odom_pub: false", ["/twist"], [("odom", "base")]),
            ("enable_twist_pub: false, enable_odom_tf_pub: false", [ODOMETRY, TRUTH], []),
            ("enable_odom_pub: false, enable_twist_pub: false", [], [("odom", "base")]),
        ],
    )
    def test_outputs(
        self, plugin_world: Any, extra: str, topics: list[str], frames: list[tuple[str, str]]
    ) -> None:
        """The transform is sent without subscribers."""
        world = plugin_world(drive(extra))
        assert sorted(world.ports.outputs) == topics
        command(world, 1.0, 0.0)
        world.step(11)
        assert base(world).pose[0] == pytest.approx(0.055, abs=1e-5)
        assert list(world.transforms) == frames
        assert all(sent.x == pytest.approx(0.05, abs=1e-5) for sent in world.transforms.values())

    def test_pub_rate(self, plugin_world: Any, collect: Collect) -> None:
        world = plugin_world(drive("pub_rate: 50"))
        values = [collect(world, topic) for topic in (TRUTH, ODOMETRY, "/twist")]
        world.step(20)
        for emitted in values:
            assert [value.stamp for value in emitted] == [k * 20_000_000 for k in range(5)]
        assert world.transforms["odom", "base"].stamp == 80_000_000

    @pytest.mark.parametrize("topic", [TRUTH, ODOMETRY, "/twist"])
    def test_only_wanted_outputs_are_emitted(self, plugin_world: Any, topic: str) -> None:
        world = plugin_world(drive())
        world.output(topic)
        world.step()
        emitted = {name for name, port in world.ports.outputs.items() if port.latest is not None}
        assert emitted == {topic}


class TestInvalidCommands:
    @pytest.mark.parametrize(
        "bad",
        [
            flatland.Twist(linear_x=math.nan),
            flatland.Twist(angular_z=math.nan),
            flatland.Twist(linear_x=math.inf),
            flatland.Twist(angular_z=-math.inf),
            flatland.Twist(linear_y=math.nan),
            flatland.Twist(linear_x=1e30),
        ],
        ids=str,
    )
    def test_the_previous_command_remains_in_effect(
        self, plugin_world: Any, caplog: pytest.LogCaptureFixture, bad: flatland.Twist
    ) -> None:
        world = plugin_world(drive())
        command(world, 1.0, 0.0)
        world.step(5)
        with caplog.at_level(logging.WARNING, "flatland"):
            world.command("/cmd_vel").set(bad)
        world.step(5)
        assert base(world).pose[0] == pytest.approx(0.05, abs=1e-5)
        assert 'plugin "wheels" of model "robot"' in caplog.text
        assert world.command("/cmd_vel").value.linear_x == 1.0

    def test_warnings_are_throttled(
        self, plugin_world: Any, caplog: pytest.LogCaptureFixture, monkeypatch: Any
    ) -> None:
        now = [100.0]
        clock = SimpleNamespace(monotonic=lambda: now[0])
        monkeypatch.setattr("flatland.plugin_api.occasional_warning.time", clock)
        world = plugin_world(drive())

        def warnings_of_ten_invalid_commands() -> int:
            caplog.clear()
            with caplog.at_level(logging.WARNING, "flatland"):
                for _ in range(10):
                    command(world, math.nan, 0.0)
            return len(caplog.records)

        assert warnings_of_ten_invalid_commands() == 1
        now[0] += 0.5
        assert warnings_of_ten_invalid_commands() == 0
        now[0] += 0.6
        assert warnings_of_ten_invalid_commands() == 1
