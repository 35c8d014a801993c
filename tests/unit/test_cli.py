"""The command `flatland`."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import cv2
import pytest
from waiting import TIMEOUT

import flatland
from flatland import cli

MODEL = """
bodies:
- name: base
  footprints:
  - type: circle
    radius: $eval param("/radius", 0.5)
    density: 1
- {name: arm, footprints: []}
joints: [{type: weld, name: j, bodies: [{name: base, anchor: [0, 0]}, {name: arm, anchor: [0, 0]}]}]
plugins:
- {type: Laser, name: eye, body: base, range: 9, angle: {min: 0, max: 6, increment: 0.01}}
- {type: Tween, name: tween, body: base, mode: once, duration: 1, delta: [3, 0, 0]}
"""


@pytest.fixture
def world_file(files: Any) -> str:
    """A room with a robot at (3, 5) that a tween moves to (6, 5) in one second."""
    files.write_map("room", ["##########", *["#........#"] * 8, "##########"])
    files.write("robot.model.yaml", MODEL)
    return files.write(
        "world.yaml",
        """
        properties: {}
        layers: [{name: [walls, 3d], map: room.yaml, color: [1, 0, 0, 1]}, {name: empty}]
        models: [{name: robot, model: robot.model.yaml, pose: [3, 5, 0]}]
        """,
    )


def run(*arguments: str | Path, **options: Any) -> subprocess.CompletedProcess[str]:
    """Runs the command in a new process."""
    command = [sys.executable, "-W", "error", "-m", "flatland", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT, **options)


def main(*arguments: str | Path) -> int:
    """Runs the command in this process and returns its exit code."""
    return cli.main([str(argument) for argument in arguments])


def drawn(world_file: str, *, steps: int = 0, **options: Any) -> Any:
    """Returns the expected picture of `flatland show`."""
    load = {key: options.pop(key) for key in ("params", "simplify_map") if key in options}
    with flatland.World.from_yaml(world_file, seed=1, **load) as world:
        world.step(steps)
        return world.draw(**options)


def is_picture(path: Path, expected: Any) -> bool:
    pixels = cv2.imread(str(path))[:, :, ::-1]
    return pixels.shape == expected.shape and bool((pixels == expected).all())


class TestShow:
    def test_draws_the_world(self, world_file, tmp_path):
        path = tmp_path / "picture.png"
        done = run("show", world_file, "-o", path, cwd=tmp_path.parent)
        assert (done.returncode, done.stdout) == (0, ""), done.stderr
        assert done.stderr == ""
        assert is_picture(path, drawn(world_file))

    @pytest.mark.parametrize(
        ("arguments", "options"),
        [
            (["--steps", "200"], {"steps": 200}),
            (["--size", "400x300"], {"size": (400, 300)}),
            (["--dpi", "50"], {"dpi": 50}),
            (["--view", "-1", "2", "5", "6"], {"view": (-1, 2, 5, 6)}),
            (["--layer", "empty"], {"layers": ["empty"]}),
            (["--layer", "empty", "--layer", "3d"], {"layers": ["3d"]}),
            (["--names"], {"names": True}),
            (["--no-scans"], {"scans": False}),
            (["--no-axes"], {"axes": False}),
            (["--param", "/radius=1.5"], {"params": {"/radius": 1.5}}),
        ],
    )
    def test_options(self, world_file, tmp_path, arguments, options):
        path = tmp_path / "picture.png"
        assert main("show", world_file, "-o", path, *arguments) == 0
        assert is_picture(path, drawn(world_file, **options))
        if arguments[-1] != "3d":
            assert not is_picture(path, drawn(world_file))

    def test_seed_makes_noise_repeatable(self, world_file, tmp_path):
        model = tmp_path / "robot.model.yaml"
        laser = "range: 9, always_publish: true, noise_std_dev: 0.05"
        model.write_text(model.read_text().replace("range: 9", laser))
        paths = [tmp_path / name for name in ("a.png", "b.png", "c.png")]
        for path, seed in zip(paths, "112", strict=True):
            assert main("show", world_file, "-o", path, "--steps", "3", "--seed", seed) == 0
        a, b, c = (path.read_bytes() for path in paths)
        assert a == b != c

    def test_an_existing_picture_is_overwritten(self, world_file, tmp_path):
        path = tmp_path / "picture.png"
        path.write_text("old")
        assert main("show", world_file, "-o", path) == 0
        assert is_picture(path, drawn(world_file))

    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            ([], "-o/--output"),
            (["-o", "a.gif"], "must end with one of .png, .pdf, .svg, got 'a.gif'"),
            (["-o", "a.png", "--size", "12"], "must be WIDTHxHEIGHT"),
            (["-o", "a.png", "--size", "20x20"], "too small for the axes"),
            (["-o", "a.png", "--steps", "-1"], "must be an integer of at least 0"),
            (["-o", "a.png", "--param", "radius"], "must be NAME=VALUE"),
            (["-o", "a.png", "--param", "/radius=[1"], "the value is not YAML"),
            (["-o", "a.png", "--view", "1", "0", "0", "1"], "x_min < x_max"),
            (["-o", "a.png", "--simplify-map", "3"], "invalid choice"),
        ],
    )
    def test_invalid_arguments_exit_with_2(
        self, world_file, capsys, monkeypatch, tmp_path, arguments, message
    ):
        monkeypatch.chdir(tmp_path)
        with pytest.raises(SystemExit) as caught:
            main("show", world_file, *arguments)
        assert caught.value.code == 2
        assert message in capsys.readouterr().err
        assert not (tmp_path / "a.png").exists()

    def test_invalid_files_exit_with_1_and_one_line_of_error(self, world_file, tmp_path):
        done = run("show", "nowhere.yaml", "-o", "a.png", cwd=tmp_path)
        assert done.returncode == 1
        path = tmp_path / "nowhere.yaml"
        assert done.stderr == f'flatland: Flatland YAML: File does not exist, path="{path}"\n'

    def test_a_picture_that_cannot_be_written_is_an_error(self, world_file, tmp_path, capsys):
        assert main("show", world_file, "-o", tmp_path / "no" / "a.png") == 1
        (line,) = capsys.readouterr().err.splitlines()
        assert line.startswith("flatland: ")
        assert "No such file or directory" in line

    def test_an_unknown_layer_is_an_error(self, world_file, tmp_path, capsys):
        assert main("show", world_file, "-o", tmp_path / "a.png", "--layer", "roof") == 1
        (line,) = capsys.readouterr().err.splitlines()
        assert line == 'flatland: Flatland World: layer with name "roof" does not exist'


class TestCheck:
    def test_prints_the_contents_of_the_world(self, world_file, capsys):
        assert main("check", world_file) == 0
        assert capsys.readouterr().out.splitlines() == [
            f"{world_file}: no errors",
            "layer walls, 3d: 8 edges",
            "layer empty: 0 edges",
            "model robot: 2 bodies, 1 joint; plugins: eye (Laser), tween (Tween)",
        ]

    def test_world_plugins(self, world_file, files, capsys):
        crates = "{type: RandomWall, name: boxes, layer: walls, robot_name: robot}"
        path = files.write("more.yaml", f"{Path(world_file).read_text()}plugins: [{crates}]")
        assert main("check", path) == 0
        assert "world; plugins: boxes (RandomWall)" in capsys.readouterr().out

    def test_simplify_map(self, files, capsys):
        """The boundary of a round column consists of pixel steps; simplified it has few edges."""
        rows = ["".join(".#"[x * x + y * y < 300] for x in range(-20, 20)) for y in range(-20, 20)]
        files.write_map("column", rows)
        path = files.write("world.yaml", "{properties: {}, layers: [{name: a, map: column.yaml}]}")
        counts = []
        for simplify in "01":
            assert main("check", path, "--simplify-map", simplify) == 0
            counts.append(int(capsys.readouterr().out.split()[-2]))
        assert counts[1] < counts[0] / 2

    def test_param(self, world_file, capsys):
        assert main("check", world_file, "--param", "/radius=-1") == 1
        assert main("check", world_file, "--param", "/radius=-1", "--param", "/radius=2") == 0

    def test_prints_the_error(self, files):
        path = files.write("world.yaml", "properties: {}\nlayers: [{name: a, colour: red}]\n")
        done = run("check", path)
        assert (done.returncode, done.stdout) == (1, "")
        (line,) = done.stderr.splitlines()
        assert line.startswith("flatland: Flatland YAML: ")
        assert '"colour"' in line


LAYERED = """
bodies:
- name: base
  footprints:
  - type: circle
    radius: $eval param("/radius", 0.5)
    density: 1
    layers: [low, high]
  - {type: circle, radius: 0.2, density: 1, layers: [all]}
