"""The packages for colcon workspaces: manifests, launch files, and folders that catkin ignores."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
import yaml

catkin_pkg = pytest.importorskip("catkin_pkg.packages", reason="catkin_pkg is not installed")

from catkin_pkg.package import parse_package  # noqa: E402

from flatland.version import VERSION  # noqa: E402

CHECKOUT = Path(__file__).resolve().parents[2]
PACKAGES = CHECKOUT / "ros2"
NAMES = ["flatland", "flatland_msgs", "flatland_server"]
# Of the launch files: what their imports provide.
LAUNCH_MODULES = {"ament_index_python.packages", "flatland.ros2.parameters", "launch",
                  "launch.actions", "launch.conditions", "launch.substitutions",
                  "launch_ros.actions", "pathlib", "__future__"}  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_manifest(name: str) -> None:
    package = parse_package(str(PACKAGES / name))
    package.validate()
    assert (package.name, package.version, package.package_format) == (name, VERSION, 3)
    assert package.get_build_type() == "ament_cmake"


def test_catkin_and_colcon_find_their_own_packages() -> None:
    # Without those of the wheels that `make ros2` installs into build/ros2.
    found = catkin_pkg.find_packages(str(CHECKOUT))
    assert not [path for path in found if path.startswith(("ros2", "build/ros2"))]
    found = catkin_pkg.find_packages(str(PACKAGES), ignore_markers={"COLCON_IGNORE"})
    assert sorted(package.name for package in found.values()) == NAMES


def test_packages_contain_the_sources_by_links() -> None:
    for name in ("cmake", "flatland", "src", "worlds"):
        assert (PACKAGES / "flatland" / name).resolve() == CHECKOUT / name


@pytest.mark.parametrize(
    "path",
    sorted(PACKAGES.rglob("*.launch.py")),
    ids=lambda path: f"{path.parent.name}/{path.name}",
)
def test_launch_file(path: Path) -> None:
    """The wheels of ROS 2 do not include `launch`: the file is not executed."""
    tree = ast.parse(path.read_text())
    modules = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert modules <= LAUNCH_MODULES
    functions = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    assert "generate_launch_description" in functions
    started = {
        (values["package"], values["executable"])
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "Node"
        for values in [{each.arg: ast.unparse(each.value) for each in node.keywords}]
    }
    own = [executable for package, executable in started if package == "'flatland'"]
    assert all(
        (PACKAGES / "flatland" / "scripts" / ast.literal_eval(each)).exists() for each in own
    )


def test_configurations_are_yaml() -> None:
    rviz = yaml.safe_load((PACKAGES / "flatland" / "rviz" / "flatland.rviz").read_text())
    topics = [
        display["Topic"]["Value"]
        for display in rviz["Visualization Manager"]["Displays"]
        if "Topic" in display
    ]
    assert "/scan" in topics
    nav2 = yaml.safe_load((PACKAGES / "flatland" / "examples" / "nav2" / "nav2.yaml").read_text())
    launch = (PACKAGES / "flatland" / "examples" / "nav2" / "nav2.launch.py").read_text()
    costmaps = {"local_costmap", "global_costmap"}
    assert all(f'"{name}": "nav2_' in launch for name in nav2.keys() - costmaps)
    assert nav2["controller_server"]["ros__parameters"]["enable_stamped_cmd_vel"] is True
