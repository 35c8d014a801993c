"""`flatland check`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from flatland_command import main

import flatland


class Tolerant(flatland.ModelPlugin):
    """Reads a value of several kinds."""

    def on_initialize(self, config):
        try:
            config.get("value", "float")
        except flatland.YamlError:
            config.get("value", "string")


class Strict(flatland.ModelPlugin):
    """Rejects its parameters."""

    def on_initialize(self, config):
        config.get("rate", "float", 1.0)
        raise config.error("rates and ranges exclude each other")


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

    def test_a_duplicate_key_is_a_warning(self, files: Any, capsys: Any) -> None:
        path = files.write("w.yaml", "properties: {}\nlayers: []\nlayers: [{name: 2d}]\n")
        assert main("check", path, "--strict") == 1
        capsys.readouterr()
        assert main("check", path) == 0
        captured = capsys.readouterr()
        assert captured.out.splitlines() == [
            f'{path}:3: warning: Duplicate key "layers" ignored, the value in line 2 is used',
            f"{path}: 1 warning",
        ]
        assert captured.err == ""

    def test_problems_are_printed_together_with_an_error(self, files: Any, capsys: Any) -> None:
        path = files.write("w.yaml", "properties: {}\nproperties: {}\nlayers: 7\n")
        assert main("check", path) == 1
        assert capsys.readouterr().out.splitlines() == [
            f'{path}:3: error: Entry "layers" must be a list',
            f'{path}:2: warning: Duplicate key "properties" ignored, the value in line 1 is used',
            f"{path}: 1 error, 1 warning",
        ]

    def test_unknown_keys_of_a_map_file_are_no_problem(self, files: Any, capsys: Any) -> None:
        map_path = files.write_map("room", ["...", ".#.", "..."], colour="blue", author="me")
        path = files.write("w.yaml", f"properties: {{}}\nlayers: [{{name: 2d, map: {map_path}}}]\n")
        assert main("check", path) == 0
        printed = capsys.readouterr().out
        assert "layer 2d: 4 edges; unknown keys in the map file: author, colour\n" in printed


class TestCheckModel:
    def test_a_model_without_layers_is_checked(self, files, capsys):
        assert main("check", files.folder / "minimal.model.yaml") == 0
        assert capsys.readouterr().out.splitlines()[-1] == (
            "checked in an empty world with the layers that the model names: none"
        )

    def test_param_and_relative_path(self, files, monkeypatch, capsys):
        files.write("robot.yaml", LAYERED)
        monkeypatch.chdir(files.folder)
        assert main("check", "robot.yaml") == 0
        capsys.readouterr()
        assert main("check", "robot.yaml", "--param", "/radius=-1") == 1
        assert capsys.readouterr().out.startswith('robot.yaml:6: error: Invalid "radius", must be ')


def with_plugin(plugin: str) -> str:
    """Returns the text of a model with one plugin."""
    return f"bodies: [{{name: base, footprints: []}}]\nplugins: [{plugin}]\n"


BROKEN_WORLD = """\
properties: {velocity_iterations: ten}
layers:
- {name: walls, map: rom.yaml}
- {name: [low, walls], colour: [1, 1, 1, 1]}
- {name: top, map: map.yaml}
models:
- {name: a, model: robot.model.yaml, pose: [1, 2]}
- {name: b, model: robot.model.yaml, pose: [9, 9, 0], namespace: b}
- {name: b, model: robot.model.yaml}
- {nmae: c, model: syntax.yaml}
- {name: d, model: minimal.model.yaml, namespace: 5-x, pose: [5, 5, 0]}
plugins:
- {type: RandomWal, name: boxes, layer: walls, robot_name: a}
- {type: RandomWall, name: more, layer: walls, robot_name: a, num_of_walls: x}
extra: 1
"""
BROKEN_MODEL = """\
bodies:
- name: base
  type: dinamic
  pose: [0, 0, 90deg]
  footprints:
  - {type: box, density: 1}
  - {type: circle, raduis: 0.5, density: 1}
  - {type: circle, radius: "0,5", density: -1, frction: 2}
  - {type: circle, radius: 1, density: $eval 1 +, layers: [wals]}
