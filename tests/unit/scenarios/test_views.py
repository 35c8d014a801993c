"""What a controller can access of its world."""

from __future__ import annotations

import copy
import dataclasses

import numpy as np
import pytest

from flatland.scenarios.planner import plan_path
from flatland.scenarios.scenario import Run
from flatland.scenarios.stage import prepare
from flatland.scenarios.views import ViewError, behind
from flatland.world import World


@pytest.fixture
def stage(scenario, room):
    with World.from_yaml(room / "world.yaml", seed=4) as world:
        world.step(3)
        yield prepare(world, Run(scenario(), "straight", 4))


def test_a_view_shows_the_world(stage):
    world, task = stage.world, stage.task
    view = task.world
    assert (view.time, view.seed, view.timekeeper.step_size) == (world.time, 4, 0.005)
    assert task.robot.pose == world.model("robot").pose == (2.0, 5.0, 0.0)
    assert task.robot is view.model("robot") is view.models[0]
    assert task.robot.bodies[0] is task.robot.body("base")
    assert task.robot.bodies[0].velocity == (0.0, 0.0, 0.0)
    assert task.robot.body("base").fixtures[0].radius == pytest.approx(0.2)
    assert np.array_equal(view.layer("walls").world_edges, world.layer("walls").world_edges)
    assert view.state().names == ("robot",)
    assert view.is_free((5, 5), 0.2)
    assert not view.is_free((2, 5), 0.2)
    assert view.is_free((2, 5), 0.2, ignore=task.robot)
    assert view.sample_free(2, 0.2, rng=task.rng).shape == (2, 3)
    odometry = view.output("/odometry/filtered")
    assert odometry.latest is None
    world.step()
    assert odometry.latest.pose == (2.0, 5.0, 0.0)
    # The simulator itself plans with the task of a controller.
    assert len(plan_path(task, (2, 5), (5, 5))) > 10


@pytest.mark.parametrize(
    "attempt",
    [
        lambda task: task.world.step(),
        lambda task: task.world.move_model("robot", (5, 5, 0)),
        lambda task: task.world.spawn_model("box.model.yaml", "box"),
        lambda task: task.world.command("/cmd_vel"),
        lambda task: task.world.physics,
        lambda task: task.world.plugins,
        lambda task: task.world.clone(),
        lambda task: task.world.timekeeper.advance(),
        lambda task: setattr(task.world.timekeeper, "sim_time_ns", 0),
        lambda task: setattr(task.world, "time", 0.0),
        lambda task: setattr(task.world, "anything", 0.0),
        lambda task: delattr(task.world, "time"),
        lambda task: task.robot.set_pose(5, 5, 0),
        lambda task: task.robot.world,
        lambda task: task.robot.plugins,
        lambda task: task.robot.bodies[0].set_velocity(1, 0, 0),
        lambda task: task.robot.bodies[0].world,
        lambda task: task.robot.bodies[0].physics,
        lambda task: task.robot.bodies[0].entity,
        lambda task: setattr(task.robot.bodies[0].fixtures[0], "is_sensor", True),
        lambda task: task.robot.bodies[0].fixtures[0].body,
        lambda task: task.world.layers[0].body,
        lambda task: task.world.output("/scan").subscribe(print),
        lambda task: copy.copy(task.world),
    ],
)
def test_a_view_changes_nothing(attempt, stage):
    before = stage.world.state_hash()
    with pytest.raises(ViewError, match=r"controller"):
        attempt(stage.task)
    assert stage.world.state_hash() == before


def test_no_attribute_of_a_view_leads_to_the_world(stage):
    world = stage.world
    for view in (stage.task.world, stage.task.robot, stage.task.robot.bodies[0]):
        for name in dir(view):
            found = getattr(view, name, None)
            assert found not in (world, world.physics, behind(stage.task.robot), *world.layers)
            assert getattr(found, "__self__", view) in (view, type(view), object)
    assert not hasattr(stage.task.world, "step")


def test_values_are_copies(stage):
    view = stage.task.world
    edges = view.layers[0].world_edges
    edges[:] = 0.0
    assert view.layers[0].world_edges.any()
    view.models.clear()
    assert view.models
    goals = stage.task.goals
    controlled = dataclasses.replace(stage.task)
    object.__setattr__(controlled, "goals", ((2, 5),))
    assert stage.task.goals == goals
