"""The jobs of a step, after jobs were added and removed, and permissions to step without code."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable

import numpy as np
import pytest

from flatland.physics import (
    AgentBatch,
    Controller,
    PhysicsBody,
    PhysicsWorld,
    RangeFinder,
    Run,
    RunEnd,
    Touches,
)
from flatland.plugin_api.update_timer import UpdateTimer

STEP = 10_000_000  # ns
# In each step, and in no step but that at time 0.
ALWAYS, NEVER = (UpdateTimer(rate).clock(STEP) for rate in (math.inf, 1e-9))


def run(world: PhysicsWorld) -> list[int]:
    """Returns the callbacks that are to be called first."""
    return world.jobs.run(*Run(STEP, STEP, 1, 0.01, 8, 3))[2]


def mover(world: PhysicsWorld) -> PhysicsBody:
    body = world.create_body("kinematic", (0, 0, 0))
    body.control_velocity().set_target(1.0, 0.0, 0.0)
    return body


def add_controller(world: PhysicsWorld) -> Callable[[], None]:
    return world.create_body("kinematic", (0, 0, 0)).control_velocity().remove


def add_callback(world: PhysicsWorld) -> Callable[[], None]:
    callback = world.jobs.add_callback((1, 0), NEVER, is_after=True)
    return lambda: world.jobs.remove_callback(callback)


def add_crowd(world: PhysicsWorld) -> Callable[[], None]:
    return world.add_crowd(
        is_orca=False, is_dynamic=False, bits=1, interval=1, key=1, numbers={}
    ).remove


def test_a_run_has_new_steps_with_their_physics_by_default(world: PhysicsWorld) -> None:
    body = world.create_body("kinematic", (0.0, 0.0, 0.0))
    body.set_velocity(1.0, 0.0, 0.0)
    made, end, *_ = world.jobs.run(*Run(0, STEP, 3, 0.01, 8, 3))
    assert (made, end) == (3, RunEnd.DONE)
    assert body.pose[0] == pytest.approx(0.03)


@pytest.mark.parametrize("add", [add_controller, add_callback, add_crowd])
def test_a_new_controller_acts_although_another_job_is_removed(
    world: PhysicsWorld, add: Callable[[PhysicsWorld], Callable[[], None]]
) -> None:
    remove = add(world)
    run(world)
    body = mover(world)
    remove()
    run(world)
    assert body.velocity == (1.0, 0.0, 0.0)


def test_a_controller_that_fails_keeps_the_velocity_of_the_step_before(world: PhysicsWorld) -> None:
    body = world.create_body("kinematic", (0, 0, 0))
    controller = body.control_velocity()
    controller.set_target(1.0, 0.0, 0.5)
    run(world)
    controller.set_target(1e30, 0.0, 0.0)
    [(failed, text)] = world.jobs.run(*Run(STEP, STEP, 1, 0.01, 8, 3))[3]
    assert failed == controller.id
    assert text.startswith("velocity must be finite and within +-1e+09, got (9.99")
    assert controller.velocity == body.velocity == (1.0, 0.0, 0.5)


def test_a_new_clock_does_not_replace_one_in_use(world: PhysicsWorld) -> None:
    first = world.jobs.add_callback((1, 0), ALWAYS, is_after=False)
    removed = world.jobs.add_callback((2, 0), NEVER, is_after=False)
    world.jobs.remove_callback(removed)
    world.jobs.add_callback((3, 0), NEVER, is_after=True)
    second = world.jobs.add_callback((4, 0), ALWAYS, is_after=False)
    assert run(world) == [first, second]
    world.jobs.remove_callback(first)
    world.jobs.add_callback((5, 0), NEVER, is_after=False)
    assert run(world) == [second]


class _HeapUse(ctypes.Structure):
    """`struct mallinfo2` of the C library: ten numbers."""

    _fields_ = [(f"number_{i}", ctypes.c_size_t) for i in range(10)]


def _heap_use() -> int:
    """Returns the memory that the C++ code of the process uses [B]."""
    mallinfo = ctypes.CDLL(None).mallinfo2
    mallinfo.restype = _HeapUse
    use = mallinfo()
    return int(use.number_4 + use.number_7)  # hblkhd and uordblks


def test_clocks_of_removed_callbacks_are_reused(world: PhysicsWorld) -> None:
    def use_new_clocks(first: int, count: int) -> None:
        for weight in range(first, first + count):
            callback = world.jobs.add_callback((1, 0), (weight, 10**6), is_after=False)
            world.jobs.remove_callback(callback)

    use_new_clocks(1, 10_000)
    before = _heap_use()
    use_new_clocks(10_001, 10_000)
    assert _heap_use() - before < 50_000  # 5 B for each clock; one that is kept takes 32 B


def agent_in(world: PhysicsWorld) -> tuple[PhysicsBody, Controller, Touches, RangeFinder]:
    body = world.create_body("dynamic", (0, 0, 0))
    beams = RangeFinder(np.array([(1.0, 0.0)]), 1.0, origin=(0, 0, 0), mask=1)
    return body, body.control_velocity(), world.collect_touches([body]), beams


def test_the_agents_of_a_world_are_neighbours_with_different_bodies(world: PhysicsWorld) -> None:
    first, second, other = agent_in(world), agent_in(world), agent_in(PhysicsWorld())
    with pytest.raises(ValueError, match="the agents of a world must be neighbours in a batch"):
        AgentBatch([first, other, second])
    with pytest.raises(ValueError, match="must have different bodies"):
        AgentBatch([first, first])
    batch = AgentBatch([first, second, other])
    with pytest.raises(ValueError, match="must have different bodies"):
        batch.replace(2, second)
    batch.replace(2, agent_in(PhysicsWorld()))
    assert batch.not_permitted(np.ones(3, np.bool_)) == [0, 1, 2]


def test_interrupts_never_amount_to_a_permission(world: PhysicsWorld) -> None:
    batch = AgentBatch([agent_in(world)])
    for _ in range(3):
        assert batch.not_permitted(np.array([True])) == [0]
        world.jobs.interrupt()
    batch.permit(0)
    assert batch.not_permitted(np.array([True])) == []
    world.jobs.interrupt()
    assert batch.not_permitted(np.array([True])) == [0]
