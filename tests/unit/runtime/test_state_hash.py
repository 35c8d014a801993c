"""The hash of the state of a world."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flatland
from flatland import Twist
from flatland.errors import WorldError
from flatland.plugins.diff_drive import DiffDrive
from flatland.runtime.state_hash import StateHasher
from flatland.scene.world_scene import describe_world

ROBOT = """
bodies:
  - {name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}
plugins:
  - {type: DiffDrive, name: drive, body: base, odom_pose_noise: [0.1, 0.1, 0.1]}
"""


def hashes(path: Path, *, observed: bool) -> list[str]:
    """Returns the hash after each step in the office; with subscribers and scenes if observed."""
    with flatland.World.from_yaml(path, seed=3) as world:
        if observed:
            for output in world.ports.outputs.values():
                output.subscribe(lambda value: None)
        world.command("/cmd_vel").set(Twist(linear_x=1.0, angular_z=0.2))
        world.command("/tricycle/cmd_vel").set(Twist(linear_x=-1.0, angular_z=0.3))
        found = []
        for number in range(30):
            world.step()
            if observed and number == 10:
                describe_world(world, None, scans=True)
                assert world.contacts is not None
            found.append(world.state_hash())
    return found


def test_each_step_changes_the_hash_and_observers_do_not(checkout: Path) -> None:
    """tests/unit/test_determinism.py compares hashes of several processes."""
    office = checkout / "worlds" / "office" / "world.yaml"
    alone = hashes(office, observed=False)
    assert len(set(alone)) == 30
    assert hashes(office, observed=True) == alone


CHANGES: dict[str, Callable[[flatland.World], object]] = {
    "command": lambda world: world.command("/cmd_vel").set(Twist(linear_x=0.1)),
    "repeated command": lambda world: world.command("/cmd_vel").set(Twist()),
    "random number": lambda world: world.model("robot").plugin("drive").rng.random(),
    "model": lambda world: world.spawn_model("minimal.model.yaml", "other", pose=(5, 0, 0)),
    "pose": lambda world: world.move_model("robot", (1e-45, 0, 0)),  # the least float
    "velocity": lambda world: world.model("robot").bodies[0].set_velocity(0.0, 0.0, 1e-30),
    "body": lambda world: world.physics.create_body("static", (0, 0, 0)),
    "step": flatland.World.step,
}


@pytest.mark.parametrize("name", CHANGES)
def test_each_change_of_the_state_changes_the_hash(files: Any, name: str) -> None:
    change = CHANGES[name]
    world, other = files.load_model(ROBOT), files.load_model(ROBOT)
    before = world.state_hash()
    assert before == world.state_hash() == other.state_hash()
    change(world)
    after = world.state_hash()
    assert after != before
    change(other)
    assert other.state_hash() == after


def test_the_seed_is_part_of_the_state(files: Any) -> None:
    assert files.load_model(ROBOT).state_hash() != files.load_model(ROBOT, seed=2).state_hash()


# -- the state of a plugin -----------------------------------------------------------------


@pytest.fixture
def world(files: Any) -> flatland.World:
    return files.load_model(ROBOT)  # type: ignore[no-any-return]


def test_what_a_plugin_returns_as_its_state_is_part_of_the_hash(
    world: flatland.World, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(DiffDrive, "state", lambda plugin: {"count": 1})
    first = world.state_hash()
    monkeypatch.setattr(DiffDrive, "state", lambda plugin: {"count": 2})
    assert world.state_hash() != first


@pytest.mark.parametrize(
    ("state", "error", "text"),
    [
        (lambda plugin: [object()], WorldError, r'"drive".* a value of type object, which cannot'),
        (lambda plugin: 1 + "a", TypeError, "unsupported operand"),  # raised unchanged
    ],
)
def test_a_state_that_is_invalid_or_raises_is_an_error(
    world: flatland.World, monkeypatch: pytest.MonkeyPatch, state: Any, error: type, text: str
) -> None:
    monkeypatch.setattr(DiffDrive, "state", state)
    with pytest.raises(error, match=text):
        world.state_hash()


def test_an_attribute_of_a_plugin_named_state_is_not_called(world: flatland.World) -> None:
    before = world.state_hash()
    world.model("robot").plugin("drive").state = "an attribute of an older plugin"
    assert world.state_hash() == before


# -- values --------------------------------------------------------------------------------


def test_different_values_have_different_hashes() -> None:
    values: list[Any] = [
        *(None, False, True, 0, 1 << 80, 0.0, -0.0, float("nan"), float("inf")),
        *("", b"", "0", b"0", "Y", b"S"),
        *((), ((),), {}, {"a": 1}, {"a": 1.0}, {"b": 1}, set(), {1, 2}),
        *([1, 2], [1, None], [None, 1], [1, [2]], [[1], 2], ["12"], ["1", "2"]),
        *(Twist(), Twist(1.0), [Twist(1.0, 2.0, 3.0), 4.0], [1.0, Twist(2.0, 3.0, 4.0)]),
        *(np.zeros(2), np.zeros(2, np.float32), np.zeros((2, 1)), np.zeros((1, 2))),
        np.array([0.0, -0.0]),
    ]
    digests = []
    for value in values:
        hasher = StateHasher()
        hasher.add(value)
        digests.append(hasher.hexdigest())
    assert len(set(digests)) == len(values)


@pytest.mark.parametrize(
    ("value", "equal"),
    [
        ({"a": 1, "b": [2]}, {"b": (2,), "a": 1}),
        ({3, 1, 2}, {2, 3, 1}),
        (np.arange(6).reshape(2, 3), np.asfortranarray(np.arange(6).reshape(2, 3))),
        (np.float32(0.5), 0.5),
    ],
)
def test_equal_values_have_the_same_hash(value: Any, equal: Any) -> None:
    first, second = StateHasher(), StateHasher()
    first.add(value)
    second.add(equal)
    assert first.hexdigest() == second.hexdigest()


@pytest.mark.parametrize("value", [object(), len, Twist, np.array(["a"]), {"a": object()}])
def test_other_values_are_refused(value: Any) -> None:
    with pytest.raises(TypeError, match="cannot be hashed"):
        StateHasher().add(value)