- {name: arm, footprints: []}
joints:
- {type: weld, name: j, bodies: [{name: base, anchor: [0, 0]}, {name: amr, anchor: [0]}]}
plugins:
- {type: Laser, name: eye, body: bass, range: 5m, angle: {min: 0, max: 6, increment: 1}, foo: 1}
- {type: Lasr, name: eye2, body: base}
- {type: DiffDrive, name: drive, body: base, pub_rate: -1, twst_sub: c}
- {type: Tween, name: t, body: base, duration: -1, delta: [0, 0, 0], mode: never}
"""
# File, line, and parts of the message and the hint of each error.
PROBLEMS = [
    ("world.yaml", 1, 'converting entry "velocity_iterations" to int', ""),
    ("world.yaml", 3, "File does not exist", "room.yaml"),
    ("world.yaml", 4, '{"colour"}', "color"),
    ("world.yaml", 4, 'Layer with name "walls" already exists', ""),
    ("map.yaml", 1, "Failed to load", ""),
    ("map.yaml", 1, 'Invalid "resolution", must be positive', ""),
    ("map.yaml", 1, 'Entry "origin" does not exist', "[x, y, theta]"),
    ("world.yaml", 7, 'Entry "pose" must have size of exactly 3', "[x, y, theta]"),
    ("robot.model.yaml", 9, 'Failed to evaluate "1 +"', ""),
    ("robot.model.yaml", 4, "converting entry index=2 to float", "math.rad(90)"),
    ("robot.model.yaml", 2, 'Invalid "type"', "dynamic"),
    ("robot.model.yaml", 6, 'Invalid footprint "type"', "polygon"),
    ("robot.model.yaml", 7, 'Entry "radius" does not exist', '"raduis" in line 7'),
    ("robot.model.yaml", 8, 'Invalid "density"', ""),
    ("robot.model.yaml", 8, 'converting entry "radius" to float', "0.5"),
    ("robot.model.yaml", 8, '{"frction"}', "friction"),
    ("robot.model.yaml", 9, "{wals} layer(s) does not exist", "walls"),
    ("robot.model.yaml", 12, 'Cannot find body with name "amr"', "arm"),
    ("robot.model.yaml", 12, 'Entry "anchor" must have size of exactly 2', "[x, y]"),
    ("robot.model.yaml", 15, 'no plugin "flatland_plugins::Lasr"', "enabled: false"),
    ("robot.model.yaml", 14, 'Body with name "bass" does not exist', "base"),
    ("robot.model.yaml", 14, 'converting entry "range" to float', "without a unit: 5"),
    ("robot.model.yaml", 14, '{"foo"}', "update_rate"),
    ("robot.model.yaml", 16, 'Invalid "pub_rate"', ""),
    ("robot.model.yaml", 16, '{"twst_sub"}', "twist_sub"),
    ("robot.model.yaml", 17, 'Invalid "duration"', ""),
    ("robot.model.yaml", 17, "Mode never does not exist", ""),
    ("world.yaml", 9, 'Model with name "b" already exists', ""),
    ("world.yaml", 10, 'Entry "name" does not exist', '"nmae" in line 10'),
    ("syntax.yaml", 2, "Malformatted file", "spaces, not with tabs"),
    ("world.yaml", 11, 'namespace "5-x" is not a legal ROS name', ""),
    ("world.yaml", 15, '{"extra"}', ""),
    ("world.yaml", 13, 'no plugin "flatland_plugins::RandomWal"', ""),
    ("world.yaml", 14, 'converting entry "num_of_walls" to int', ""),
]


@pytest.fixture
def broken(files: Any, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The path of a world with many errors, which stands in the current folder."""
    files.write("robot.model.yaml", BROKEN_MODEL)
    files.write("syntax.yaml", "bodies:\n\t- name: x\n")
    files.write("room.yaml", "{}")
    files.write("map.yaml", "{image: no.png, resolution: -1, occupied_thresh: 0.5}")
    monkeypatch.chdir(files.folder)
    return Path(files.write("world.yaml", BROKEN_WORLD))


