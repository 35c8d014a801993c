"""Control of the node from outside: steps on request, reset, many models."""

from __future__ import annotations

import os
import time
from pathlib import Path

from node import SPAWNED

from ros_session import CHECKOUT, RosSession, ros_session  # isort: skip
from scenes import benchmark_world_path
from table import Row
from timing import Mean, best_of, mean_of

MODELS = 200
CRATE = """
bodies:
  - name: crate
    footprints: [{type: polygon, points: [[0, 0], [0.4, 0], [0.4, 0.4], [0, 0.4]], density: 10}]
"""
OFFICE = CHECKOUT / "worlds" / "office" / "world.yaml"


def rows(unit: float) -> list[Row]:
    """Measures the services of a node in lockstep, called by rospy in another process."""
    del unit
    with ros_session() as session:
        os.environ.update({k: v for k, v in session.environment.items() if k.startswith("ROS_")})
        steps = _step_call(session, benchmark_world_path())
        crates = _spawn_many(session, CRATE)
        robots = _spawn_many(session, SPAWNED)
        reset = _reset(session)
    return [
        Row(
            "calls of /step_world, one step, one robot, persistent connection",
            1 / steps.seconds,
            "1/s",
            2000.0,
            at_least=True,
            note=steps.rate,
        ),
        Row("call of /reset_world, office, persistent connection", 1e3 * reset, "ms", 20.0),
        Row(f"{MODELS} models in one call of /spawn_models, office", crates, "s", 0.2),
        Row(
            f"{MODELS} robots with drive and laser in one call of /spawn_models",
            robots,
            "s",
            note=f"{5 * MODELS} topics",
        ),
    ]


def _step_call(session: RosSession, world: Path) -> Mean:
    import rospy

    from flatland.srv import StepWorld

    server = session.server(world_path=world, lockstep=True, seed=1)
    rospy.wait_for_service("/step_world", 30.0)
    step_world = rospy.ServiceProxy("/step_world", StepWorld, persistent=True)

    mean = mean_of(lambda: step_world(0.0))
    step_world.close()
    session.stop(server)
    return mean


def _spawn_many(session: RosSession, model: str) -> float:
    """Returns the time of a call of /spawn_models with YAML text [s], with all registrations."""
    import rospy
    from geometry_msgs.msg import Pose2D

    from flatland.msg import ModelSpec
    from flatland.srv import DeleteModels, SpawnModels

    server = session.server(world_path=OFFICE, lockstep=True, seed=1)
    rospy.wait_for_service("/toggle_pause", 30.0)
    times = []
    for _ in range(5):
        names = [f"m{i}" for i in range(MODELS)]
        # Beside the building, so that no model is blocked.
        specs = [
            ModelSpec(model, name, name, Pose2D(30.0 + i % 20, i // 20, 0.0))
            for i, name in enumerate(names)
        ]
        start = time.perf_counter()
        response = rospy.ServiceProxy("/spawn_models", SpawnModels)(specs)
        times.append(time.perf_counter() - start)
        if not response.success:
            raise RuntimeError(f"the models were not spawned: {response.message}")
        rospy.ServiceProxy("/delete_models", DeleteModels)(names)
    session.stop(server)
    return min(times)


def _reset(session: RosSession) -> float:
    """Returns the time of a call of /reset_world [s]."""
    import rospy

    from flatland.srv import ResetWorld

    server = session.server(world_path=OFFICE, lockstep=True, seed=1)
    rospy.wait_for_service("/toggle_pause", 30.0)
    reset_world = rospy.ServiceProxy("/reset_world", ResetWorld, persistent=True)
    seconds = best_of(lambda: reset_world(False, -1), seconds=2.0)
    reset_world.close()
    session.stop(server)
    return seconds
