"""Tween: modes, timing, and precedence over the physics."""

from __future__ import annotations

import math
from typing import Any

import pytest

import flatland

STATIC = """
- name: base
  type: kinematic
  footprints: [{type: circle, radius: 0.2, density: 1}]
"""
WALL = """
bodies:
  - name: slab
    type: static
    footprints:
      - {type: polygon, density: 1, points: [[0, -1], [0.2, -1], [0.2, 1], [0, 1]]}
"""
CRATE = """
bodies:
  - name: box
    footprints:
      - {type: polygon, density: 1, points: [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]]}
"""


def tween(entry: str) -> str:
    return f"[{{type: Tween, name: tween, body: base, {entry}}}]"


def poses(world: flatland.World, steps: int) -> list[tuple[float, float, float]]:
    """Returns the poses of the body after each step."""
    found = []
    for _ in range(steps):
        world.step()
        found.append(world.model("robot").body("base").pose)
    return found


def xs(world: flatland.World, steps: int) -> list[float]:
    return [pose[0] for pose in poses(world, steps)]


@pytest.mark.parametrize(
    ("mode", "duration", "shares"),
    [
        ("once", 1, (0.5, 1, 1)),
        ("loop", 2, (0.25, 0.5, 0.75, 1, 0.25, 0.5)),
        ("yoyo", 1, (0.5, 1, 0.5, 0, 0.5, 1, 0.5, 0, 0.5)),
    ],
)
def test_modes(plugin_world: Any, mode: str, duration: int, shares: tuple[float, ...]) -> None:
    world = plugin_world(
        tween(f"delta: [1, 3, 2], duration: {duration}, mode: {mode}"), step_size=0.5
    )
    expected = [pytest.approx((share, 3 * share, 2 * share), abs=1e-5) for share in shares]
    assert poses(world, len(shares)) == expected


def test_trigger(plugin_world: Any) -> None:
    world = plugin_world(
        tween("delta: [1, 0, 0], duration: 1, mode: trigger, trigger_topic: open"),
        step_size=0.25,
        namespace="gate",
    )
    command = world.command("/gate/open")
    # No motion before the first message.
    assert xs(world, 2) == [0, 0]
    command.set(True)
    assert xs(world, 3) == pytest.approx([0.25, 0.5, 0.75], abs=1e-5)
    command.set(False)
    assert xs(world, 1) == pytest.approx([0.5], abs=1e-5)
    command.set(True)
    assert xs(world, 3) == pytest.approx([0.75, 1, 1], abs=1e-5)
    command.set(False)
    assert xs(world, 5) == pytest.approx([0.75, 0.5, 0.25, 0, 0], abs=1e-5)


@pytest.mark.parametrize(
    ("entry", "warning"),
    [
        ("mode: trigger", "never moves: mode trigger requires a trigger_topic"),
        ("mode: once, trigger_topic: open", "ignores its trigger_topic in mode once"),
    ],
)
def test_a_trigger_requires_the_mode_and_a_topic(
    plugin_world: Any, caplog: pytest.LogCaptureFixture, entry: str, warning: str
) -> None:
    world = plugin_world(tween(f"delta: [1, 0, 0], {entry}"))
    assert (xs(world, 2) == [0, 0]) == ("mode: trigger" in entry)
    assert world.ports.commands == {}
    assert f'tween "tween" of model "robot" {warning}' in caplog.text


def test_defaults(plugin_world: Any) -> None:
    world = plugin_world("[{type: Tween, name: tween, body: base}]", pose=(1, 2, 0.5))
    assert poses(world, 2) == [pytest.approx((1, 2, 0.5), abs=1e-6)] * 2
    # The duration is one second; the delta is in the world frame, whatever the heading.
    world = plugin_world(
        tween("delta: [1, 0, 0.5], mode: once"), pose=(3, 4, math.pi / 2), step_size=0.1
    )
    expected = [(3 + i / 10, 4, math.pi / 2 + i / 20) for i in (*range(1, 11), 10)]
    assert poses(world, 11) == [pytest.approx(pose, abs=1e-5) for pose in expected]


def test_easing(plugin_world: Any) -> None:
    world = plugin_world(tween("delta: [1, 2, 0], mode: once, easing: quadraticIn"), step_size=0.25)
    expected = [(p * p, 2 * p * p, 0) for p in (0.25, 0.5, 0.75, 1)]
    assert poses(world, 4) == [pytest.approx(pose, abs=1e-6) for pose in expected]


@pytest.mark.parametrize(("duration", "dt"), [(0.1, 1 / 30), (1.5, 0.005), (0.7, 0.1)])
def test_ends_are_exact_and_at_most_one_step_late(
    plugin_world: Any, duration: float, dt: float
) -> None:
    # The sum of many steps may fall short of the end by rounding, which takes one more step.
    world = plugin_world(tween(f"delta: [1, 0, 0], duration: {duration}"), step_size=dt)
    n = round(duration / dt)
    found = xs(world, 3 * n + 2)
    top = found.index(1.0)
    bottom = found.index(0.0)
    assert n - 1 <= top <= n
    assert n <= bottom - top <= n + 1
    assert 1.0 in found[bottom:]
    assert all(0.0 <= x <= 1.0 for x in found)


@pytest.mark.parametrize("duration", ["0.004", "1e-300", "5e-324"])
def test_a_duration_below_one_step_takes_one_step(plugin_world: Any, duration: str) -> None:
    world = plugin_world(tween(f"delta: [1, 0, 0], duration: {duration}"))
    assert xs(world, 4) == [1.0, 0.0, 1.0, 0.0]


