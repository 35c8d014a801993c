"""`flatland run`."""

from __future__ import annotations

import fcntl
import os
import pty
import re
import signal
import struct
import subprocess
import sys
import termios
import threading
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from flatland_command import main
from full_disk import REASON, limited_files
from programs import Program
from waiting import TIMEOUT, wait_until

import flatland
from flatland.drawing import FrameRenderer


class Failing(flatland.ModelPlugin):
    """Raises in the step from 0.5 s on."""

    def before_physics_step(self, timekeeper):
        if timekeeper.sim_time >= 0.5:
            raise ValueError("out of fuel")


class NoTextError(Exception):
    def __str__(self):
        raise RuntimeError


class Unprintable(flatland.ModelPlugin):
    """Raises an exception without a text in the first step."""

    def before_physics_step(self, timekeeper):
        raise NoTextError


def read_bag(path: Path | str) -> dict[str, list[tuple[float, Any]]]:
    """Returns the messages of each topic with their times [s]."""
    rosbag = pytest.importorskip("rosbag")
    messages: dict[str, list[tuple[float, Any]]] = {}
    with rosbag.Bag(str(path)) as bag:
        for topic, message, time in bag.read_messages():
            messages.setdefault(topic, []).append((time.to_sec(), message))
    return messages


class TestSimulation:
    def test_prints_what_was_simulated(self, robot_world, capsys):
        assert main("run", robot_world, "--duration", "2.5", "--seed", "7") == 0
        captured = capsys.readouterr()
        assert re.fullmatch(
            r"simulated 2\.5 s in \S+ s \(\S+ times real time\), seed 7\n", captured.out
        )
        assert captured.err == ""

    def test_the_last_step_reaches_the_duration(self, robot_world, capsys):
        step = ["--step-size", "0.02"]
        assert main("run", robot_world, "--duration", "0.05", *step) == 0
        assert capsys.readouterr().out.startswith("simulated 0.06 s in ")

    def test_a_progress_bar_shows_the_real_time_factor_and_no_ros_is_imported(
        self, robot_world, tmp_path
    ):
        blocked = tmp_path / "blocked"
        blocked.mkdir()
        for module in ("rospy", "genpy", "rosgraph", "std_msgs", "rosbag"):
            (blocked / f"{module}.py").write_text(f"raise RuntimeError('{module} was imported')")
        paths = [str(blocked), str(Path(flatland.__file__).parents[1])]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
        controller, terminal = pty.openpty()
        fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 100, 0, 0))
        command = [sys.executable, "-m", "flatland", "run", robot_world, "--duration", "3"]
        process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=terminal, env=environment
        )
        limit = threading.Timer(TIMEOUT, process.kill)
        limit.start()
        try:
            os.close(terminal)
            text = b""
            while True:
                try:
                    part = os.read(controller, 4096)
                except OSError:  # the terminal was closed by the process
                    break
                text += part
            assert process.wait(TIMEOUT) == 0, text.decode()
        finally:
            limit.cancel()
            os.close(controller)
        assert re.search(r"100%.*3\.0/3\.0 s.*\d+\.\dx real time", text.decode())

    def test_an_exception_of_a_plugin_is_an_error_with_its_time(
        self, robot_world, files, declare_plugins, capsys
    ):
        declare_plugins(Failing)
        with (files.folder / "robot.model.yaml").open("a") as model:
            model.write("- {type: 'test::Failing', name: failing}\n")
        (files.folder / "old.bag").write_text("old")
        arguments = ["--bag", "old.bag", "--video", "new.mp4", "--size", "64x64", "--no-axes"]
        before = set(files.folder.iterdir())
        assert main("run", robot_world, "--duration", "9", *arguments) == 1
        error = capsys.readouterr().err
        assert error.startswith("flatland: stopped at 0.505 s: ValueError: out of fuel")
        assert (files.folder / "old.bag").read_text() == "old"
        assert set(files.folder.iterdir()) - before <= {files.folder / "__pycache__"}

    def test_an_exception_of_a_plugin_without_a_text_is_an_error(
        self, robot_world, files, declare_plugins, capsys, caplog
    ):
        declare_plugins(Unprintable)
        with (files.folder / "robot.model.yaml").open("a") as model:
            model.write("- {type: 'test::Unprintable', name: failing}\n")
        text = "NoTextError: <NoTextError whose text raises RuntimeError>"
        arguments = ["--duration", "9", "--record", "a.flog"]
        assert main("run", robot_world, *arguments) == 1
        assert f"stopped at 0.005 s: {text}" in capsys.readouterr().err


