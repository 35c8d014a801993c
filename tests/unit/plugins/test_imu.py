"""Imu: orientation, rate, acceleration, noise, message and transform."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import flatland
from flatland import Imu

IMU = "[{type: Imu, name: imu, body: base}]"
DT = 0.005

Collect = Callable[[flatland.World, str], list[Any]]


def imu(entry: str) -> str:
    return f"[{{type: Imu, name: imu, body: base, {entry}}}]"


def accelerate(world: flatland.World, steps: int, ax: float, ay: float) -> None:
    """Accelerates the robot from rest at a constant rate in the world frame."""
    base = world.model("robot").body("base")
    for _ in range(steps):
        vx, vy, omega = base.velocity
        base.set_velocity(vx + ax * DT, vy + ay * DT, omega)
        world.step()


def test_defaults(plugin_world: Any, collect: Collect) -> None:
    world = plugin_world(IMU, namespace="r1", pose=(0, 0, 0.7))
    assert set(world.ports.outputs) == {"/r1/imu/filtered", "/r1/imu/ground_truth"}
    filtered = collect(world, "/r1/imu/filtered")
    truth = collect(world, "/r1/imu/ground_truth")
    world.model("robot").body("base").set_velocity(0.0, 0.0, 2.0)
    world.step(2)
    for messages in (filtered, truth):
        # Unlike the reference: simulated time after the step, and a namespaced frame.
        assert [message.stamp for message in messages] == [5_000_000, 10_000_000]
        assert type(messages[1]) is Imu
        assert messages[1].frame_id == "r1_imu"
        assert messages[1].yaw == pytest.approx(0.7 + 2 * 2.0 * DT, abs=1e-5)
        assert messages[1].yaw_rate == pytest.approx(2.0, abs=1e-5)
        for covariance in (
            messages[1].orientation_covariance,
            messages[1].angular_velocity_covariance,
            messages[1].linear_acceleration_covariance,
        ):
            assert covariance.tolist() == np.zeros((3, 3)).tolist()
    transform = world.transforms["r1_base", "r1_imu"]
    assert transform.stamp == 10_000_000
    assert (transform.x, transform.y, transform.yaw, transform.roll) == (0, 0, 0, 0)


@pytest.mark.parametrize("yaw", [0.3, math.pi / 2, 2.5, -1.0])
def test_acceleration_is_rotated_into_the_body_frame(
    plugin_world: Any, collect: Collect, yaw: float
) -> None:
    # The reference has a wrong sign in the rotation of the y axis, and multiplies by the rate,
    # which is infinite by default.
    world = plugin_world(IMU, pose=(0, 0, yaw))
    messages = collect(world, "/imu/filtered")
    ahead, left = 3.0, 0.5
    accelerate(
        world,
        3,
        ahead * math.cos(yaw) - left * math.sin(yaw),
        ahead * math.sin(yaw) + left * math.cos(yaw),
    )
    assert messages[0].linear_acceleration == (0.0, 0.0)  # nothing is known about the time before
    assert messages[-1].linear_acceleration == pytest.approx((ahead, left), abs=1e-3)


@pytest.mark.parametrize("rate", [100, 30])
def test_acceleration_uses_the_elapsed_time(
    plugin_world: Any, collect: Collect, rate: float
) -> None:
    # At 30 Hz and steps of 5 ms the interval between messages is 30 or 35 ms, never 1/30 s.
    world = plugin_world(imu(f"update_rate: {rate}"))
    messages = collect(world, "/imu/filtered")
    accelerate(world, 60, 2.0, 0.0)
    assert len(messages) == round(60 * DT * rate)
    for message in messages[1:]:
        assert message.linear_acceleration == pytest.approx((2.0, 0.0), abs=2e-3)


def test_acceleration_is_that_of_the_origin(plugin_world: Any, collect: Collect) -> None:
    lopsided = """
    - name: base
      footprints: [{type: circle, radius: 0.2, center: [0.5, 0], density: 1}]
    """
    world = plugin_world(IMU, bodies=lopsided)
    messages = collect(world, "/imu/filtered")
    base = world.model("robot").body("base")
    world.step()
    base.apply_torque(1.0)
    world.step()
    # The center of mass is at rest; the origin, 0.5 m behind it, moves to the right.
    yaw_acceleration = base.velocity[2] / DT
    assert messages[-1].linear_acceleration[1] == pytest.approx(-0.5 * yaw_acceleration, rel=1e-2)


def test_a_late_subscriber_receives_the_acceleration_of_the_last_interval(
    plugin_world: Any, collect: Collect
) -> None:
    world = plugin_world(IMU)
    accelerate(world, 10, 0.0, 0.0)
    accelerate(world, 10, 2.0, 0.0)
    assert world.ports.find_output("/imu/filtered").latest is None
    messages = collect(world, "/imu/filtered")
    accelerate(world, 1, 4.0, 0.0)
    assert messages[0].linear_acceleration == pytest.approx((4.0, 0.0), abs=1e-3)


def test_topic_and_frame_parameters(plugin_world: Any) -> None:
    world = plugin_world(
        imu("imu_pub: /a, ground_truth_pub: b/c, imu_frame_id: box"), namespace="r1"
    )
    output = world.output("/a")
    assert set(world.ports.outputs) == {"/a", "/r1/b/c"}
    world.step()
    assert output.latest.frame_id == "r1_box"
    assert list(world.transforms) == [("r1_base", "r1_box")]


def test_only_wanted_outputs_are_emitted(plugin_world: Any) -> None:
    world = plugin_world(IMU)
    truth = world.output("/imu/ground_truth")
    world.step()
    assert truth.latest is not None
    assert world.ports.find_output("/imu/filtered").latest is None


@pytest.mark.parametrize(
    ("entry", "outputs", "frames"),
    [
        ("enable_imu_pub: false", [], [("base", "imu")]),
        ("broadcast_tf: false", ["/imu/filtered", "/imu/ground_truth"], []),
        # No transform of a frame to itself.
        ("imu_frame_id: base", ["/imu/filtered", "/imu/ground_truth"], []),
    ],
)
def test_outputs_and_the_transform_can_be_left_out(
    plugin_world: Any, entry: str, outputs: list[str], frames: list[tuple[str, str]]
) -> None:
    world = plugin_world(imu(entry))
    world.step()
    assert sorted(world.ports.outputs) == outputs
    assert list(world.transforms) == frames


@pytest.mark.parametrize("key", ["update_rate", "pub_rate"])
def test_messages_are_published_at_the_update_rate(
    plugin_world: Any, collect: Collect, key: str
) -> None:
    world = plugin_world(imu(f"{key}: 40"))
    messages = collect(world, "/imu/filtered")
    world.step(204)
    assert [m.stamp for m in messages] == [25_000_000 * k for k in range(1, 41)]
    assert world.transforms["base", "imu"].stamp == messages[-1].stamp


def test_noise_has_the_configured_variances(plugin_world: Any, collect: Collect) -> None:
    world = plugin_world(
        imu(
            "orientation_noise: [9, 9, 0.01], angular_velocity_noise: [9, 9, 0.04], "
            "linear_acceleration_noise: [0.09, 0.25, 9]"
        )
    )
    filtered = collect(world, "/imu/filtered")
    truth = collect(world, "/imu/ground_truth")
    world.step(2000)
    assert all(m.yaw == 0 and m.yaw_rate == 0 for m in truth)
    assert all(m.linear_acceleration == (0, 0) for m in truth)
    samples = np.array([(m.yaw, m.yaw_rate, *m.linear_acceleration) for m in filtered])
    # The variances of yaw, yaw rate, x and y are used.
    assert samples.std(axis=0) == pytest.approx([0.1, 0.2, 0.3, 0.5], rel=0.08)
    assert samples.mean(axis=0) == pytest.approx(np.zeros(4), abs=0.04)
    # The noises are independent.
    assert np.corrcoef(samples.T) == pytest.approx(np.eye(4), abs=0.1)


def test_noise_does_not_depend_on_subscribers(plugin_world: Any, collect: Collect) -> None:
    last = []
    for steps in (0, 20):
        world = plugin_world(imu("orientation_noise: [0, 0, 0.01]"))
        world.step(steps)
        messages = collect(world, "/imu/filtered")
        world.step(40 - steps)
        last.append((messages[-1].stamp, messages[-1].yaw))
    assert last[0] == last[1]
    assert last[0][1] != 0


@pytest.mark.parametrize("is_configured", [False, True])
def test_covariances_are_configured_or_those_of_the_noise(
    plugin_world: Any, collect: Collect, is_configured: bool
) -> None:
    entry, expected = [], []
    for index, kind in enumerate(("orientation", "angular_velocity", "linear_acceleration")):
        variances = [3 * index + 1, 3 * index + 2, 3 * index + 3]
        matrix = np.diag(variances)
        entry.append(f"{kind}_noise: {variances}")
        if is_configured:
            matrix = np.arange(9).reshape(3, 3) + index
            entry.append(f"{kind}_covariance: {matrix.ravel().tolist()}")
        expected.append(matrix.tolist())
    world = plugin_world(imu(", ".join(entry)))
    filtered, truth = (collect(world, f"/imu/{name}") for name in ("filtered", "ground_truth"))
    world.step()
    found = (
        filtered[0].orientation_covariance,
        filtered[0].angular_velocity_covariance,
        filtered[0].linear_acceleration_covariance,
    )
    assert [matrix.tolist() for matrix in found] == expected
    assert not truth[0].orientation_covariance.any()
