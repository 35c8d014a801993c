"""`flatland new`: everything that it creates runs."""

from __future__ import annotations

import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import pytest
from flatland_command import main
from waiting import TIMEOUT

import flatland


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_robot(capsys: Any) -> None:
    assert main("new", "robot", "rover_2") == 0
    assert capsys.readouterr().out.splitlines()[0] == "created rover_2.model.yaml"
    assert main("check", "rover_2.model.yaml") == 0
    with flatland.World(seed=1) as world:
        model = world.spawn_model("rover_2.model.yaml", "rover")
        assert model is not None
        scan = world.output("/scan")
        world.command("/cmd_vel").set(flatland.Twist(linear_x=0.5))
        world.step(400)
        assert model.pose[0] > 0.7
        assert len(scan.latest.ranges) > 100


def test_world(folder: Path, capsys: Any) -> None:
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


def test_the_test_of_a_plugin_passes() -> None:
    assert main("new", "plugin", "speed_meter") == 0
    done = subprocess.run(
        # Without bytecode, which Python reuses if a file changes within a second.
        [sys.executable, "-BW", "error", "-m", "unittest", "discover", "-s", "speed_meter/test"],
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
    )
    assert done.returncode == 0, done.stderr
    assert "Ran 1 test" in done.stderr
    # It fails if the plugin is broken.
    plugin = Path("speed_meter/src/speed_meter/plugin.py")
    text = plugin.read_text()
    assert "class SpeedMeter" in text
    plugin.write_text(text.replace("forward, left", "left, forward"))
    done = subprocess.run(done.args, capture_output=True, text=True, timeout=TIMEOUT)
    assert done.returncode == 1


def test_a_plugin_is_a_ros_package_with_a_manifest(monkeypatch, capsys) -> None:
    assert main("new", "plugin", "speedy") == 0
    package = ElementTree.parse("speedy/package.xml").getroot()
    assert package.findtext("name") == "speedy"
    export = package.find("export/flatland")
    assert export is not None
    manifest = export.attrib["plugin"].replace("${prefix}", "speedy")
    monkeypatch.setenv("FLATLAND_PLUGIN_PATH", str(Path(manifest).absolute()))
    assert main("check", "speedy/worlds/demo.yaml") == 0, capsys.readouterr().out


def test_no_placeholder_is_left(folder: Path) -> None:
    for kind in ("robot", "world", "plugin"):
        assert main("new", kind, f"my_{kind}") == 0
    files = [path for path in folder.rglob("*") if path.is_file()]
    assert len(files) == 14
    for path in files:
        assert "__name__" not in str(path)
        assert not path.name.endswith(".in")
        if path.suffix != ".pgm":
            text = path.read_text().lower()
            assert "@name@" not in text


@pytest.mark.parametrize("kind", ["robot", "world", "plugin"])
def test_nothing_that_exists_is_changed(folder: Path, capsys: Any, kind: str) -> None:
    name = "thing.model.yaml" if kind == "robot" else "thing"
    Path(name).write_text("mine")
    assert main("new", kind, "thing") == 1
    assert "exists, choose another name" in capsys.readouterr().err
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
def test_an_invalid_name_is_an_error(folder: Path, capsys: Any, kind: str, name: str) -> None:
    assert main("new", kind, name) == 1
    assert "name" in capsys.readouterr().err
    assert not list(folder.iterdir())


def test_another_folder(folder: Path, capsys: Any) -> None:
    Path("worlds").mkdir()
    assert main("new", "world", "lab", "--folder", "worlds") == 0
    assert Path("worlds/lab/world.yaml").exists()
    assert main("new", "world", "lab", "--folder", "nowhere") == 1
    assert "the folder nowhere does not exist" in capsys.readouterr().err
