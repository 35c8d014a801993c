"""`flatland replay`, and recordings of `flatland run`."""

from __future__ import annotations

import re
import signal
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from flatland_command import main
from programs import Program
from waiting import wait_until

from flatland.recording import Replay, log_file

DRIVE = ("--command", "/cmd_vel={linear: {x: 0.5}}")


@pytest.fixture
def recording(robot_world: str, capsys: pytest.CaptureFixture[str]) -> Path:
    """A recording of a run of 0.5 s."""
    arguments = (
        "run",
        robot_world,
        "--duration",
        "0.5",
        "--seed",
        "1",
        "--record",
        "run.flog",
        *DRIVE,
    )
    assert main(*arguments) == 0
    assert capsys.readouterr().out.endswith("\nwrote run.flog\n")
    return Path("run.flog")


def test_a_difference_is_printed(recording, capsys):
    records = log_file.read_recording(recording).records
    writer = log_file.LogWriter(recording)
    for record in records:
        if record.get("kind") == "command":
            record = {**record, "step": 99}
        writer.write(record)
    writer.close()
    assert main("replay", recording) == 1
    assert capsys.readouterr().out == (
        "run.flog: the first difference is at step 1 (0.005 s): "
        "poses or velocities of bodies differ\n"
    )


def test_a_changed_file_is_an_error(files, recording, capsys):
    with (files.folder / "robot.model.yaml").open("a") as model:
        model.write("# changed\n")
    assert main("replay", recording) == 1
    assert "files have changed since the recording" in capsys.readouterr().err
    assert main("replay", recording, "--ignore-changes") == 0


def test_a_missing_recording_is_an_error(tmp_path, capsys):
    assert main("replay", tmp_path / "missing.flog") == 1
    assert "No such file" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((), "a folder of results requires --view"),
        (("--view", "--bag", "a.bag"), "a folder of results requires --view, without --bag"),
        (("--view",), "contains no report.html of `flatland test`"),
    ],
)
def test_a_folder_must_contain_a_report(options, message, tmp_path, capsys):
    with pytest.raises(SystemExit, match="2"):
        main("replay", tmp_path, *options)
    assert message in capsys.readouterr().err


def test_the_bag_of_a_replay_is_that_of_the_run(robot_world):
    rosbag = pytest.importorskip("rosbag")
    arguments = ("run", robot_world, "--duration", "0.5", "--seed", "1", *DRIVE)
    assert main(*arguments, "--record", "run.flog", "--bag", "run.bag") == 0
    assert main("replay", "run.flog", "--bag", "replay.bag") == 0
    bags = []
    for name in ("run.bag", "replay.bag"):
        with rosbag.Bag(name) as bag:
            bags.append([(topic, str(message), time) for topic, message, time in bag])
    assert bags[0] == bags[1]
    assert len(bags[0]) > 40


def test_a_run_that_was_killed_is_repeated(robot_world, capsys):
    command = [sys.executable, "-m", "flatland", "run", robot_world, "--duration", "1e9"]
    program = Program([*command, "--record", "run.flog", *DRIVE])
    recording = Path("run.flog")
    wait_until(
        "two simulated seconds",
        lambda: recording.exists() and recording.read_bytes().count(b'"state","state"') > 2,
    )
    program.kill()
    assert main("replay", recording) == 1
    first, second = capsys.readouterr().out.splitlines()
    assert re.fullmatch(r"run\.flog: \d+ steps \(\d+ s\), no difference", first)
    assert second.startswith("the recording is incomplete, and nothing after these steps was")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_replay(recording, monkeypatch, capsys, number):
    run = Replay.run

    def run_into_signal(replay: Replay, on_step: Callable[[int], None]) -> object:
        def step(number_of_steps: int) -> None:
            if number_of_steps == 5:
                signal.raise_signal(number)
            on_step(number_of_steps)

        return run(replay, step)

    monkeypatch.setattr(Replay, "run", run_into_signal)
    assert main("replay", recording) == 128 + number
    assert re.match(r"interrupted after \d+ steps \(0\.02\d* s\)", capsys.readouterr().out)


def test_an_mcap_file_contains_the_messages_of_the_bag(robot_world):
    rosbag = pytest.importorskip("rosbag")
    reader = pytest.importorskip("mcap_ros1.reader")
    files = ("--bag", "run.bag", "--mcap", "run.mcap")
    assert main("run", robot_world, "--duration", "0.5", "--seed", "1", *DRIVE, *files) == 0
    with rosbag.Bag("run.bag") as bag:
        expected = [(topic, str(message), max(0, time.to_nsec())) for topic, message, time in bag]
    messages = [
        (message.topic, str(message.ros_msg), max(1, message.log_time_ns))
        for message in reader.read_ros1_messages("run.mcap")
    ]
    assert sorted(messages) == sorted(expected)
    assert len({topic for topic, _, _ in messages}) == 5
