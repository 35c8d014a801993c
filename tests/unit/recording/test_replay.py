"""Recorded runs are repeated exactly, and differences are found."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import flatland
from flatland import ModelPlugin, Twist, World
from flatland.errors import FlatlandError, WorldError
from flatland.plugins.diff_drive import DiffDrive
from flatland.recording import RecordingError, Replay
from flatland.recording.log_file import read_recording
from flatland.recording.replay import Difference

ROBOT = """
bodies:
  - name: base
    footprints: [{type: circle, radius: 0.2, density: 1}]
plugins:
  - {type: DiffDrive, name: drive, body: base}
"""
WORLD = """
properties: {}
layers: [{name: 2d, map: room.yaml}]
models:
  - {name: robot, model: robot.model.yaml}
  - {name: ball, model: ball.model.yaml, pose: [1.5, 0.05, 0]}
"""
BALL = """
bodies:
  - name: base
    linear_damping: 0.5
    footprints:
      - {type: circle, radius: '$eval param("radius", 0.2)', density: 1, restitution: 0.5}
"""
ROOM = "type: line_segments\ndata: room.dat\nscale: 1\norigin: [0, 0, 0]\n"


@pytest.fixture
def world_files(files: Any) -> Any:
    """A room with a robot and a ball."""
    files.write("robot.model.yaml", ROBOT)
    files.write("ball.model.yaml", BALL)
    files.write("room.yaml", ROOM)
    files.write("room.dat", "-3 -3 3 -3\n3 -3 3 3\n3 3 -3 3\n-3 3 -3 -3\n")
    return files


def drive(world: World) -> None:
    """Drives into the ball, changes the models, and makes requests that fail."""
    world.command("/cmd_vel").set(Twist(linear_x=0.7, angular_z=0.01))
    world.step(150)
    world.spawn_model("ball.model.yaml", "other", "ns", (0.5, 0.1, 1.0), "nearest")
    with pytest.raises(FlatlandError):
        world.spawn_model("ball.model.yaml", "other")
    with pytest.raises(FlatlandError):
        world.spawn_model("missing.yaml", "third")
    with pytest.raises(FlatlandError):
        world.move_model("other", (float("nan"), 0, 0))
    with pytest.raises(FlatlandError):
        world.delete_model("missing")
    world.step(77)
    world.command("/cmd_vel").set(Twist(linear_x=-0.5))
    world.move_model("ball", (-1.0, 0.0, 0.3))
    world.step(200)
    world.delete_model("other")
    world.move_model("robot", (-1.0, 1.0, 0.5), keep_odometry=True)
    world.step(123)


@pytest.fixture
def path(world_files: Any) -> Path:
    """Where a world is recorded."""
    return Path(world_files.folder, "run.flog")


@pytest.fixture
def run(world_files: Any, path: Path) -> Path:
    """A recording of `drive`."""
    world = world_files.load(WORLD, params={"radius": 0.25})
    world.record(path)
    drive(world)
    world.close()
    return path


def replay(path: Path, **options: Any) -> Replay:
    result = Replay(path, **options)
    result.run()
    result.close()
    return result


def test_a_run_is_repeated_exactly(run: Path) -> None:
    result = replay(run)
    assert result.difference is None
    assert result.last_step == 550
    kinds = [record.get("kind") for record in read_recording(run).records]
    assert kinds.count("state") == 2
    assert kinds.count("result") == 7
    assert kinds[-1] == "end"


def test_a_recording_does_not_change_the_run(world_files: Any, path: Path) -> None:
    world, recorded = (world_files.load(WORLD, params={"radius": 0.25}) for _ in range(2))
    recorded.record(path)
    drive(world)
    drive(recorded)
    assert recorded.state_hash() == world.state_hash()


# -- differences ---------------------------------------------------------------------------


def test_the_first_step_that_differs_is_named(run: Path) -> None:
    result = Replay(run)
    body = result.world.model("ball").bodies[0]
    steps = 0

    def disturb(step: int) -> None:
        nonlocal steps
        steps = step
        if step == 42:
            body.set_velocity(0.0, 1e-6, 0.0)

    assert result.run(disturb) == Difference(43, "poses or velocities of bodies differ")
    result.close()
    assert steps < 250  # ends at the next comparison


def test_a_plugin_that_behaves_differently_is_found(
    run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = Replay(run)
    monkeypatch.setattr(DiffDrive, "state", lambda _plugin: "other")
    assert result.run() == Difference(200, "the state of a plugin differs")
    result.close()


def test_a_request_with_another_outcome_is_found(run: Path) -> None:
    result = Replay(run)
    result.world.spawn_model("ball.model.yaml", "other", pose=(2, 2, 0), if_blocked="allow")
    difference = result.run()
    result.close()
    assert difference is not None
    assert difference.step == 150
    assert "spawn_model succeeds in the recording, but fails (YamlError" in difference.text


def test_changed_and_deleted_files_are_an_error_that_names_them(
    world_files: Any, run: Path
) -> None:
    world_files.write("ball.model.yaml", BALL.replace("0.5", "0.6"))
    with pytest.raises(RecordingError, match=r'files have changed [^"]*"[^"]*/ball\.model\.yaml"$'):
        Replay(run)
    assert replay(run, check_files=False).difference is not None
    world_files.write("ball.model.yaml", BALL)
    (world_files.folder / "room.dat").unlink()
    with pytest.raises(RecordingError, match=r'files have changed [^"]*"[^"]*/room\.dat"$'):
        Replay(run)


# -- what is recorded ----------------------------------------------------------------------


class Helper(ModelPlugin):
    """Spawns a model and sets a command, at its start and in a hook."""

    def on_initialize(self, config: Any) -> None:
        self.count = 0
        self._act()

    def before_physics_step(self, timekeeper: flatland.Timekeeper) -> None:
        if timekeeper.sim_time_ns == 10 * timekeeper.step_size_ns:
            self._act()

    def _act(self) -> None:
        self.count += 1
        name = f"{self.model.name}_{self.count}"
        y = 2 * self.count - 3 + (self.model.name == "second")
        self.world.spawn_model("ball.model.yaml", name, pose=(-2, y, 0))
        self.world.command("/cmd_vel").set(Twist(linear_x=0.1 * self.count))


def test_changes_made_by_plugins_are_repeated_by_the_plugins(
    world_files: Any, path: Path, declare_plugins: Any
) -> None:
    declare_plugins(Helper)
    plugins = "plugins: [{type: 'test::Helper', name: helper}]\n"
    world_files.write("helper.model.yaml", BALL + plugins)
    world = world_files.load(WORLD + "  - {name: first, model: helper.model.yaml, pose: [2, 2, 0]}")
    world.record(path)
    world.step(30)
    world.spawn_model("helper.model.yaml", "second", pose=(2, -2, 0))
    world.step(30)
    names = [model.name for model in world.models]
    world.close()
    assert names == ["robot", "ball", "first_1", "first", "first_2", "second_1", "second"]
    records = read_recording(path).records[1:]
    assert [record["kind"] for record in records] == ["spawn_model", "result", "end"]
    assert replay(path).difference is None


class FileReader(ModelPlugin):
    """Reads a file of its own next to the model file."""

    def on_initialize(self, config: Any) -> None:
        path = config.resolve_path(config.get("file", "string"))
        self.speed = self.read_yaml(path).get("speed", "float")

    def state(self) -> object:
        return self.speed


def test_a_file_that_a_plugin_reads_is_part_of_recordings_and_resets(
    world_files: Any, path: Path, declare_plugins: Any
) -> None:
    declare_plugins(FileReader)
    plugins = "plugins: [{type: 'test::FileReader', name: reader, file: speed.yaml}]\n"
    world_files.write("reader.model.yaml", BALL + plugins)
    own = Path(world_files.write("speed.yaml", 'speed: $eval param("speed", 1)'))
    world = world_files.load(
        WORLD + "  - {name: reader, model: reader.model.yaml}", params={"speed": 3}
    )
    world.record(path)
    own.write_text("speed: 2")
    before = world.state_hash()
    world.reset()
    assert world.state_hash() == before
    world.close()
    with pytest.raises(RecordingError, match=r'files have changed .*speed\.yaml"$'):
        Replay(path)
    own.write_text('speed: $eval param("speed", 1)')
    assert replay(path).difference is None


@pytest.mark.parametrize(
    "change",
    [
        lambda world: world.step(),
        lambda world: world.move_model("ball", (1, 1, 0)),
        lambda world: world.command("/cmd_vel").set(Twist(1.0)),
    ],
)
def test_a_recording_starts_before_the_first_change(
    world_files: Any, path: Path, change: Callable[[World], object]
) -> None:
    world = world_files.load(WORLD)
    change(world)
    with pytest.raises(WorldError, match="must start before the first step, command and request"):
        world.record(path)
    assert not path.exists()


def test_a_world_without_a_file_cannot_be_recorded(path: Path) -> None:
    with World(seed=1) as world, pytest.raises(WorldError, match="loaded from a file"):
        world.record(path)


def test_a_recorder_can_be_closed_before_the_world(world_files: Any, path: Path) -> None:
    world = world_files.load(WORLD)
    recorder = world.record(path)
    world.step(3)
    recorder.close()
    size = path.stat().st_size
    world.step(300)
    world.command("/cmd_vel").set(Twist(1.0))
    world.move_model("ball", (1, 1, 0))
    assert path.stat().st_size == size
    assert not recorder.is_open
    world.close()
    result = replay(path)
    assert (result.difference, result.last_step) == (None, 3)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
def test_a_full_disk_at_the_start_is_an_error(world_files: Any) -> None:
    world = world_files.load(WORLD)
    with pytest.raises(RecordingError, match="No space left"):
        world.record("/dev/full")
    world.step()


def test_a_full_disk_during_the_run_ends_the_recording_only(
    world_files: Any, path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    world = world_files.load(WORLD)
    recorder = world.record(path)
    full = os.open("/dev/full", os.O_WRONLY)
    os.dup2(full, recorder._writer._file)
    os.close(full)
    caplog.clear()
    with caplog.at_level(logging.ERROR, logger="flatland"):
        world.step(450)
    assert caplog.messages == [
        f'Flatland recording: cannot write "{path}": '
        "No space left on device; the recording ends at step 200"
    ]
    assert not recorder.is_open
    world.move_model("ball", (1, 1, 0))
    world.command("/cmd_vel").set(Twist(1.0))


def test_resets_and_snapshots_are_repeated(world_files: Any, path: Path) -> None:
    world = world_files.load(WORLD)
    recorder = world.record(path)
    drive(world)
    world.reset()
    drive(world)
    snapshot = world.snapshot()
    world.step(50)
    world.reset(seed=5, keep_time=True)
    world.command("/cmd_vel").set(Twist(linear_x=0.7))
    world.step(300)
    for steps in (290, 30):
        world.restore(snapshot)
        world.step(steps)
    recorder.close()
    result = Replay(path)
    assert result.run() is None
    assert result.step == 550 + 550 + 50 + 300 + 290 + 30
    assert result.world.state_hash() == world.state_hash()
    result.close()


def test_a_hook_that_requests_a_reset_repeats_it(
    world_files: Any, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def after_physics_step(self: ModelPlugin, timekeeper: flatland.Timekeeper) -> None:
        if timekeeper.sim_time_ns == 500_000_000:
            self.world.reset()

    monkeypatch.setattr(DiffDrive, "after_physics_step", after_physics_step)
    world = world_files.load(WORLD)
    recorder = world.record(path)
    world.command("/cmd_vel").set(Twist(linear_x=0.7))
    world.step(150)
    recorder.close()
    assert world.time == pytest.approx(0.25)
    kinds = [record.get("kind") for record in read_recording(path).records]
    assert "reset" not in kinds
    result = Replay(path)
    assert result.run() is None
    assert result.world.time == pytest.approx(0.25)
    result.close()


def test_a_snapshot_from_before_the_recording_cannot_be_restored_in_a_replay(
    world_files: Any, path: Path
) -> None:
    world = world_files.load(WORLD)
    world.step(3)
    snapshot = world.snapshot()
    world.reset()
    recorder = world.record(path)
    world.step(10)
    world.restore(snapshot)
    world.step(10)
    recorder.close()
    text = "the snapshot was taken before the recording started"
    assert replay(path).difference == Difference(10, text)


def test_a_replay_that_fails_at_its_start_leaves_no_world(
    run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    worlds: list[World] = []

    def fail(world: World) -> str:
        worlds.append(world)
        raise WorldError("no hash")

    monkeypatch.setattr(World, "state_hash", fail)
    with pytest.raises(WorldError, match="no hash"):
        Replay(run)
    assert [world.closed for world in worlds] == [True]