plugins:
- {type: Laser, name: eye, body: base, range: 9, layers: [high, top],
   angle: {min: 0, max: 6, increment: 0.01}}
"""


class TestProblems:
    """Problems that `flatland check` prints for files that can be loaded."""

    def test_a_duplicate_key_is_a_problem(self, files: Any) -> None:
        path = files.write("w.yaml", "properties: {}\nlayers: []\nlayers: [{name: 2d}]\n")
        done = run("check", path)
        assert done.returncode == 1
        assert done.stdout.splitlines()[:2] == [
            f"{path}: 1 problem",
            f'problem: Duplicate key "layers" ignored, the value in line 2 is used [{path}:3]',
        ]
        assert done.stderr == ""

    def test_problems_are_printed_together_with_an_error(self, files: Any) -> None:
        path = files.write("w.yaml", "properties: {}\nproperties: {}\nlayers: 7\n")
        done = run("check", path)
        assert done.returncode == 1
        assert done.stdout == ""
        duplicate, error = done.stderr.splitlines()
        assert duplicate.startswith('problem: Duplicate key "properties"')
        assert error.startswith("flatland: Flatland YAML: ")

    def test_unknown_keys_of_a_map_file_are_listed_and_no_problem(self, files: Any) -> None:
        map_path = files.write_map("room", ["...", ".#.", "..."], colour="blue", author="me")
        path = files.write("w.yaml", f"properties: {{}}\nlayers: [{{name: 2d, map: {map_path}}}]\n")
        done = run("check", path)
        assert done.returncode == 0
        assert "layer 2d: 4 edges; unknown keys in the map file: author, colour\n" in done.stdout


class TestCheckModel:
    def test_accepts_any_layer(self, files, capsys):
        path = files.write("my.robot.model.yaml", LAYERED)
        assert main("check", path) == 0
        assert capsys.readouterr().out.splitlines() == [
            f"{path}: no errors",
            "model my: 1 body, 0 joints; plugins: eye (Laser)",
            "checked in an empty world with the layers that the model names: low, high, top",
        ]

    def test_a_model_without_layers_is_checked(self, files, capsys):
        assert main("check", files.folder / "minimal.model.yaml") == 0
        assert capsys.readouterr().out.splitlines()[-1] == (
            "checked in an empty world with the layers that the model names: none"
        )

    def test_param_and_relative_path(self, files):
        files.write("robot.yaml", LAYERED)
        assert run("check", "robot.yaml", cwd=files.folder).returncode == 0
        done = run("check", "robot.yaml", "--param", "/radius=-1", cwd=files.folder)
        assert done.returncode == 1
        assert 'Invalid "radius"' in done.stderr
        assert f"[{files.folder}/robot.yaml:6]" in done.stderr

    @pytest.mark.parametrize(
        ("old", "new", "message"),
        [
            ("bodies:", "colour: red\nbodies:", '"colour"'),
            ("[all]", "[all, low]", '{all} layer(s) does not exist'),
            ("body: base", "body: bass", 'Body with name "bass" does not exist'),
            ("Laser", "Lasser", 'type "Lasser" model "my": no plugin'),
        ],
    )  # fmt: skip
    def test_prints_the_error(self, files, capsys, old, new, message):
        path = files.write("my.model.yaml", LAYERED.replace(old, new))
        assert main("check", path) == 1
        captured = capsys.readouterr()
        assert captured.out == ""
        (line,) = captured.err.splitlines()
        assert message in line
        assert f"[{path}:" in line

    def test_accepts_16_layers(self, files, capsys):
        names = [f"l{i}" for i in range(15)]
        text = LAYERED.replace("[low, high]", f"[{', '.join(names)}]")
        assert main("check", files.write("m.yaml", text.replace("high, top", "l3, top"))) == 0
        path = files.write("m.yaml", text)
        assert main("check", path) == 1
        error = capsys.readouterr().err
        assert "Model refers to 17 layers {l0, l1, " in error
        assert f"max allowed in a world is 16 [{path}]" in error

    def test_warnings_of_a_file_are_reported_once(self, files):
        path = files.write("m.yaml", f"{LAYERED}---\nsecond: document\n")
        done = run("check", path)
        assert (done.returncode, done.stdout.count("YAML documents")) == (1, 1)

    @pytest.mark.parametrize("key", ["layers", "properties"])
    def test_a_world_file_with_bodies_is_a_world(self, files, capsys, key):
        path = files.write("w.yaml", f"{key}: []\nbodies: []\n")
        assert main("check", path) == 1
        assert "empty world" not in capsys.readouterr().out


class TestBrokenPipe:
    @pytest.mark.parametrize(
        "arguments",
        [["check", "world.yaml"], ["check", "minimal.model.yaml"], ["--version"], ["--help"],
         ["show", "--help"]],
    )  # fmt: skip
    def test_output_without_a_reader(self, world_file, tmp_path, arguments):
        done = run_into_broken_pipe(arguments, tmp_path, stderr=subprocess.PIPE)
        assert (done.returncode, done.stderr) == (141, b"")

    @pytest.mark.parametrize("command", ["check", "show"])
    def test_errors_without_a_reader(self, tmp_path, command):
        options = ["-o", "a.png"] if command == "show" else []
        arguments = [command, "nowhere.yaml", *options]
        done = run_into_broken_pipe(arguments, tmp_path, stderr=subprocess.STDOUT)
        assert done.returncode == 141

    def test_in_a_shell(self, world_file):
        command = f'"{sys.executable}" -m flatland check "{world_file}" | head -1; ' + (
            'echo "${PIPESTATUS[1]}"'
        )
        done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=60)
        assert done.stdout.splitlines() == [f"{world_file}: no errors", "0"]
        assert done.stderr == ""


def run_into_broken_pipe(arguments, folder, **options):
    """Runs the command with an output pipe whose reading end is closed."""
    reading, writing = os.pipe()
    os.close(reading)
    try:
        command = [sys.executable, "-m", "flatland", *arguments]
        return subprocess.run(
            command, stdout=writing, cwd=folder, timeout=60, check=False, **options
        )
    finally:
        os.close(writing)


def test_version_equals_that_of_the_packages(checkout):
    project = tomllib.loads((checkout / "pyproject.toml").read_text())["project"]
    package = ElementTree.parse(checkout / "catkin" / "flatland" / "package.xml").getroot()
    assert flatland.__version__ == project["version"] == package.findtext("version")
    assert project["scripts"]["flatland"] == "flatland.cli:main"
    done = run("--version")
    assert (done.returncode, done.stdout) == (0, f"flatland {flatland.__version__}\n")


def test_help_lists_the_commands(capsys):
    with pytest.raises(SystemExit) as caught:
        main()
    assert caught.value.code == 2
    with pytest.raises(SystemExit):
        main("--help")
    text = capsys.readouterr().out
    assert "show" in text
    assert "check" in text


def test_values_of_parameters_are_yaml():
    values = {"1": 1, "0.5": 0.5, "true": True, "a b": "a b", "": "", "a=b": "a=b"}
    for text, value in values.items():
        assert cli._parameter(f"/x={text}") == ("/x", value)
