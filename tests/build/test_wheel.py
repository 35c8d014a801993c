"""The wheel holds the package, its extension, the messages and the ROS package's data."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tomllib
import xml.etree.ElementTree as ElementTree
import zipfile
from pathlib import Path

import pytest

pytestmark = pytest.mark.timeout(600)


def source_files(checkout: Path) -> list[str]:
    """What a clone of the checkout holds, and what is new in it and not ignored."""
    listed = subprocess.run(
        ["git", "-C", checkout, "ls-files", "-z", "-co", "--exclude-standard"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    return sorted(name for name in set(listed.split("\0")) - {""} if (checkout / name).exists())


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory, checkout: Path) -> zipfile.ZipFile:
    """A wheel built in a path with a space, from sources with leavings of `make dev`."""
    pytest.importorskip("scikit_build_core")
    folder = tmp_path_factory.mktemp("wheel") / "source tree"
    for name in source_files(checkout):
        target = folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(checkout / name, target, follow_symlinks=False)
    for leaving in ("_core.cpython-30-none.so", "msg/_Stale.py", "__pycache__/x.cpython-30.pyc"):
        path = folder / "flatland" / leaving
        path.parent.mkdir(exist_ok=True)
        path.write_text("stale")
    built = subprocess.run(
        [
            sys.executable,
            "-m",
            "pip",
            "wheel",
            "--no-deps",
            "--no-build-isolation",
            "-w",
            "..",
            ".",
        ],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert built.returncode == 0, built.stdout
    (path,) = folder.parent.glob("flatland_sim-*.whl")
    with zipfile.ZipFile(path) as archive:
        yield archive


def test_package_files(wheel, checkout):
    names = set(wheel.namelist())
    sources = {name for name in source_files(checkout) if name.startswith("flatland/")}
    assert "flatland/py.typed" in sources
    assert "flatland/_core.pyi" in sources
    assert sources <= names
    assert len([name for name in names if name.startswith("flatland/_core.cpython-311")]) == 1
    assert "flatland/srv/_SpawnModel.py" in names
    assert "flatland/msg/_Collisions.py" in names
    assert not [name for name in names if "Stale" in name or "-30" in name]


def test_ros_package_data(wheel, checkout):
    prefix = next(n for n in wheel.namelist() if n.endswith("data/share/flatland/package.xml"))[
        :-11
    ]
    names = {name.removeprefix(prefix) for name in wheel.namelist() if name.startswith(prefix)}
    expected = {
        name
        for name in source_files(checkout)
        if name.split("/")[0] in ("launch", "msg", "srv", "rviz", "worlds") and name[-3:] != ".py"
    }
    assert expected | {"flatland_plugins.xml"} <= names
    assert b"<class " in wheel.read(f"{prefix}flatland_plugins.xml")


def test_each_script_is_an_entry_point(wheel, checkout):
    entry_points = next(n for n in wheel.namelist() if n.endswith("entry_points.txt"))
    commands = {
        line.split("=")[0].strip() for line in wheel.read(entry_points).decode().split("\n")
    }
    scripts = sorted(path.name for path in (checkout / "scripts").iterdir() if path.is_file())
    assert "flatland_server" in scripts
    for script in scripts:
        assert script in commands
        (info,) = [i for i in wheel.infolist() if i.filename.endswith(f"flatland/scripts/{script}")]
        assert info.external_attr >> 16 & 0o111, "roslaunch finds only what may be executed"


def test_versions_agree(checkout):
    project = tomllib.loads((checkout / "pyproject.toml").read_text())["project"]
    package = ElementTree.parse(checkout / "package.xml").getroot()
    assert package.findtext("version") == project["version"]
