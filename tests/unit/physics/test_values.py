"""Values that cross the boundary to the core."""

from __future__ import annotations

from flatland.physics import PhysicsWorld, Run, RunEnd


def test_a_run_has_new_steps_with_their_physics_by_default() -> None:
    world = PhysicsWorld()
    body = world.create_body("kinematic", (0.0, 0.0, 0.0))
    body.set_velocity(1.0, 0.0, 0.0)
    made, end, *_ = world.jobs.run(*Run(0, 10_000_000, 3, 0.01, 8, 3))
    assert (made, end) == (3, RunEnd.DONE)
    assert abs(body.pose[0] - 0.03) < 1e-6
