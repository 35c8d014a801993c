"""Control of the node from outside: steps on request."""

from __future__ import annotations

import os
from pathlib import Path

from ros_session import RosSession, ros_session  # isort: skip
from scenes import benchmark_world_path
from table import Row
from timing import best_of

CALLS = 200  # of step_world in one measurement


def rows(unit: float) -> list[Row]:
    """Measures the services of a node in lockstep, called by rospy in another process."""
    del unit
    with ros_session() as session:
        os.environ.update({k: v for k, v in session.environment.items() if k.startswith("ROS_")})
        steps = _steps_per_second(session, benchmark_world_path())
    return [
        Row(
            "calls of /step_world, one step, one robot, persistent connection",
            steps,
            "1/s",
            2000.0,
            at_least=True,
        ),
    ]


def _steps_per_second(session: RosSession, world: Path) -> float:
    import rospy

    from flatland.srv import StepWorld

    server = session.server(world_path=world, lockstep=True, seed=1)
    rospy.wait_for_service("/step_world", 30.0)
    step_world = rospy.ServiceProxy("/step_world", StepWorld, persistent=True)

    def call_many() -> None:
        for _ in range(CALLS):
            step_world(0.0)

    seconds = best_of(call_many, seconds=2.0)
    step_world.close()
    session.stop(server)
    return CALLS / seconds
