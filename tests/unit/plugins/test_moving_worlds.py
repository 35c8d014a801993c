"""The worlds with paths, drives, forces, trailers and sensors: repeated, copied and changed."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from flatland import Twist, World


def traffic(world: World, part: int) -> None:
    world.command("/door").set(part == 0)
    world.command("/forklift/go").set(part == 0)


def drives(world: World, part: int) -> None:
    side = 1.0 if part == 0 else -1.0
    world.command("/car/cmd_vel").set(Twist(1.5, 0.0, 0.4 * side))
    world.command("/mecanum/cmd_vel").set(Twist(0.4, 0.5 * side, 0.6))
    world.command("/trio/cmd_vel").set(Twist(-0.3, 0.4 * side, -0.5))


def pushing(world: World, part: int) -> None:
    world.command("/strong/cmd_vel").set(Twist(1.0))
    world.command("/weak/cmd_vel").set(Twist(1.0 if part == 0 else 0.0))
    world.command("/pusher/cmd_vel").set(Twist(0.8, 0.0, 0.2 * part))


def trailers(world: World, part: int) -> None:
    world.command("/cmd_vel").set(Twist(1.5, 0.0, 0.3))
    if part:
        world.command("/trailer1/hitch").set(False)


def sensors(world: World, part: int) -> None:
    world.command("/cmd_vel").set(Twist(0.4, 0.0, 0.5 - part))


WORLDS = {
    "traffic": traffic,
    "drives": drives,
    "pushing": pushing,
    "trailers": trailers,
    "sensors": sensors,
}
STEPS = 300


@pytest.fixture(params=WORLDS)
def load(request: pytest.FixtureRequest, checkout: Path) -> Any:
    """Returns the function that commands a world, and one that loads it."""
    loaded: list[World] = []

    def from_yaml(seed: int = 3) -> World:
        path = checkout / "worlds" / request.param / "world.yaml"
        loaded.append(World.from_yaml(path, seed=seed))
        return loaded[-1]

    yield WORLDS[request.param], from_yaml
    for world in loaded:
        world.close()


Load = tuple[Callable[[World, int], None], Callable[..., World]]


def run(world: World, command: Callable[[World, int], None], *, single: bool = False) -> str:
    """Steps a world with two commands, and returns the hash of its state."""
    for part in (0, 1):
        command(world, part)
        if single:
            for _ in range(STEPS):
                world.step()
        else:
            world.step(STEPS)
    return str(world.state_hash())


def test_runs_are_equal_with_single_steps_and_after_a_reset(load: Load) -> None:
    command, from_yaml = load
    world = from_yaml()
    first = run(world, command)
    assert run(from_yaml(), command, single=True) == first
    world.reset()
    assert run(world, command) == first


def test_models_are_moved_deleted_and_spawned_again(load: Load) -> None:
    command, from_yaml = load
    world = from_yaml()
    run(world, command)
    for model in list(world.models):
        # As a drag does: a paused world, several moves, and a step on request while it is paused.
        world.pause()
        for x in (2.0, 3.0, 4.0):
            world.move_model(model.name, (x, 4.0, 0.5), "allow")
            world.step(10)
            assert model.pose == pytest.approx((x, 4.0, 0.5))
        world.step(1, while_paused=True)
        world.resume()
        world.step(20)
        bounds = 30.0
        assert all(math.dist(other.pose[:2], (0, 0)) < bounds for other in world.models)
        name, path, namespace = model.name, model.path, model.namespace
        world.delete_model(name)
        world.step(20)
        world.spawn_model(path, name, namespace, (2.0, 2.0, 0.0), "nearest")
        world.step(20)
    assert len(world.models) == len(set(world.models))


def test_steps_need_no_hooks(load: Load) -> None:
    """While no output is wanted, the core performs the steps."""
    command, from_yaml = load
    world = from_yaml()
    run(world, command)
    calls: list[Any] = []
    world.plugin_host.call_updates = calls.append
    world.step(50)
    assert not calls


def test_trailers_follow_on_the_circles_of_the_closed_form(checkout: Path) -> None:
    """In a steady turn, an axle at the distance l behind a hook at c behind another axle has the

    radius of the circle R1 with R1^2 = R0^2 + c^2 - l^2, and the angle atan(c / R0) + atan(l / R1).
    """
    with World.from_yaml(checkout / "worlds" / "trailers" / "world.yaml", seed=1) as world:
        world.command("/cmd_vel").set(Twist(1.0, 0.0, 0.2))
        world.step(6000)
        squared = (1.0 / 0.2) ** 2
        heading = world.model("tractor").pose[2]
        for name, offset in (("trailer1", 0.75), ("trailer2", 0.85), ("trailer3", 0.85)):
            angle = math.atan(offset / math.sqrt(squared))
            squared += offset**2 - 1.5**2
            angle += math.atan(1.5 / math.sqrt(squared))
            before, heading = heading, world.model(name).pose[2]
            assert math.remainder(before - heading, math.tau) == pytest.approx(angle, rel=0.01)
            vx, vy, omega = world.model(name).bodies[0].velocity
            assert omega == pytest.approx(0.2, rel=0.02)
            assert math.hypot(vx, vy) / omega == pytest.approx(math.sqrt(squared), rel=0.01)