class TestCommands:
    @pytest.mark.parametrize("twist", ["{linear: {x: 0.5}}", "{linear_x: 0.5}"])
    def test_a_command_drives_the_robot(self, robot_world, twist):
        arguments = ["--bag", "a.bag", "--command", f"/cmd_vel={twist}"]
        assert main("run", robot_world, "--duration", "2", *arguments) == 0
        _, odometry = read_bag("a.bag")["/odometry/ground_truth"][-1]
        assert odometry.pose.pose.position.x == pytest.approx(3 + 0.5 * 1.95, abs=0.03)

    @pytest.mark.parametrize(
        ("command", "message"),
        [
            ("/cmd_val={linear_x: 1}", 'command "/cmd_val" does not exist'),
            ("/cmd_vel={linear: {q: 1}}", "linear_x, linear_y, angular_z, got linear_q"),
            ("/cmd_vel={linear_x: fast}", "got {'linear_x': 'fast'}"),
            ("/cmd_vel=1", "takes Twist, got 1"),
        ],
    )
    def test_an_invalid_command_is_an_error(self, robot_world, capsys, command, message):
        assert main("run", robot_world, "--duration", "1", "--command", command) == 1
        assert message in capsys.readouterr().err


class TestBag:
    def test_contains_the_values_of_a_simulation(self, robot_world, tmp_path, capsys):
        arguments = ["--seed", "3", "--bag", "a.bag"]
        assert main("run", robot_world, "--duration", "1", *arguments) == 0
        messages = read_bag("a.bag")
        assert sorted(messages) == [
            "/odometry/filtered", "/odometry/ground_truth", "/scan", "/tf", "/twist"
        ]  # fmt: skip
        count = sum(map(len, messages.values()))
        assert f"wrote a.bag: {count} messages, 5 topics\n" in capsys.readouterr().out
        scans: list[flatland.LaserScan] = []
        with flatland.World.from_yaml(robot_world, seed=3) as world:
            world.output("/scan").subscribe(scans.append)
            world.step(200)
        assert len(scans) == len(messages["/scan"]) == 10
        for i, (scan, (time, message)) in enumerate(zip(scans, messages["/scan"], strict=True)):
            assert message.header.stamp.to_nsec() == scan.stamp
            assert message.header.seq == i
            assert time == pytest.approx(scan.stamp * 1e-9, abs=2e-9)
            np.testing.assert_array_equal(np.array(message.ranges, np.float32), scan.ranges)
        _, transforms = messages["/tf"][3]
        assert {t.child_frame_id for t in transforms.transforms} >= {"base"}

    def test_transforms_have_the_time_of_their_stamps(self, robot_world):
        assert main("run", robot_world, "--duration", "1", "--bag", "a.bag") == 0
        for time, message in read_bag("a.bag")["/tf"]:
            newest = max(t.header.stamp.to_sec() for t in message.transforms)
            assert time == pytest.approx(newest, abs=2e-9)

    @pytest.mark.parametrize("name", ["no/a.bag", "no/a.mp4"])
    def test_a_folder_that_does_not_exist(self, robot_world, capsys, name):
        option = "--bag" if name.endswith("bag") else "--video"
        assert main("run", robot_world, "--duration", "1", option, name) == 1
        assert f"cannot write {name}: there is no folder no\n" in capsys.readouterr().err

    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            (["--duration", "1", "--bag", "a.txt"], "must end with .bag"),
            (["--duration", "1", "--video", "a.gif"], "must end with .mp4"),
            (["--duration", "0"], "must be a number above 0"),
            (["--duration", "inf"], "must be a number above 0"),
            ([], "--duration"),
            (["--duration", "1", "--command", "/cmd_vel"], "must be TOPIC=YAML"),
            (["--duration", "1", "--video", "a.mp4", "--size", "20x20"], "too small for the axes"),
        ],
    )
    def test_invalid_arguments_exit_with_2(self, robot_world, tmp_path, capsys, arguments, message):
        with pytest.raises(SystemExit, match="2"):
            main("run", robot_world, *arguments)
        assert message in capsys.readouterr().err
        assert not [*tmp_path.glob("*.mp4"), *tmp_path.glob("*.bag")]


class TestInterruption:
    def test_files_contain_what_was_simulated(self, robot_world, tmp_path):
        command = [sys.executable, "-m", "flatland", "run", robot_world, "--duration", "1e6"]
        program = Program([*command, "--bag", "a.bag"])

        def size() -> int:
            return sum(path.stat().st_size for path in tmp_path.glob("a.*.part.bag"))

        wait_until("messages", lambda: size() > 100_000)
        program.send(signal.SIGTERM)
        assert program.wait() == 128 + signal.SIGTERM, program.output
        end = re.match(r"interrupted after (\S+) s in ", program.stdout)
        assert end
        messages = read_bag(tmp_path / "a.bag")
        assert messages["/tf"][-1][0] == pytest.approx(float(end[1]), abs=0.06)
        assert not list(tmp_path.glob("*.part.*"))


