from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

import flatland
from flatland.geometry import compose

BODIES = """
- name: base
  footprints: [{type: circle, radius: 0.1, density: 1}]
- name: arm
  pose: [1, 2, 0.5]
  footprints: []
- name: hand
  pose: [-3, 1, -1.5]
  footprints: []
"""


@pytest.fixture
def tf(plugin_world: Any) -> Callable[..., flatland.World]:
    def load(extra: str = "", **options: Any) -> flatland.World:
        options = {"bodies": BODIES, "pose": (4.0, 5.0, 0.8), **options}
        world: flatland.World = plugin_world(
            f"- {{type: ModelTfPublisher, name: tf, {extra}}}", **options
        )
        return world

    return load


def pose(transform: flatland.Transform) -> tuple[float, float, float]:
    return (transform.x, transform.y, transform.yaw)


def test_transforms_from_the_first_body_to_all_others(tf: Any) -> None:
    world = tf()
    world.step(3)
    assert set(world.transforms) == {("base", "arm"), ("base", "hand")}
    arm, hand = world.transforms["base", "arm"], world.transforms["base", "hand"]
    assert pose(arm) == pytest.approx((1.0, 2.0, 0.5), abs=1e-5)
    assert pose(hand) == pytest.approx((-3.0, 1.0, -1.5), abs=1e-5)
    assert arm.stamp == hand.stamp == 10_000_000
    assert arm.roll == 0


def test_reference_body(tf: Any) -> None:
    world = tf("reference: arm")
    world.step()
    assert set(world.transforms) == {("arm", "base"), ("arm", "hand")}
    # The transform is the inverse of the pose of the arm relative to the base.
    back = compose((1.0, 2.0, 0.5), pose(world.transforms["arm", "base"]))
    assert back == pytest.approx((0.0, 0.0, 0.0), abs=1e-5)


def test_world_transform(tf: Any) -> None:
    world = tf("publish_tf_world: true, reference: arm")
    world.step()
    expected = compose((4.0, 5.0, 0.8), (1.0, 2.0, 0.5))
    assert pose(world.transforms["map", "arm"]) == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize(
    ("extra", "frames"),
    [
        ("", {("map", "r1_base"), ("r1_base", "r1_arm"), ("r1_base", "r1_hand")}),
        ("exclude: [hand]", {("map", "r1_base"), ("r1_base", "r1_arm")}),
        ("exclude: [arm, hand], world_frame_id: earth", {("earth", "r1_base")}),
        ("exclude: [arm, hand], world_frame_id: /earth", {("/earth", "r1_base")}),
    ],
)
def test_frames(tf: Any, extra: str, frames: set[tuple[str, str]]) -> None:
    """Only the frame of the world has no namespace."""
    world = tf(f"publish_tf_world: true, {extra}", namespace="r1")
    world.step()
    assert set(world.transforms) == frames


def test_update_rate(tf: Any) -> None:
    world = tf("update_rate: 50")
    stamps = []
    for _ in range(20):
        world.step()
        stamps.append(world.transforms["base", "arm"].stamp)
    assert sorted(set(stamps)) == [0, 20_000_000, 40_000_000, 60_000_000, 80_000_000]


@pytest.mark.parametrize("extra", ["", "publish_tf_world: true", "update_rate: 30"])
def test_transforms_that_nobody_wanted_are_those_of_the_last_update(tf: Any, extra: str) -> None:
    def transforms(observers: list[flatland.WorldObserver]) -> list[dict[Any, flatland.Transform]]:
        world = tf(extra)
        for observer in observers:
            world.add_observer(observer)
        found = []
        for index, body in enumerate(world.model("robot").bodies):
            body.set_velocity(0.3, -0.2 * index, 0.5 + index)
        for steps in (1, 7, 40):
            world.step(steps)
            found.append(world.transforms)
        return found

    class Listener(flatland.WorldObserver):
        def transforms_sent(self, transforms: Any) -> None:
            del transforms

    assert transforms([]) == transforms([Listener()])
