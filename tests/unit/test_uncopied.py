"""`copy` and `pickle` refuse the parts of a world, and name what copies them."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from flatland import World
from flatland.recording import Replay
from flatland.simulation import Simulation

PARTS: dict[str, tuple[Callable[[World], object], str]] = {
    "World": (lambda w: w, r"World\.clone\(\) .* World\.snapshot\(\)"),
    "Model": (lambda w: w.models[0], r"World\.clone\(\)"),
    "Layer": (lambda w: w.layers[0], r"World\.clone\(\)"),
    "DiffDrive": (lambda w: w.models[0].plugins[0], r"World\.clone\(\)"),
    "Output": (lambda w: w.output("/odometry/filtered"), r"World\.clone\(\)"),
    "Command": (lambda w: next(iter(w.ports.commands.values()))[0], r"World\.clone\(\)"),
    "CommandTopic": (lambda w: w.command("/cmd_vel"), r"World\.clone\(\)"),
    "WorldSnapshot": (lambda w: w.snapshot(), r"World\.restore\(\) .* World\.clone\(\)"),
    "Simulation": (Simulation, r"World\.clone\(\)"),
    "PhysicsWorld": (lambda w: w.physics, r"PhysicsWorld\.copy\(\)"),
}
HANDLES: dict[str, Callable[[World], object]] = {
    "Body": lambda w: w.models[0].bodies[0],
    "PhysicsFixture": lambda w: w.models[0].bodies[0].fixtures[0],
}


@pytest.fixture(scope="module")
def world(checkout: Path) -> Any:
    with World.from_yaml(checkout / "worlds" / "office" / "world.yaml", seed=1) as world:
        yield world


@pytest.mark.parametrize("duplicate", [copy.copy, copy.deepcopy, pickle.dumps])
@pytest.mark.parametrize("name", PARTS)
def test_a_part_of_a_world_names_what_copies_it(
    world: World, name: str, duplicate: Callable[[object], object]
) -> None:
    find, advice = PARTS[name]
    with pytest.raises(TypeError, match=f"cannot copy or pickle {name} objects: .*{advice}"):
        duplicate(find(world))
    assert not world.closed


@pytest.mark.parametrize("name", HANDLES)
def test_a_handle_is_the_same_in_a_copy_and_not_pickled(world: World, name: str) -> None:
    handle = HANDLES[name](world)
    assert copy.copy(handle) is copy.deepcopy(handle) is handle
    with pytest.raises(TypeError, match=rf"pickle {name} objects: .* World\.clone\(\)"):
        pickle.dumps(handle)


def test_a_recording_and_its_replay_are_not_copied(checkout: Path, tmp_path: Path) -> None:
    with World.from_yaml(checkout / "worlds" / "simple" / "world.yaml", seed=1) as world:
        recorder = world.record(tmp_path / "a.flog")
        with pytest.raises(TypeError, match=r"Recorder objects: World\.record\(\)"):
            copy.copy(recorder)
    replay = Replay(tmp_path / "a.flog")
    with pytest.raises(TypeError, match="another Replay"):
        copy.deepcopy(replay)
    replay.close()
