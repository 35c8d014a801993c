"""The hash of the state of a world."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flatland
from flatland import Twist
from flatland.errors import WorldError
from flatland.runtime.state_hash import StateHasher

# Drives both robots of the office, and prints the hash after each of 300 steps. The first argument
# selects what else happens meanwhile.
RUN = """
import math, sys, threading
import numpy as np
import flatland

path, disturbance = sys.argv[1:]
world = flatland.World.from_yaml(path, seed=3)
for number in range(4):
    world.spawn_model("box.model.yaml", f"box_{number}", pose=(3.0 + 0.4 * number, -5.0, number))
if disturbance == "listeners":
    for output in world.ports.outputs.values():
        output.subscribe(lambda value: None)
stop = threading.Event()
def scan():
    angles = np.linspace(-math.pi, math.pi, 700)
    ends = 10 * np.stack([np.cos(angles), np.sin(angles)], 1).astype(np.float32)
    while not stop.wait(0.0002):
        world.physics.cast_rays((3.0, -4.0, 0.1), ends, 0xFFFF)
threads = [threading.Thread(target=scan) for _ in range(3 if disturbance == "threads" else 0)]
for thread in threads:
    thread.start()
world.command("/cmd_vel").set(flatland.Twist(linear_x=1.0, angular_z=0.2))
world.command("/tricycle/cmd_vel").set(flatland.Twist(linear_x=-1.0, angular_z=0.3))
for number in range(300):
    world.step()
    if disturbance == "images" and number % 100 == 50:
        world.draw(size=(200, 100))
        world.contacts
    print(world.state_hash())
stop.set()
for thread in threads:
    thread.join()
"""

ROBOT = """
bodies:
  - {name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}
plugins:
  - {type: DiffDrive, name: drive, body: base, odom_pose_noise: [0.1, 0.1, 0.1]}
"""


def hashes(checkout: Path, disturbance: str) -> list[str]:
    """Returns the hash after each step of a run in a process of its own."""
    world = checkout / "worlds" / "office" / "world.yaml"
    result = subprocess.run(
        [sys.executable, "-c", RUN, str(world), disturbance],
        env={**os.environ, "PYTHONHASHSEED": str(len(disturbance))},
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    return result.stdout.split()


@pytest.fixture(scope="module")
def undisturbed(checkout: Path) -> list[str]:
    """The hashes of a run without subscribers."""
    return hashes(checkout, "none")


def test_each_step_changes_the_hash(undisturbed: list[str]) -> None:
    assert len(set(undisturbed)) == 300


@pytest.mark.parametrize("disturbance", ["", "listeners", "images"])
def test_every_step_has_the_same_hash_in_another_process(
    checkout: Path, undisturbed: list[str], disturbance: str
) -> None:
    assert hashes(checkout, disturbance) == undisturbed


@pytest.mark.threads
def test_scans_in_other_threads_do_not_change_the_hash(
    checkout: Path, undisturbed: list[str]
) -> None:
    assert hashes(checkout, "threads") == undisturbed


def change_command(world: flatland.World) -> None:
    world.command("/cmd_vel").set(Twist(linear_x=0.1))


def repeat_command(world: flatland.World) -> None:
    world.command("/cmd_vel").set(Twist())


def draw_number(world: flatland.World) -> None:
    world.model("robot").plugin("drive").rng.random()


def add_model(world: flatland.World) -> None:
    world.spawn_model("minimal.model.yaml", "other", pose=(5, 0, 0))


def move_model(world: flatland.World) -> None:
    world.move_model("robot", (np.nextafter(np.float32(0), np.float32(1)), 0, 0))


def turn_body(world: flatland.World) -> None:
    body = world.model("robot").bodies[0]
    body.set_velocity(0.0, 0.0, 1e-30)


def add_bare_body(world: flatland.World) -> None:
    world.physics.create_body("static", (0, 0, 0))


@pytest.mark.parametrize(
    "change",
    [
        change_command,
        repeat_command,
        draw_number,
        add_model,
        move_model,
        turn_body,
        add_bare_body,
        flatland.World.step,
    ],
)
def test_each_change_of_the_state_changes_the_hash(
    files: Any, change: Callable[[flatland.World], object]
) -> None:
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


def test_reading_the_world_does_not_change_the_hash(files: Any) -> None:
    world = files.load_model(ROBOT)
    before = world.state_hash()
    world.output("/odometry/filtered").subscribe(lambda value: None)
    assert world.contacts == []
    assert world.is_free((1, 1), 0.1)
    assert world.state_hash() == before


def test_a_closed_world_has_no_hash(files: Any) -> None:
    world = files.load_model(ROBOT)
    world.close()
    with pytest.raises(WorldError, match="the world is closed"):
        world.state_hash()


# -- the state of a plugin -----------------------------------------------------------------


def test_what_a_plugin_returns_as_its_state_is_part_of_the_hash(
    files: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    world = files.load_model(ROBOT)
    kind = type(world.model("robot").plugin("drive"))
    monkeypatch.setattr(kind, "state", lambda plugin: {"count": 1})
    first = world.state_hash()
    monkeypatch.setattr(kind, "state", lambda plugin: {"count": 2})
    assert world.state_hash() != first


def test_a_state_that_cannot_be_hashed_is_an_error_that_names_the_plugin(
    files: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    world = files.load_model(ROBOT)
    monkeypatch.setattr(
        type(world.model("robot").plugin("drive")), "state", lambda plugin: [object()]
    )
    with pytest.raises(WorldError, match=r'"drive".* a value of type object, which cannot be'):
        world.state_hash()


def test_an_attribute_of_a_plugin_named_state_is_not_called(files: Any) -> None:
    world = files.load_model(ROBOT)
    before = world.state_hash()
    world.model("robot").plugin("drive").state = "an attribute of an older plugin"
    assert world.state_hash() == before


# -- values --------------------------------------------------------------------------------


def test_different_values_have_different_hashes() -> None:
    values: list[Any] = [
        None,
        False,
        0,
        0.0,
        -0.0,
        "",
        b"",
        "0",
        b"0",
        (),
        ((),),
        {},
        {"a": 1},
        {"a": 1.0},
        {"b": 1},
        set(),
        {1, 2},
        [1, 2],
        [1, [2]],
        [[1], 2],
        ["12"],
        ["1", "2"],
        float("nan"),
        float("inf"),
        1 << 80,
        Twist(),
        Twist(1.0),
        np.zeros(2),
        np.zeros(2, np.float32),
        np.zeros((2, 1)),
        np.zeros((1, 2)),
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
