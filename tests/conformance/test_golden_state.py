"""A run of the office has the same state hash after each change of the code."""

from __future__ import annotations

from pathlib import Path

import flatland
from flatland import Twist

# Of the state after 5000 steps of `drive`. A change of the code that changes it changes the results
# of users, and belongs into the changelog. The C library selects versions of sin and cos by the
# instruction set of the processor: see "The same run twice" in docs/reliability.md.
GOLDEN = "629c177744e1b8a5cb3955826e0677f4"


def drive(world: flatland.World) -> None:
    """Drives both robots into the furniture and the walls, among boxes and chairs."""
    robot, tricycle = world.command("/cmd_vel"), world.command("/tricycle/cmd_vel")
    for number in range(6):
        kind = "box" if number % 2 else "chair"
        world.spawn_model(
            f"{kind}.model.yaml", f"{kind}{number}", pose=(3.0 + 0.7 * number, -5.0, number)
        )
    for number in range(10):
        robot.set(Twist(linear_x=0.8, angular_z=0.3 if number % 3 else -0.7))
        tricycle.set(Twist(linear_x=-1.0 if number % 4 else 1.2, angular_z=0.2 * (number % 5 - 2)))
        world.step(500)


def test_the_office_has_the_golden_state_after_5000_steps(checkout: Path) -> None:
    path = checkout / "worlds" / "office" / "world.yaml"
    params = {"/map_to_odom": False}  # with drifting odometry
    with flatland.World.from_yaml(path, seed=1, params=params) as world:
        start = [model.pose for model in world.models]
        drive(world)
        assert world.timekeeper.sim_time_ns == 25_000_000_000
        assert sum(a != b for a, b in zip(start, (m.pose for m in world.models), strict=False)) >= 2
        assert world.state_hash() == GOLDEN
