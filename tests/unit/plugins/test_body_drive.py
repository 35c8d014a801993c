"""What all drives have in common: limits that can be changed, and a time limit of commands."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import tricycle

import flatland
from flatland import DynamicsLimits, Twist
from flatland.recording import Replay
from flatland.values import AckermannCommand

BASE = "- {name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}"
SIMPLE = {"bodies": BASE, "joints": ""}
WHEELS = {"bodies": tricycle.BODIES, "joints": tricycle.JOINTS}
DRIVES: dict[str, tuple[str, dict[str, str]]] = {
    "DiffDrive": ("type: DiffDrive, name: drive, body: base", SIMPLE),
    "OmniDrive": ("type: OmniDrive, name: drive, body: base", SIMPLE),
    "TricycleDrive": (f"{tricycle.DRIVE}, command: twist", WHEELS),
}


@pytest.mark.parametrize("kind", DRIVES)
def test_limits_can_be_changed(plugin_world: Any, kind: str) -> None:
    text, options = DRIVES[kind]
    world = plugin_world(f"- {{{text}, linear_dynamics: {{velocity_limit: 0.5}}}}", **options)
    (model,) = world.models
    drive = next(plugin for plugin in model.plugins if plugin.type == kind)
    assert drive.linear_dynamics.velocity_limit == 0.5

    def speed() -> float:
        world.command("/cmd_vel").set(Twist(linear_x=2.0))
        world.step(2)
        return float(model.body("base").velocity[0])

    assert speed() == pytest.approx(0.5)
    drive.linear_dynamics = DynamicsLimits(velocity_limit=0.25)
    assert speed() == pytest.approx(0.25)
    assert drive.linear_dynamics.velocity_limit == 0.25
    drive.linear_dynamics = DynamicsLimits()
    assert speed() == pytest.approx(2.0)


# -- command_timeout -----------------------------------------------------------------------

LIMITED = (
    "linear_dynamics: {acceleration_limit: 3, deceleration_limit: 2}, "
    "angular_dynamics: {acceleration_limit: 4}"
)
CAR = "type: AckermannDrive, name: drive, body: base, wheelbase: 0.5, max_steer_angle: 0.7"
TIMED: dict[str, tuple[str, dict[str, str], Any]] = {
    **{
        kind: (text, options, Twist(linear_x=1.0, linear_y=0.3, angular_z=0.5))
        for kind, (text, options) in DRIVES.items()
    },
    "TricycleDrive, steering": (tricycle.DRIVE, WHEELS, Twist(linear_x=1.0, angular_z=0.5)),
    "AckermannDrive": (CAR, SIMPLE, Twist(linear_x=1.0, angular_z=0.5)),
    "AckermannDrive, ackermann": (
        f"{CAR}, command: ackermann",
        SIMPLE,
        AckermannCommand(0.5, 0.2, 1.0, 0.5),
    ),
}
STEP_NS = 5_000_000


@pytest.fixture
def timed(plugin_world: Any) -> Callable[..., flatland.World]:
    """Loads a world with a DiffDrive that has a timeout."""

    def load(timeout: str = "0.02", more: str = "") -> flatland.World:
        text = DRIVES["DiffDrive"][0]
        world: flatland.World = plugin_world(f"- {{{text}, command_timeout: {timeout}{more}}}")
        return world

    return load


def commanded(world: flatland.World, steps: int) -> list[float]:
    """Sends one command, and returns the velocity after each step."""
    world.command("/cmd_vel").set(Twist(linear_x=1.0))
    speeds = []
    for _ in range(steps):
        world.step()
        speeds.append(world.models[0].bodies[0].velocity[0])
    return speeds


@pytest.mark.parametrize("kind", TIMED)
def test_a_drive_stops_as_after_a_command_of_zeros(plugin_world: Any, kind: str) -> None:
    text, options, command = TIMED[kind]

    def states(timeout: float, stop: int) -> list[Any]:
        entry = f"- {{{text}, {LIMITED}, command_timeout: {timeout}}}"
        world = plugin_world(entry, **options)
        topic = "/ackermann_cmd" if isinstance(command, AckermannCommand) else "/cmd_vel"
        drive = next(plugin for plugin in world.models[0].plugins if plugin.name == "drive")
        found = []
        for step in range(80):
            if step in (0, 10):  # the same command again
                world.command(topic).set(command)
            elif step == stop:
                world.command(topic).set(type(command)())
            world.step()
            found.append((drive.drive_state(), world.physics.body_states().tobytes()))
        return found

    stopped = states(0.0, 30)
    assert states(0.1, -1) == stopped
    assert states(0.0, -1)[:30] == stopped[:30]
    assert states(0.0, -1)[30:] != stopped[30:]


@pytest.mark.parametrize(
    ("timeout", "steps"),
    [("0.02", 4), ("0.020000001", 5), ("0.0201", 5), ("1.e-12", 1), ("0", 9), (".inf", 9)],
)
def test_the_time_limit_is_exact(
    timed: Callable[..., flatland.World], timeout: str, steps: int
) -> None:
    assert commanded(timed(timeout), 9) == [1.0] * steps + [0.0] * (9 - steps)


def test_snapshots_and_clones_contain_the_age_of_the_command(
    timed: Callable[..., flatland.World],
) -> None:
    world = timed()
    commanded(world, 2)
    snapshot, clone = world.snapshot(), world.clone()
    expected = []
    for _ in range(5):
        world.step()
        expected.append(world.state_hash())
    for other in (clone, world):
        if other is world:
            world.restore(snapshot)
        hashes = []
        for _ in range(5):
            other.step()
            hashes.append(other.state_hash())
        assert hashes == expected
    assert world.models[0].bodies[0].velocity[0] == 0.0
    clone.close()


def test_a_run_with_a_time_limit_can_be_repeated(
    timed: Callable[..., flatland.World], tmp_path: Path
) -> None:
    world = timed()
    world.record(tmp_path / "run.flog")
    for _ in range(3):
        commanded(world, 3)  # the same command again
    world.step(20)
    world.close()
    replay = Replay(tmp_path / "run.flog")
    replay.run()
    replay.close()
    assert (replay.difference, replay.last_step) == (None, 29)


def test_the_hash_depends_on_the_age_of_a_command_with_a_time_limit(
    timed: Callable[..., flatland.World],
) -> None:
    ages = []
    for timeout in ("0.02", "0"):
        world = timed(timeout)
        drive: Any = world.models[0].plugin("drive")
        world.command("/cmd_vel").set(Twist())
        for _ in range(6):
            ages.append(drive.controller.command_age)
            assert (ages[-1] in drive.state()[3:]) == (timeout != "0")
            world.step()
    assert ages == [0, STEP_NS, 2 * STEP_NS, 3 * STEP_NS, 4 * STEP_NS, 4 * STEP_NS, *[0] * 6]


def test_the_time_limit_can_be_changed(timed: Callable[..., flatland.World]) -> None:
    world = timed("0")
    drive: Any = world.models[0].plugin("drive")
    drive.command_timeout = 0.01
    assert drive.command_timeout == 0.01
    assert commanded(world, 3) == [1.0, 1.0, 0.0]
    drive.command_timeout = 0.0
    assert commanded(world, 9) == [1.0] * 9
    for wrong in (-1.0, float("nan")):
        with pytest.raises(ValueError, match="command_timeout must not be negative or NaN"):
            drive.command_timeout = wrong
    assert drive.command_timeout == 0.0
