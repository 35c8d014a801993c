"""Packages of the reference simulator in a workspace: C++ headers, launch files, a C++ client."""

from __future__ import annotations

from pathlib import Path

import pytest
from free_ports import free_port
from programs import Program, run_program
from waiting import BUILD_TIMEOUT

# The first test builds the workspace.
pytestmark = pytest.mark.timeout(BUILD_TIMEOUT)

PACKAGES = ("flatland_msgs", "flatland_plugins", "flatland_server", "flatland_viz")
WORLD = """
properties: {}
layers: [{name: 2d, map: map.yaml}]
"""
MAP = "type: line_segments\ndata: walls.dat\nscale: 1.0\norigin: [0, 0, 0]\n"
WALLS = "-5 -5 5 -5\n5 -5 5 5\n5 5 -5 5\n-5 5 -5 -5\n"
CRATE = """
bodies:
  - {name: box, footprints: [{type: circle, radius: 0.5, density: 1}]}
plugins:
  - {type: Bumper, name: bumper}
"""
RESULTS = [
    "an absent model file is refused",
    *("spawned", "listed", "publishes"),
    *("moved to a wall", "collides with the wall", "moved back", "is free"),
    *("deleted", "no longer listed"),
]


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A world without models; `crate.yaml` is beside it."""
    folder = tmp_path_factory.mktemp("room")
    for name, text in (
        ("world.yaml", WORLD),
        ("map.yaml", MAP),
        ("walls.dat", WALLS),
        ("crate.yaml", CRATE),
    ):
        (folder / name).write_text(text)
    return folder / "world.yaml"


def test_ros_tools_find_the_packages(space, checkout):
    for package in PACKAGES:
        found = Path(space.run("rospack", "find", package).strip()).resolve()
        in_space = space.folder / "share" / package
        assert found == (checkout / "compat" / package if space.name == "devel" else in_space)
    assert "Collision[] collisions" in space.run("rosmsg", "show", "-r", "flatland_msgs/Collisions")
    md5 = space.run("rossrv", "md5", "flatland_msgs/SpawnModel").split()
    assert md5 == ["952237af09cbedc354d376afc6d2fc71"]


def test_python_code_is_generated(space):
    printed = space.run(
        "/usr/bin/python3",
        "-c",
        "import flatland_msgs.msg as m, flatland_msgs.srv as s; "
        "print(m.__file__, *m.Collisions._slot_types, m.Collisions._type, s.SpawnModel._type)",
    )
    path, *types = printed.rsplit(maxsplit=4)
    assert Path(path).is_relative_to(space.folder)
    assert types[1:] == [f"flatland_msgs/{n}" for n in ("Collision[]", "Collisions", "SpawnModel")]


def test_a_clone_in_a_workspace_needs_nothing_else(catkin_workspace):
    """The packages are found without further links, and no other package of the checkout is."""
    source = catkin_workspace / "src"
    linked = ["CMakeLists.txt", "a_client", "flatland", "my_robots"]
    assert sorted(path.name for path in source.iterdir()) == linked
    environment = {"PATH": "/usr/bin:/bin", "ROS_PACKAGE_PATH": str(source)}
    listed = run_program(["rospack", "list"], env=environment, check=True).stdout.splitlines()
    found = [line.split(" ", 1) for line in listed if f" {source}/" in line]
    assert sorted(found) == [
        ["a_client", f"{source}/a_client"],
        ["flatland", f"{source}/flatland/catkin/flatland"],
        *([name, f"{source}/flatland/compat/{name}"] for name in PACKAGES),
        ["my_robots", f"{source}/my_robots"],
    ]


def test_cpp_client_of_the_reference(space, room):
    port = free_port()
    environment = {**space.environment, "ROS_MASTER_URI": f"http://127.0.0.1:{port}"}
    command = ["roslaunch", "-p", str(port), "flatland_server", "server.launch"]
    launch = Program(
        [*command, f"world_path:={room}", "show_viz:=true", "use_rviz:=true"],
        env=environment,
        cwd=space.scratch,
    )
    client = space.folder / "lib" / "a_client" / "a_client"
    try:
        done = run_program([client, room.with_name("crate.yaml")], env=environment)
        types = space.run(
            "env",
            f"ROS_MASTER_URI={environment['ROS_MASTER_URI']}",
            "rosservice",
            "type",
            "/spawn_model",
        )
        assert launch.stop() == 0, launch.output
    finally:
        launch.kill()
        print(launch.output)  # Part of the report if the client fails.
    # The lines of rosconsole start with the code of a colour.
    printed = [line for line in done.stdout.splitlines() if not line.startswith("\x1b")]
    assert printed == RESULTS, done.stdout + done.stderr + launch.output
    assert done.returncode == 0
    assert types == "flatland_msgs/SpawnModel\n"
