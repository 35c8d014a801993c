"""Contents of the wheel: package, extension, messages and the data of the ROS package."""

from __future__ import annotations

import fcntl
import subprocess
import sys
import tarfile
import xml.etree.ElementTree as ElementTree
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from waiting import BUILD_TIMEOUT

from flatland.version import VERSION

pytestmark = pytest.mark.timeout(BUILD_TIMEOUT)


def source_files(checkout: Path) -> set[str]:
    """Returns the files of the checkout that are tracked, or new and not ignored."""
    listed = subprocess.run(
        ["git", "-C", checkout, "ls-files", "-z", "-co", "--exclude-standard"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    return {name for name in set(listed.split("\0")) - {""} if (checkout / name).exists()}


def page_files_of_npm(checkout: Path) -> set[str]:
    """Returns uPlot in the page, which .gitignore excludes; empty if npm could not be reached."""
    folder = checkout / "flatland" / "web" / "page" / "vendor"
    return {path.relative_to(checkout).as_posix() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory, checkout: Path) -> Iterator[zipfile.ZipFile]:
    """The wheel of the checkout, built in the folder of `make setup` to compile little."""
    pytest.importorskip("scikit_build_core")
    folder = tmp_path_factory.mktemp("wheel")
    (checkout / "build").mkdir(exist_ok=True)
    with (checkout / "build" / ".setup.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        pip_wheel = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation"]
        built = subprocess.run(
            [*pip_wheel, "--config-settings=build-dir=build/pip", "--wheel-dir", folder, "."],
            cwd=checkout,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
    assert built.returncode == 0, built.stdout
    (path,) = folder.glob("flatland_sim-*.whl")
    with zipfile.ZipFile(path) as archive:
        yield archive


def test_package_contains_sources_and_built_files_only(wheel, checkout):
    names = {name for name in wheel.namelist() if name.startswith("flatland/")}
    sources = {name for name in source_files(checkout) if name.startswith("flatland/")}
    sources |= page_files_of_npm(checkout)
    messages = {f"flatland/msg/_{path.stem}.py" for path in (checkout / "msg").iterdir()}
    services = {f"flatland/srv/_{path.stem}.py" for path in (checkout / "srv").iterdir()}
    modules = {"flatland/msg/__init__.py", "flatland/srv/__init__.py"}
    assert {"flatland/py.typed", "flatland/_core.pyi"} <= sources
    (extension,) = names - sources - messages - services - modules
    assert extension.startswith(f"flatland/_core.{sys.implementation.cache_tag}-")
    assert sources | messages | services | modules <= names


def test_ros_package_data(wheel, checkout):
    marker = "/share/flatland/package.xml"
    prefix = next(n for n in wheel.namelist() if n.endswith(marker)).removesuffix("package.xml")
    names = {name.removeprefix(prefix) for name in wheel.namelist() if name.startswith(prefix)}
    expected = {
        name
        for name in source_files(checkout)
        if name.split("/")[0] in ("launch", "msg", "srv", "rviz", "worlds") and name[-3:] != ".py"
    }
    scripts = {name for name in names if name.startswith("scripts/")}
    assert names - scripts == expected | {"flatland_plugins.xml", "package.xml"}
    assert b"<class " in wheel.read(f"{prefix}flatland_plugins.xml")


def test_packages_of_the_reference(wheel, checkout):
    marker = "/share/flatland_msgs/package.xml"
    share = next(n for n in wheel.namelist() if n.endswith(marker)).removesuffix(
        "flatland_msgs/package.xml"
    )
    names = {n.removeprefix(share) for n in wheel.namelist() if n.startswith(share)}
    expected = {
        f"flatland_msgs/{path.relative_to(checkout)}"
        for path in (*checkout.glob("msg/*"), *checkout.glob("srv/*"))
    }
    for path in (checkout / "compat").rglob("*"):
        parts = path.relative_to(checkout / "compat").parts
        if path.is_file() and parts[1] in ("package.xml", "launch", "scripts"):
            expected.add("/".join(parts))
    assert {name for name in names if not name.startswith("flatland/")} == expected
    server = wheel.read(f"{share}flatland_server/scripts/flatland_server").decode()
    assert '/bin/flatland_server" --msgs-package flatland_msgs "$@"' in server
    for path in (checkout / "msg").iterdir():
        assert f"flatland_msgs/msg/_{path.stem}.py" in wheel.namelist()
    for path in (checkout / "srv").iterdir():
        assert f"flatland_msgs/srv/_{path.stem}.py" in wheel.namelist()
    assert "flatland_msgs/__init__.py" in wheel.namelist()


def test_each_script_is_an_entry_point(wheel, checkout):
    entry_points = next(n for n in wheel.namelist() if n.endswith("entry_points.txt"))
    lines = wheel.read(entry_points).decode().splitlines()
    commands = {line.split("=")[0].strip() for line in lines}
    scripts = sorted(path.name for path in (checkout / "scripts").iterdir() if path.is_file())
    assert "flatland_server" in scripts
    for script in scripts:
        assert script in commands
        (info,) = [
            i for i in wheel.infolist() if i.filename.endswith(f"share/flatland/scripts/{script}")
        ]
        assert info.external_attr >> 16 & 0o111, "roslaunch finds executable files only"


def test_versions_agree(wheel, checkout):
    """flatland/version.py is the source of the version; manifests of ROS contain copies."""
    packages = [
        file
        for folder in ("catkin", "compat", "ros2")
        for file in checkout.glob(f"{folder}/*/package.xml")
    ]
    versions = [ElementTree.parse(path).getroot().findtext("version") for path in packages]
    assert versions == [VERSION] * 8
    assert f"flatland_sim-{VERSION}.dist-info/METADATA" in wheel.namelist()


def test_source_distribution(tmp_path, checkout):
    """It contains what the wheel is built from; files behind links of catkin/ occur once."""
    backend = "import scikit_build_core.build as b, sys; print(b.build_sdist(sys.argv[1]))"
    subprocess.run([sys.executable, "-c", backend, tmp_path], cwd=checkout, check=True)
    [path] = tmp_path.iterdir()
    assert path.name == f"flatland_sim-{VERSION}.tar.gz"
    with tarfile.open(path) as archive:
        names = {name.split("/", 1)[1] for name in archive.getnames()}
    folders = ("cmake/", "compat/", "flatland/", "launch/", "msg/", "rviz/", "scripts/")
    needed = {n for n in source_files(checkout) if n.startswith((*folders, "src/", "srv/"))}
    assert {n for n in needed if not (checkout / n).is_dir()} <= names
    assert page_files_of_npm(checkout) <= names
    assert {"CMakeLists.txt", "LICENSE", "pyproject.toml", "catkin/flatland/package.xml"} <= names
    assert not [n for n in names if n.endswith(".so") or n.startswith(("tests/", "docs/images/"))]
    assert len([n for n in names if n.startswith("catkin/")]) == 1
