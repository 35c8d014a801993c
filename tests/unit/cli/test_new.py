"""`flatland new`: everything that it creates runs."""

from __future__ import annotations

import re
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
from flatland_command import main
from programs import run_program

import flatland
from flatland import worldgen


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_robot(capsys):
    assert main("new", "robot", "rover_2") == 0
    assert capsys.readouterr().out.splitlines()[0] == "created rover_2.model.yaml"
    assert main("check", "rover_2.model.yaml") == 0
    with flatland.World(seed=1) as world:
        model = world.spawn_model("rover_2.model.yaml", "rover")
        assert model is not None
        scan = world.output("/scan")
        for _ in range(10):
            world.command("/cmd_vel").set(flatland.Twist(linear_x=0.5))
            world.step(40)
        assert model.pose[0] > 0.7
        assert len(scan.latest.ranges) > 100
        world.step(200)
        assert model.bodies[0].velocity[0] == 0.0  # without a command


def test_world(folder, capsys):
    assert main("new", "world", "arena") == 0
    assert sorted(path.name for path in Path("arena").iterdir()) == [
        "map.pgm", "map.yaml", "robot.model.yaml", "world.yaml"
    ]  # fmt: skip
    assert main("check", "arena/world.yaml") == 0, capsys.readouterr().out
    with flatland.World.from_yaml("arena/world.yaml", seed=1) as world:
        assert len(world.layer("walls").edges) > 8
        scan = world.output("/scan")
        world.step(10)
        assert 0.5 < scan.latest.ranges.min() < 2  # a wall is near
    assert Path("arena").stat().st_mode & 0o055  # not only for the owner
    assert [path.name for path in folder.iterdir()] == ["arena"]


def test_the_test_of_a_plugin_passes():
    assert main("new", "plugin", "speed_meter") == 0
    # Without bytecode, which Python reuses if a file changes within a second.
    done = run_program(
        [sys.executable, "-BW", "error", "-m", "unittest", "discover", "-s", "speed_meter/test"]
    )
    assert done.returncode == 0, done.stderr
    assert "Ran 1 test" in done.stderr
    # It fails if the plugin is broken.
    plugin = Path("speed_meter/src/speed_meter/plugin.py")
    text = plugin.read_text()
    assert "class SpeedMeter" in text
    plugin.write_text(text.replace("forward, left", "left, forward"))
    done = run_program(done.args)
    assert done.returncode == 1


def test_a_plugin_is_a_ros_package_with_a_manifest(monkeypatch, capsys):
    assert main("new", "plugin", "speedy") == 0
    package = ElementTree.parse("speedy/package.xml").getroot()
    assert package.findtext("name") == "speedy"
    export = package.find("export/flatland")
    assert export is not None
    manifest = export.attrib["plugin"].replace("${prefix}", "speedy")
    monkeypatch.setenv("FLATLAND_PLUGIN_PATH", str(Path(manifest).absolute()))
    assert main("check", "speedy/worlds/demo.yaml") == 0, capsys.readouterr().out


def test_random_world(folder, capsys):
    arguments = ("--size", "15x14", "--resolution", "0.1", "--radius", "0.2")
    assert main("new", "world", "lab", "--office", "--seed", "3", *arguments) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("created lab, seed 3\n")
    assert "flatland run lab/world.yaml" in printed
    assert main("check", "lab/world.yaml") == 0, capsys.readouterr().out
    generated = worldgen.generate("office", 3, (15, 14), resolution=0.1, radius=0.2)
    for name, data in generated.files("lab").items():
        assert (folder / "lab" / name).read_bytes() == data
    assert [path.name for path in folder.iterdir()] == ["lab"]


def test_the_seed_of_a_random_world_is_drawn_and_printed(capsys):
    assert main("new", "world", "one", "--maze", "--size", "8x8") == 0
    found = re.match(r"created one, seed (\d+)\n", capsys.readouterr().out)
    assert found is not None
    assert main("new", "world", "two", "--maze", "--size", "8x8", "--seed", found[1]) == 0
    assert Path("one/map.pgm").read_bytes() == Path("two/map.pgm").read_bytes()


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        ("world lab --office --size 5x5", 1, "at least 12 x 10 m, got 5 x 5 m"),
        ("world lab --maze --size big", 2, "must be WIDTHxHEIGHT in metres, as in 60x25"),
        ("world lab --maze --seed -1", 2, "must be an integer of at least 0, got '-1'"),
        ("world lab --maze --office", 2, "not allowed with argument --maze"),
        ("world lab --castle", 2, "--castle"),
        ("world lab --seed 1", 2, "--seed requires --office, --maze or --warehouse"),
        ("robot lab --maze", 2, "--maze is an option of `flatland new world`"),
        ("world 2d --maze", 1, "the name must start with a letter"),
    ],
)
def test_invalid_random_worlds_leave_nothing_behind(folder, capsys, arguments, code, message):
    try:
        result = main("new", *arguments.split())
    except SystemExit as error:  # of argparse
        result = error.code
    assert result == code
    assert message in capsys.readouterr().err
    assert not list(folder.iterdir())


def test_no_placeholder_is_left(folder):
    for kind in ("robot", "world", "plugin"):
        assert main("new", kind, f"my_{kind}") == 0
    files = [path for path in folder.rglob("*") if path.is_file()]
    assert len(files) == 14
    for path in files:
        assert "__name__" not in str(path)
        assert not path.name.endswith(".in")
        assert b"@name@" not in path.read_bytes().lower()


@pytest.mark.parametrize(
    "arguments", ["robot thing", "world thing", "world thing --maze", "plugin thing"]
)
def test_nothing_that_exists_is_changed(folder, capsys, arguments):
    name = "thing.model.yaml" if arguments.startswith("robot") else "thing"
    Path(name).write_text("mine")
    assert main("new", *arguments.split()) == 1
    assert f"{name} exists, choose another name" in capsys.readouterr().err
    assert Path(name).read_text() == "mine"
    assert [path.name for path in folder.iterdir()] == [name]


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("robot", "my robot"), ("robot", "../up"), ("world", ""), ("world", "2d"),
        ("plugin", "Upper"), ("plugin", "class"), ("plugin", "json"), ("plugin", "flatland"),
        ("plugin", "a-b"),
    ],
)  # fmt: skip
def test_an_invalid_name_is_an_error(folder, capsys, kind, name):
    assert main("new", kind, name) == 1
    assert "name" in capsys.readouterr().err
    assert not list(folder.iterdir())


def test_another_folder(folder, capsys):
    Path("worlds").mkdir()
    assert main("new", "world", "lab", "--folder", "worlds") == 0
    assert Path("worlds/lab/world.yaml").exists()
    assert main("new", "world", "lab", "--folder", "nowhere") == 1
    assert "the folder nowhere does not exist" in capsys.readouterr().err