class TestFullDisk:
    def test_a_recording_that_is_cut_is_named(self, robot_world, tmp_path, capsys):
        with limited_files(4000):
            assert main("run", robot_world, "--duration", "9", "--record", "a.flog") == 1
        captured = capsys.readouterr()
        assert re.search(
            rf"^flatland: a\.flog is incomplete: {REASON}, at step \d+$", captured.err, re.MULTILINE
        )
        assert "wrote" not in captured.out
        # It is repeated as far as possible.
        assert main("replay", "a.flog") == 1
        first, second = capsys.readouterr().out.splitlines()
        assert re.fullmatch(r"a\.flog: [1-9]\d* steps \(\d+ s\), no difference", first)
        assert second.startswith("the recording is incomplete")
        assert (tmp_path / "a.flog").stat().st_size <= 4000

    @pytest.mark.parametrize(
        ("option", "name"), [("--bag", "a.bag"), ("--mcap", "a.mcap"), ("--video", "a.mp4")]
    )
    @pytest.mark.parametrize("size", [0, 5000])
    def test_other_files_are_removed_and_named(
        self, robot_world, tmp_path, capsys, option, name, size
    ):
        if option != "--video":
            pytest.importorskip("rosbag")
        Path(name).write_text("old")
        arguments = ["--size", "320x240", "--no-axes"]
        with limited_files(size):
            assert main("run", robot_world, "--duration", "2", option, name, *arguments) == 1
        captured = capsys.readouterr()
        assert f"{REASON}: '{name}'" in captured.err
        assert "wrote" not in captured.out
        assert (tmp_path / name).read_text() == "old"
        assert not list(tmp_path.glob("*.part.*"))


class TestVideo:
    def test_shows_the_simulation_in_a_codec_of_browsers(self, robot_world, capsys):
        arguments = ["--video", "a.mp4", "--fps", "10", "--size", "321x240", "--no-axes"]
        drive = ["--command", "/cmd_vel={linear_x: 1}"]
        assert main("run", robot_world, "--duration", "2", *arguments, *drive) == 0
        assert "wrote a.mp4: 20 frames\n" in capsys.readouterr().out
        video = cv2.VideoCapture("a.mp4")
        assert video.get(cv2.CAP_PROP_FPS) == 10
        # OpenCV 4.6 reads the code in the file, OpenCV 4.10 returns the name of the codec.
        codec = int(video.get(cv2.CAP_PROP_FOURCC)).to_bytes(4, "little")
        assert codec in {b"avc1", b"h264"}
        frames = []
        while (image := video.read())[0]:
            frames.append(image[1][:, :, ::-1].astype(int))
        video.release()
        assert len(frames) == 20
        assert frames[0].shape == (240, 320, 3)
        with flatland.World.from_yaml(robot_world, seed=1) as world:
            start = world.draw(size=(320, 240), axes=False).astype(int)
        # Compression changes pixels a little; the robot moves by more than 40 pixels.
        assert np.abs(frames[0] - start).mean() < 3
        assert np.abs(frames[-1] - start).mean() > np.abs(frames[0] - start).mean() + 1

    @pytest.mark.parametrize("codecs", [("zzzz", "mp4v"), ("zzzz",)])
    def test_an_opencv_without_the_encoder(self, robot_world, monkeypatch, caplog, capsys, codecs):
        """The codec zzzz does not exist; the next one is used, if there is one."""
        monkeypatch.setattr("flatland.drawing.video._CODECS", codecs)
        arguments = ["--video", "a.mp4", "--fps", "10", "--size", "320x240"]
        code = main("run", robot_world, "--duration", "0.5", *arguments)
        assert 'OpenCV has no encoder for the codec "zzzz"' in caplog.text
        if codecs[1:]:
            assert code == 0
            video = cv2.VideoCapture("a.mp4")
            assert video.get(cv2.CAP_PROP_FRAME_COUNT) == 5
            video.release()
        else:
            assert code == 1
            assert "with the codecs zzzz" in capsys.readouterr().err
            assert not list(Path().glob("*.mp4"))

    def test_a_frame_equals_a_picture_at_any_time(self, robot_world):
        with flatland.World.from_yaml(robot_world, seed=1) as world:
            renderer = FrameRenderer(world, size=(320, 240), scans=False, names=True)
            world.command("/cmd_vel").set(flatland.Twist(linear_x=1.0))
            for _ in range(3):
                world.step(50)
                picture = world.draw(size=(320, 240), scans=False, names=True)
                np.testing.assert_array_equal(renderer.picture(), picture)

    def test_walls_that_change_are_drawn_again(self, robot_world):
        with flatland.World.from_yaml(robot_world, seed=1) as world:
            renderer = FrameRenderer(world, size=(320, 240), scans=False)
            before = renderer.picture()
            layer = world.layer("walls")
            layer.add_edges(np.array([[2, 2, 8, 8]], np.float32))
            world.layer_changed(layer)
            assert (renderer.picture() != before).any()
