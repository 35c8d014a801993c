"""Parts of steps, for tests of what happens before the physics."""

from __future__ import annotations

import flatland
from flatland.physics import Run, RunEnd


def control_bodies(world: flatland.World, dt: float | None = None) -> None:
    """Carries out the controllers of a step, without callbacks and without the physics.

    Args:
        world: The world.
        dt: Duration of the step for the controllers [s], by default that of a step of the world.
    """
    world.plugin_host.jobs.refresh(False)
    timekeeper, jobs = world.timekeeper, world.physics.jobs
    jobs.clear_interrupt()
    run = Run(
        timekeeper.sim_time_ns,
        timekeeper.step_size_ns,
        1,
        dt or timekeeper.step_size,
        10,
        10,
        calls_physics=True,
    )
    end = jobs.run(*run)[1]
    while end == RunEnd.BEFORE:
        end = jobs.run(*run._replace(continues=True))[1]
    assert end == RunEnd.PHYSICS
