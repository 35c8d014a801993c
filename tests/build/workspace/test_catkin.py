"""The ROS package built by catkin_make, in the devel and the install space."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from free_ports import free_port
from programs import Program, run_program
from waiting import BUILD_TIMEOUT

# The first test builds the workspace.
pytestmark = pytest.mark.timeout(BUILD_TIMEOUT)

STEP_A_WORLD = """
import sys, flatland, flatland._core, flatland.msg, flatland.plugins
with flatland.World.from_yaml(sys.argv[1]) as world:
    world.model("ball").body("base").set_velocity(1, 0, 0)
    world.step(200)
    x, y, _ = world.model("ball").body("base").pose
assert abs(x - 2) < 1e-4 and y == 2, (x, y)
for module in (flatland, flatland._core, flatland.msg, flatland.world):
    print(module.__file__)
"""


SERVE_THE_PAGE = """
import urllib.request
from flatland.web import WebViewer
from flatland.web.page_files import PageFiles
from flatland.web.server import PAGE
with WebViewer(port=0) as viewer:
    files = PageFiles(PAGE)
    with urllib.request.urlopen(viewer.url) as answer:
        assert answer.read() == files.index.content
    print("index.html")
    for path in sorted(PAGE.rglob("*.*")):
        name = path.relative_to(PAGE).as_posix()
        if name == "index.html" or name.endswith(".d.ts"):  # the latter for type checkers only
            continue
        with urllib.request.urlopen(f"{viewer.url}{files.prefix}{name}") as answer:
            assert answer.read() == path.read_bytes()
        print(name)
