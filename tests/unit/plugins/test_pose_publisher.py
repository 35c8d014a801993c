"""PosePublisher: poses, velocities, frames, stamps and rates."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

import flatland
from flatland import Odometry, PoseStamped

ARM = """
- name: base
  footprints: [{type: circle, radius: 0.2, density: 1}]
- name: arm
  type: kinematic
  pose: [1, 0, 0.5]
  footprints: [{type: circle, radius: 0.1, density: 1, collision: false}]
"""
STEP = 5_000_000  # ns

Collect = Callable[[flatland.World, str], list[Any]]


def test_the_pose_of_the_first_body_is_published_by_default(
    plugin_world: Any, collect: Collect
) -> None:
    world = plugin_world(
        "[{type: PosePublisher, name: truth, update_rate: 50}]", namespace="r1", pose=(1, 2, 0.5)
    )
    assert list(world.ports.outputs) == ["/r1/pose"]
    poses = collect(world, "/r1/pose")
    world.step(9)
    assert [pose.stamp for pose in poses] == [0, 4 * STEP, 8 * STEP]
    assert type(poses[0]) is PoseStamped
    assert poses[0].frame_id == "map"
    assert poses[0].pose == pytest.approx((1, 2, 0.5), abs=1e-6)


def test_the_pose_is_that_before_the_step_or_after_it(plugin_world: Any, collect: Collect) -> None:
    world = plugin_world(
        "[{type: PosePublisher, name: a, topic: before},"
        " {type: PosePublisher, name: b, topic: after, after_step: true}]"
    )
    before, after = collect(world, "/before"), collect(world, "/after")
    world.model("robot").body("base").set_velocity(1.0, 0.0, 0.0)
    world.step(3)
    assert [pose.stamp for pose in before] == [0, STEP, 2 * STEP]
    assert [pose.stamp for pose in after] == [STEP, 2 * STEP, 3 * STEP]
    assert [pose.pose[0] for pose in before] == pytest.approx([0.0, 0.005, 0.01], abs=1e-6)
    assert before[1:] == after[:2]


def test_odometry_has_the_velocity_of_the_observed_frame_in_its_own_axes(plugin_world: Any) -> None:
    world = plugin_world(
        "[{type: PosePublisher, name: truth, body: arm, message: odometry, topic: truth,"
        " frame_id: world, child_frame_id: tip, origin: [0.5, 0, 0.25]}]",
        bodies=ARM,
        namespace="r1",
    )
    truth = world.output("/r1/truth")
    world.model("robot").body("arm").set_velocity(0.3, 0.1, 2.0)
    world.step()
    value = truth.latest
    assert type(value) is Odometry
    assert (value.frame_id, value.child_frame_id, value.stamp) == ("world", "r1_tip", 0)
    tip = (1 + 0.5 * math.cos(0.5), 0.5 * math.sin(0.5), 0.75)
    assert value.pose == pytest.approx(tip, abs=1e-6)
    # v + omega x r: the tip is 0.5 m along the direction of 0.5 rad.
    vx, vy = 0.3 - 2.0 * 0.5 * math.sin(0.5), 0.1 + 2.0 * 0.5 * math.cos(0.5)
    c, s = math.cos(0.75), math.sin(0.75)
    assert value.twist == pytest.approx((c * vx + s * vy, c * vy - s * vx, 2.0), abs=1e-6)
    assert not value.pose_covariance.any()
