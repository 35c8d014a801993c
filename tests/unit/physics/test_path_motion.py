"""Places on a path or a tween at a share of a round, in closed form."""

from __future__ import annotations

import math

import pytest

from flatland.physics import PathController, PhysicsBody, PhysicsWorld

SPEED = (0.5, 0.0, 0.0)  # m/s, without limits of acceleration
SPIN = (1.0, 0.0, 0.0)
DIAGONAL = math.hypot(3, 4)


def path(mode: str, faces_forward: bool = False) -> tuple[PhysicsBody, PathController]:
    body = PhysicsWorld().create_body("kinematic", (0, 0, 0))
    controller = body.control_path(
        [(3, 0, 0), (3, 4, 0)],
        mode=mode,
        faces_forward=faces_forward,
        linear=SPEED,
        angular=SPIN,
        wait=1.0,
        key=7,
    )
    controller.set_start(True, 1)
    return body, controller


@pytest.mark.parametrize(
    ("mode", "time", "place"),
    [
        ("loop", 0.5, (0, 0)),
        ("loop", 3.0, (1, 0)),
        ("loop", 7.5, (3, 0)),
        ("loop", 10.0, (3, 1)),
        ("loop", 16.5, (3, 4)),
        ("loop", 19.0, (3 - 3 * 0.2, 4 - 4 * 0.2)),
        ("there_and_back", 15.5, (3, 3.75)),
        ("there_and_back", 19.0, (3, 3)),
        ("there_and_back", 25.5, (3, 0)),
        ("there_and_back", 27.0, (2.5, 0)),
    ],
)
def test_waits_and_drives_are_in_proportion_to_time(
    mode: str, time: float, place: tuple[float, float]
) -> None:
    legs = (3, 4, DIAGONAL) if mode == "loop" else (3, 4, 4, 3)
    body, controller = path(mode)
    controller.place(time / (sum(legs) / SPEED[0] + len(legs)))
    assert body.pose == pytest.approx((*place, 0), abs=1e-5)
    assert body.velocity == (0, 0, 0)


@pytest.mark.parametrize(
    ("time", "pose"),
    [
        (5.0, (2, 0, 0)),
        (7.0 + 1.0 + 0.5, (3, 0, 0.5)),
        (7.0 + 1.0 + math.pi / 2 + 2.0, (3, 1, math.pi / 2)),
    ],
)
def test_a_body_that_faces_forward_turns_between_drives(
    time: float, pose: tuple[float, float, float]
) -> None:
    body, controller = path("loop", faces_forward=True)
    # From (3, 4) back to the origin the body turns by 180 degrees minus atan(3 / 4).
    first_round = 3 + 12 / SPEED[0] + math.pi / 2 + math.pi - math.atan2(3, 4)
    controller.place(time / first_round)
    assert body.pose == pytest.approx(pose, abs=1e-5)


def test_a_path_goes_on_from_a_place() -> None:
    body, controller = path("loop")
    controller.place(3.0 / (12 / SPEED[0] + 3))
    for _ in range(150):
        body.world.jobs.run(0, 10_000_000, 1, 0.01, 8, 3)
    assert body.pose == pytest.approx((1.75, 0, 0), abs=1e-5)


def test_rounding_errors_do_not_accumulate_on_a_path() -> None:
    body = PhysicsWorld().create_body("kinematic", (0, 0, 0))
    controller = body.control_path(
        [(30, 40, 1)], mode="loop", faces_forward=False, linear=SPEED, angular=SPIN, wait=0.0, key=7
    )
    controller.set_start(True, 1)
    steps = 9000
    for _ in range(steps):
        body.world.jobs.run(0, 10_000_000, 1, 0.01, 8, 3)
    share = 0.01 * steps * SPEED[0] / 50
    # To the precision of 32 bits.
    assert body.pose == pytest.approx((30 * share, 40 * share, share), rel=1e-7)


@pytest.mark.parametrize(("mode", "is_started"), [("once", True), ("loop", False)])
def test_a_path_that_does_not_run_has_no_places(mode: str, is_started: bool) -> None:
    body, controller = path(mode)
    controller.set_start(is_started, 0)
    controller.place(0.5)
    assert body.pose == (0, 0, 0)


@pytest.mark.parametrize(
    ("mode", "share", "progress", "is_forward"),
    [
        ("yoyo", 0.0, 0.0, True),
        ("yoyo", 0.125, 0.25, True),
        ("yoyo", 0.5, 1.0, False),
        ("yoyo", 0.625, 0.75, False),
        ("loop", 0.0, 0.0, True),
        ("loop", 0.75, 0.75, True),
        ("once", 0.75, 0.0, True),
        ("trigger", 0.75, 0.0, True),
    ],
)
def test_places_on_a_tween(mode: str, share: float, progress: float, is_forward: bool) -> None:
    body = PhysicsWorld().create_body("kinematic", (1, 0, 0))
    controller = body.control_tween((4, 2, 0.5), duration=1.0, mode=mode, easing="linear")
    controller.place(share)
    assert controller.state == (progress, progress, is_forward)
    assert body.pose == (1 + 4 * progress, 2 * progress, 0.5 * progress)


def test_joined_bodies_are_placed_with_the_body(world: PhysicsWorld) -> None:
    body, arm, hand = (world.create_body("dynamic", (x, 1, 0.25)) for x in (1, 3, 3))
    wall = world.create_body("static", (3, 1, 0))
    for each, other, anchor in ((body, arm, (2, 0)), (arm, hand, (0, 0)), (hand, wall, (0, 0))):
        world.create_revolute_joint(each, other, anchor, (0, 0))
    for each in (body, arm, hand):
        each.set_velocity(1, 2, 3)
    controller = body.control_tween((4, 2, math.pi / 2), duration=1.0, mode="loop", easing="linear")
    controller.place(1.0)
    angle = 0.25 + math.pi / 2
    assert body.pose == pytest.approx((5, 3, angle))
    for each in (arm, hand):
        assert each.pose == pytest.approx((5, 5, angle))
    assert {each.velocity for each in (body, arm, hand)} == {(0, 0, 0)}
    assert wall.pose == (3, 1, 0)