def test_slow_backward_motion_ends_at_the_initial_pose(plugin_world: Any) -> None:
    # 0.001 of the path corresponds to 20 steps here.
    world = plugin_world(tween("delta: [1, 0, 0], duration: 100"), step_size=0.005)
    world.step(39_900)
    found = xs(world, 110)
    assert min(found) == 0.0
    assert found.index(0.0) == pytest.approx(100, abs=2)


def test_long_motions_in_small_steps_are_on_time(plugin_world: Any) -> None:
    # The error of a sum of 32-bit floats alone would be 5 cm. The reference counts whole
    # milliseconds and would not move.
    world = plugin_world(tween("delta: [100, 0, 0], duration: 6, mode: once"), step_size=0.0001)
    world.step(59_000)
    assert world.model("robot").body("base").pose[0] == pytest.approx(59_000 / 600, abs=2e-3)


@pytest.mark.parametrize("body_type", ["dynamic", "kinematic", "static"])
def test_every_type_of_body_moves(plugin_world: Any, body_type: str) -> None:
    bodies = STATIC.replace("kinematic", body_type)
    world = plugin_world(tween("delta: [1, 0, 0], mode: once"), bodies=bodies, step_size=0.25)
    assert xs(world, 4) == pytest.approx([0.25, 0.5, 0.75, 1], abs=1e-6)


def test_neither_a_wall_nor_a_velocity_affects_the_motion(plugin_world: Any, files: Any) -> None:
    # Box2D alone would push the body out of the wall in the same step.
    world = plugin_world(tween("delta: [1, 0, 0], mode: once"), step_size=0.05)
    world.model("robot").body("base").set_velocity(5.0, 5.0, 5.0)
    world.spawn_model(files.write("wall.model.yaml", WALL), "wall", pose=(0.4, 0, 0))
    found = poses(world, 20)
    assert [pose[0] for pose in found] == pytest.approx([i / 20 for i in range(1, 21)], abs=1e-6)
    assert [pose[1:] for pose in found] == [(0.0, 0.0)] * 20


def test_contacts_do_not_change_the_velocity(plugin_world: Any, files: Any) -> None:
    world = plugin_world(tween("delta: [0, 0, 0]"))
    world.spawn_model(files.write("crate.model.yaml", CRATE), "crate", pose=(-0.31, 0, 0))
    box = world.model("crate").body("box")
    for _ in range(50):
        box.set_velocity(1.0, 0.0, 0.0)
        world.step()
    assert world.contacts
    assert world.model("robot").body("base").velocity == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("sleeps", [False, True])
def test_obstacles_are_pushed(plugin_world: Any, files: Any, sleeps: bool) -> None:
    world = plugin_world(
        tween("delta: [1, 0, 0], duration: 2, mode: trigger, trigger_topic: go"), bodies=STATIC
    )
    world.spawn_model(files.write("crate.model.yaml", CRATE), "crate", pose=(0.35, 0, 0))
    box = world.model("crate").body("box")
    world.step(400 if sleeps else 1)
    assert box.awake != sleeps
    world.command("/go").set(True)
    world.step(400)
    # The edge of the disc is at 1.2 at the end, and half the width of the crate is 0.1.
    assert box.pose[:2] == pytest.approx((1.3, 0.0), abs=0.02)


def test_contacts_at_the_end_of_the_motion_are_reported(plugin_world: Any, files: Any) -> None:
    # Requires contacts of a body that was set to its pose and has been at rest for long.
    world = plugin_world(
        "[{type: Tween, name: tween, body: base, delta: [1, 0, 0], duration: 0.1, mode: once}, "
        "{type: BoolSensor, name: switch}]"
    )
    output = world.output("/bool_sensor")
    world.step(400)
    assert world.model("robot").body("base").awake
    assert output.latest is False
    world.spawn_model(files.write("wall.model.yaml", WALL), "wall", pose=(1.1, 0, 0))
    world.step(2)
    assert output.latest is True


def test_a_moved_model_returns_to_its_path(plugin_world: Any) -> None:
    world = plugin_world(tween("delta: [1, 0, 0], mode: once"), step_size=0.25)
    world.step()
    world.move_model("robot", (5, 5, 5))
    assert poses(world, 1)[0] == pytest.approx((0.5, 0, 0), abs=1e-6)


@pytest.mark.parametrize("mode", ["yoyo", "loop"])
def test_random_starts_are_in_both_directions(plugin_world: Any, mode: str) -> None:
    world = plugin_world(
        tween(f"delta: [2, 0, 1], duration: 1, mode: {mode}"), bodies=STATIC, step_size=0.01
    )
    directions = set()
    for seed in range(20):
        world.randomize(seed)
        x, _, theta = world.model("robot").body("base").pose
        assert 0 <= x <= 2
        assert theta == pytest.approx(x / 2, abs=1e-5)
        (after,) = xs(world, 1)
        if 0.03 < x < 1.97:
            assert abs(after - x) == pytest.approx(0.02, abs=1e-5)
            directions.add(after > x)
    assert directions == ({True, False} if mode == "yoyo" else {True})


@pytest.mark.parametrize(
    "entry", ["mode: once", "mode: trigger, trigger_topic: t", "redraw: false"]
)
def test_some_tweens_begin_at_the_initial_pose(plugin_world: Any, entry: str) -> None:
    world = plugin_world(tween(f"delta: [2, 0, 1], {entry}"), bodies=STATIC)
    world.randomize(1)
    assert world.model("robot").body("base").pose == (0, 0, 0)
