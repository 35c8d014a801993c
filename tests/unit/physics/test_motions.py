"""Saved motions: poses, velocities and sleep of all bodies are restored without rounding."""

from __future__ import annotations

import numpy as np

from flatland.physics import PhysicsBody, PhysicsWorld

STEP = (0.01, 8, 3)


def disc(world: PhysicsWorld, x: float, y: float = 0.1, center: float = 0.0) -> PhysicsBody:
    body = world.create_body("dynamic", (x, y, 0.7))
    body.create_circle((center, 0.0), 0.3, density=1.0)
    return body


def test_bodies_continue_as_after_the_save(world: PhysicsWorld) -> None:
    # The centers, below 4 m, have one bit more than the positions from which they are computed.
    bodies = [disc(world, 4.1, float(i), center=-0.3) for i in range(12)]
    for i, body in enumerate(bodies):
        body.set_velocity(0.03 * i, 0.1, 0.1 * i)
    for _ in range(7):
        world.step(*STEP)
    saved, states = world.saved_motions(), world.body_states()
    runs = []
    for _ in range(2):
        for _ in range(5):
            world.step(*STEP)
        runs.append(world.body_states())
        bodies[1].set_pose(1.0, 2.0, 3.0)
        bodies[2].set_velocity(1.0, 2.0, 3.0)
        world.restore_motions(saved)
        assert np.array_equal(world.body_states(), states)
    assert np.array_equal(runs[0], runs[1])


def test_sleep_and_the_time_at_rest_are_restored(world: PhysicsWorld) -> None:
    body = disc(world, 0.0)
    for _ in range(30):
        world.step(*STEP)
    resting = world.saved_motions()
    body.set_velocity(1.0, 0.0, 0.0)
    world.step(*STEP)
    world.restore_motions(resting)
    awake = [body.awake]
    for steps in (19, 3):
        for _ in range(steps):
            world.step(*STEP)
        awake.append(body.awake)
    assert awake == [True, True, False]  # sleeps after 0.5 s at rest
    asleep = world.saved_motions()
    body.set_velocity(1.0, 0.0, 0.0)
    awake = []
    for each in (asleep, resting):
        world.restore_motions(each)
        awake.append(body.awake)
    assert awake == [False, True]


def test_a_wall_that_returned_is_moved_again_by_a_copy(world: PhysicsWorld) -> None:
    wall = world.create_body("static", (1.0, 0.0, 0.0))
    wall.create_edges([(0.0, -1.0, 0.0, 1.0)])
    body, removed = disc(world, 1.5), disc(world, 9.0)
    saved = world.saved_motions()
    wall.set_pose(2.0, 0.0, 0.0)
    removed.destroy()
    moved = world.copy()
    world.restore_motions(saved)
    assert wall.pose == (1.0, 0.0, 0.0)
    world.become_copy_of(moved)
    assert wall.pose == (2.0, 0.0, 0.0)
    body.set_velocity(1.0, 0.0, 0.0)
    places = []
    for _ in range(60):
        world.step(*STEP)
        places.append(body.pose[0])
    assert 1.69 < max(places) < 1.71