"""


def test_ros_tools_find_the_package(space, checkout):
    in_checkout = checkout / "catkin" / "flatland"
    expected = in_checkout if space.name == "devel" else space.folder / "share" / "flatland"
    assert Path(space.run("rospack", "find", "flatland").strip()).resolve() == expected
    assert "Collision[] collisions" in space.run("rosmsg", "show", "-r", "flatland/Collisions")
    md5 = space.run("rossrv", "md5", "flatland/SpawnModel").split()[0]
    assert md5 == "952237af09cbedc354d376afc6d2fc71"


def test_world_steps_in_the_python_of_the_system(space, world_file, checkout):
    printed = space.run("/usr/bin/python3", "-W", "error", "-c", STEP_A_WORLD, world_file)
    package, core, messages, world = map(Path, printed.split("\n")[:4])
    built = space.folder / "lib" / "python3" / "dist-packages" / "flatland"
    assert (package.parent, core.parent, messages.parent) == (built, built, built / "msg")
    # The devel space uses the sources, so that edits take effect without a build.
    assert world.parent.resolve() == (checkout / "flatland" if space.name == "devel" else built)


def test_the_page_of_the_viewer_is_served(space, checkout):
    printed = space.run("/usr/bin/python3", "-W", "error", "-c", SERVE_THE_PAGE).split()
    page = checkout / "flatland" / "web" / "page"
    assert "index.html" in printed
    served = [path for path in page.rglob("*.*") if not path.name.endswith(".d.ts")]
    assert sorted(printed) == sorted(str(path.relative_to(page)) for path in served)


def test_devel_space_does_not_put_the_checkout_on_the_path(make_space, checkout):
    path = make_space("devel").run(
        "/usr/bin/python3", "-c", "import sys; print(*sys.path, sep='\\n')"
    )
    assert str(checkout) not in path.splitlines()


def test_plugin_manifest_is_exported(space):
    script = (
        "import rospkg; p = rospkg.RosPack(); "
        "print(p.get_manifest('flatland').get_export('flatland', 'plugin')[0]"
        ".replace('${prefix}', p.get_path('flatland')))"
    )
    manifest = Path(space.run("/usr/bin/python3", "-c", script).strip())
    assert manifest.read_text().count("<class ") >= 10


def test_install_space_contains_all_files_and_none_of_make_dev(make_space, checkout):
    folder = make_space("install").folder
    package = folder / "lib" / "python3" / "dist-packages" / "flatland"
    sources = {
        path.relative_to(checkout / "flatland")
        for pattern in ("*.py", "*.pyi", "*.xml", "py.typed", "LICENSE")
        for path in (checkout / "flatland").rglob(pattern)
    }
    generated = {Path("msg"), Path("srv")}
    sources = {path for path in sources if path.parent not in generated}
    installed = {path.relative_to(package) for path in package.rglob("*") if path.is_file()}
    assert sources <= installed
    assert len([path for path in installed if path.match("_core*.so")]) == 1
    for data in ("launch", "msg", "srv", "rviz", "worlds"):
        if (checkout / data).is_dir():
            assert (folder / "share" / "flatland" / data).is_dir()
    assert not [path for path in folder.rglob("*") if path.is_symlink()]


@pytest.mark.parametrize(
    ("launch_file", "nodes"),
    [("server.launch", "/flatland_server\n"), ("benchmark.launch", "/flatland_benchmark\n")],
)
def test_roslaunch_parses_the_launch_files(space, launch_file, nodes):
    assert space.run("roslaunch", "--nodes", "flatland", launch_file, "show_viz:=false") == nodes


def test_each_script_is_executable(space, checkout):
    programs = space.folder / "lib" / "flatland"
    scripts = {path.name for path in (checkout / "scripts").iterdir() if path.is_file()}
    assert scripts <= {path.name for path in programs.iterdir() if os.access(path, os.X_OK)}
    assert "MAP_YAML" in space.run(programs / "map_to_lines.py", "--help")
    # No program listens on port 1.
    viewer = run_program(
        [programs / "flatland_viz"],
        env={**space.environment, "ROS_MASTER_URI": "http://127.0.0.1:1"},
        cwd=space.scratch,
        stderr=subprocess.STDOUT,
    )
    assert viewer.returncode == 1
    assert viewer.stdout.startswith("flatland_viz: no ROS master at http://127.0.0.1:1")


def test_rosrun_starts_a_program(make_space):
    """In the install space only: rosrun splits the path of the devel space at the blank."""
    space = make_space("install")
    assert "MAP_YAML" in space.run("rosrun", "flatland", "map_to_lines.py", "--help")
    assert "--msgs-package" in space.run("rosrun", "flatland_server", "flatland_server", "--help")


def test_bundled_worlds_are_valid(space):
    share = Path(space.run("rospack", "find", "flatland").strip())
    worlds = sorted((share / "worlds").glob("*/world.yaml"))
    check = "import sys, flatland.cli as c; [c.main(['check', path]) for path in sys.argv[1:]]"
    printed = space.run("/usr/bin/python3", "-c", check, *worlds)
    assert printed.count("no errors") == len(worlds) > 0
    assert (share / "rviz" / "flatland.rviz").is_file()


def test_node_publishes_the_clock_until_roslaunch_is_stopped(space, world_file):
    port = free_port()
    environment = {**space.environment, "ROS_MASTER_URI": f"http://127.0.0.1:{port}"}
    command = ["roslaunch", "-p", str(port), "flatland", "server.launch"]
    launch = Program(
        [*command, f"world_path:={world_file}", "show_viz:=false"],
        env=environment,
        cwd=space.scratch,
    )
    wait_for_clock = (
        "import rospy; from rosgraph_msgs.msg import Clock; "
        "rospy.init_node('waiter', anonymous=True); rospy.wait_for_message('/clock', Clock)"
    )
    try:
        # roslaunch starts the master first.
        wait_for_master = (
            "import rosgraph, time\nwhile not rosgraph.is_master_online():\n    time.sleep(0.1)\n"
        )
        for script in (wait_for_master, wait_for_clock):
            waited = run_program(["/usr/bin/python3", "-c", script], env=environment)
            assert waited.returncode == 0, waited.stderr + launch.output
        assert launch.stop() == 0, launch.output
    finally:
        launch.kill()