class TestAllProblems:
    """`flatland check` continues after an error."""

    def report(self, path: Path | str, capsys: Any, *arguments: str) -> dict[str, Any]:
        assert main("check", path, "--json", *arguments) == 1
        report: dict[str, Any] = json.loads(capsys.readouterr().out)
        return report

    def test_each_error_is_reported_once_in_a_stable_order(self, broken, capsys):
        report = self.report(broken, capsys)
        found = [
            (Path(problem["file"]).name, problem["line"], problem["message"], problem["hint"])
            for problem in report["problems"]
            if problem["severity"] == "error"
        ]
        places = [(file, line) for file, line, _, _ in found]
        assert sorted(places) == sorted((file, line) for file, line, _, _ in PROBLEMS)
        rest = list(found)
        for file, line, message, hint in PROBLEMS:
            (match,) = [
                problem
                for problem in rest
                if problem[:2] == (file, line) and message in problem[2] and hint in problem[3]
            ]
            rest.remove(match)
        assert report["errors"] == len(PROBLEMS)
        assert self.report(broken, capsys) == report

    def test_the_error_of_a_normal_load_is_among_them(self, broken, capsys):
        """Repairs the world step by step; the first error of a load is always in the report."""
        repairs = [("ten", "10"), ("rom.yaml", "m.yaml"), (", colour: [1, 1, 1, 1]", "")]
        repairs += [("[low, walls]", "low"), (", map: map.yaml", ""), ("[1, 2]", "[1, 2, 0]")]
        for old, new in repairs:
            self.check_first_error(broken, capsys)
            text = broken.read_text()
            assert old in text
            broken.write_text(text.replace(old, new))
            (broken.parent / "m.yaml").write_text("{type: line_segments, data: d, scale: 1}")
            if "m.yaml" in new:
                self.check_first_error(broken, capsys)
                text = broken.read_text()
                broken.write_text(text.replace(", map: m.yaml", ""))
        self.check_first_error(broken, capsys)

    def check_first_error(self, path: Path, capsys: Any) -> None:
        with pytest.raises(flatland.FlatlandError) as caught:
            flatland.World.from_yaml(path, seed=0)
        first = caught.value
        text = first.message.removesuffix(first.place.suffix if first.place else "")
        problems = self.report(path, capsys)["problems"]
        # Several unknown keys of a map are one error of a load.
        assert text in [problem["message"] for problem in problems]

    def test_text_has_the_form_of_a_compiler(self, broken, capsys):
        assert main("check", "world.yaml") == 1
        captured = capsys.readouterr()
        assert captured.err == ""
        lines = captured.out.splitlines()
        entry = 'entry "velocity_iterations" to int (in "properties")'
        assert lines[0] == f"world.yaml:1: error: Error converting {entry}"
        start = f'error: Malformatted file, path="{broken.parent}/syntax.yaml", line 2 col 1, found'
        assert f"syntax.yaml:2:1: {start} character that cannot start any token" in lines
        assert lines[-1] == f"world.yaml: {len(PROBLEMS)} errors"

    def test_a_valid_world_has_an_empty_report(self, world_file, capsys):
        assert main("check", world_file, "--json") == 0
        report = json.loads(capsys.readouterr().out)
        counts = {"errors": 0, "warnings": 0, "problems": []}
        assert report == {"file": world_file, "kind": "world", **counts}

    def test_a_plugin_that_catches_errors_has_no_problem(self, files, declare_plugins, capsys):
        """A value may be of several kinds, which a plugin finds out by trying."""
        declare_plugins(Tolerant)
        plugin = "{type: 'test::Tolerant', name: t, value: text}"
        path = files.write("m.model.yaml", with_plugin(plugin))
        assert main("check", path) == 0
        assert capsys.readouterr().out.startswith(f"{path}: no errors")
        path = files.write("m.model.yaml", with_plugin(f"{plugin[:-1]}, unread: 1}}"))
        report = self.report(path, capsys)
        assert ['{"unread"}' in problem["message"] for problem in report["problems"]] == [True]

    def test_a_plugin_that_rejects_all_of_its_parameters(self, files, declare_plugins, capsys):
        """The error concerns no single value, so that the plugin is not started forever."""
        declare_plugins(Strict)
        plugin = "{type: 'test::Strict', name: s, rate: fast}"
        path = files.write("m.model.yaml", with_plugin(plugin))
        problems = self.report(path, capsys)["problems"]
        assert len(problems) == 2
        assert 'converting entry "rate"' in problems[0]["message"]
        assert problems[1]["message"].endswith("rates and ranges exclude each other")

    def test_a_missing_parameter_of_a_plugin_does_not_hide_the_others(self, files, capsys):
        laser = "{type: Laser, name: l, body: base, angle: {min: 0, max: 1, increment: x}, foo: 1}"
        path = files.write("m.model.yaml", with_plugin(laser))
        messages = [problem["message"] for problem in self.report(path, capsys)["problems"]]
        assert len(messages) == 3
        for part in ('"range" does not exist', '"increment" to float', '{"foo"}'):
            assert any(part in message for message in messages)

    def test_a_file_that_does_not_exist(self, files, capsys, monkeypatch):
        monkeypatch.chdir(files.folder)
        assert main("check", "minimal.modle.yaml") == 1
        assert capsys.readouterr().out.splitlines()[0].startswith("minimal.modle.yaml: error: ")
