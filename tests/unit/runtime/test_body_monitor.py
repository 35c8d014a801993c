"""What a world does with jammed models and with bodies that a step left invalid."""

from __future__ import annotations

import logging
from typing import Any

import pytest

import flatland

# The narrow room: a robot of radius 0.2 between two walls that are 0.3 m apart.
ROOM = """
-0.35 0.30 -0.35 0.50
0.30 0.05 0.30 0.15
0.15 0.25 0.35 0.25
-0.05 -0.25 -0.05 -0.05
-0.35 0.25 0.05 0.25
0.20 0.20 0.20 0.35
0.25 0 0.25 0.25
"""
ROBOT = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 10}]}]
plugins: [{type: DiffDrive, name: drive, body: base}]
"""
# A lever of 100 km that turns at 1e9 rad/s and hits a body: the impulse overflows.
BODY = "bodies: [{name: base, footprints: [{type: circle, radius: 30, density: 1.0e+8}]}]"
LEVER = """
bodies: [{name: arm, type: kinematic, footprints: [
  {type: circle, radius: 30, center: [-1.0e+5, 87], density: 0}]}]
"""


@pytest.fixture
def room(files: Any) -> flatland.World:
    """A world with the narrow room, where a robot is jammed, and a robot with room."""
    files.write("room.dat", ROOM)
    files.write("room.yaml", "{type: line_segments, data: room.dat, scale: 1, origin: [0, 0, 0]}")
    files.write("robot.model.yaml", ROBOT)
    world = files.load(
        """
        properties: {}
        layers: [{name: 2d, map: room.yaml}]
        models:
          - {name: r1, namespace: r1, model: robot.model.yaml, pose: [0, 0, 1.0353632]}
          - {name: r2, namespace: r2, model: robot.model.yaml, pose: [5, 0, 0]}
        """
    )
    for name in ("r1", "r2"):
        world.command(f"/{name}/cmd_vel").set(flatland.Twist(linear_x=0.3, angular_z=0.4))
    return world


def jam_lines(caplog: pytest.LogCaptureFixture) -> list[str]:
    return [line for line in caplog.messages if "jammed" in line]


def test_jammed_model_is_logged_once_after_twenty_steps(
    room: flatland.World, caplog: pytest.LogCaptureFixture
) -> None:
    room.step(19)
    assert jam_lines(caplog) == []
    room.step()
    x, y, _ = room.model("r1").pose
    assert jam_lines(caplog)[0].startswith(
        f'model "r1" is jammed between walls at ({x:.2f}, {y:.2f}): '
    )
    room.step(2000)
    assert len(jam_lines(caplog)) == 1


def test_moved_model_is_logged_again(
    room: flatland.World, caplog: pytest.LogCaptureFixture
) -> None:
    room.step(1000)
    room.move_model("r1", (0, 0, 1.0353632))
    room.step(1000)
    assert len(jam_lines(caplog)) == 2


def test_model_that_was_free_for_long_is_logged_again(
    room: flatland.World, caplog: pytest.LogCaptureFixture
) -> None:
    room.step(1000)
    pose = room.model("r1").pose
    body = room.model("r1").bodies[0]
    # By hand, since `move_model` forgets the jam.
    body.set_pose(0, -3, 0)
    room.step(int(4.9 / 0.005))
    body.set_pose(*pose)
    room.step(500)
    assert len(jam_lines(caplog)) == 1
    body.set_pose(0, -3, 0)
    room.step(int(5.1 / 0.005))
    body.set_pose(*pose)
    room.step(500)
    assert len(jam_lines(caplog)) == 2


def overflowing(files: Any, **options: str) -> flatland.World:
    """A world in which the next step makes the body of `heavy` and the arm of `lever` invalid."""
    files.write("heavy.model.yaml", BODY.replace("density", "restitution: 1.0e+9, density"))
    files.write("lever.model.yaml", LEVER.replace("density", "restitution: 1.0e+9, density"))
    files.write("robot.model.yaml", ROBOT)
    world = files.load(
        """
        properties: {}
        layers: [{name: 2d}]
        models:
          - {name: heavy, model: heavy.model.yaml, pose: [0, 29.7, 0]}
          - {name: lever, model: lever.model.yaml, pose: [1.0e+5, 0, 0]}
          - {name: r1, model: robot.model.yaml, pose: [-500, 0, 0]}
        """,
        **options,
    )
    world.model("lever").bodies[0].set_velocity(0, 0, 1e9)
    return world


def test_invalid_body_raises_and_names_the_model(files: Any) -> None:
    world = overflowing(files)
    for _ in range(2):
        with pytest.raises(flatland.WorldError, match='body "base" of model "heavy"'):
            world.step()
    assert world.time == 0.0
    world.delete_model("heavy")
    world.move_model("lever", (1e5, 0, 0))
    world.step()
    assert world.time == pytest.approx(0.005)
    assert world.model("r1").pose == (-500, 0, 0)


def test_invalid_body_removes_the_model_and_the_rest_goes_on(
    files: Any, caplog: pytest.LogCaptureFixture
) -> None:
    world = overflowing(files, on_invalid_body="remove")
    world.command("/cmd_vel").set(flatland.Twist(linear_x=1.0))
    with caplog.at_level(logging.ERROR):
        world.step(10)
    assert [model.name for model in world.models] == ["r1"]
    assert world.time == pytest.approx(0.05)
    assert world.model("r1").pose[0] == pytest.approx(-499.95)
    errors = [record.message for record in caplog.records if record.levelno == logging.ERROR]
    assert len(errors) == 1
    assert 'body "base" of model "heavy"' in errors[0]
    assert "removed from the world" in errors[0]


def test_invalid_body_without_a_model_is_removed(files: Any) -> None:
    world = overflowing(files, on_invalid_body="remove")
    world.delete_model("heavy")
    body = world.physics.create_body("dynamic", (0, 29.7, 0))
    body.create_circle((0, 0), 30, density=1e8, restitution=1e9, friction=0)
    world.step(2)
    assert not body.alive
    assert [model.name for model in world.models] == ["r1"]


def test_unknown_choice_is_refused() -> None:
    with pytest.raises(ValueError, match="on_invalid_body must be 'raise' or 'remove', got"):
        flatland.World(seed=1, on_invalid_body="ignore")
