"""The environment of a user: files installed by `make setup`, variables of `setup.bash`."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest
from free_ports import free_port
from programs import run_program

from flatland.errors import FlatlandError

needs_rviz = pytest.mark.skipif(
    importlib.util.find_spec("rviz") is None
    or importlib.util.find_spec("rviz.librviz_sip") is None,
    reason="RViz has no Python bindings here, as on Debian 13",
)


@pytest.fixture(scope="module")
def installed(checkout: Path) -> Path:
    """The checkout; skips the test if `make setup` has not been run."""
    if not (checkout / ".venv" / "share" / "flatland" / "package.xml").exists():
        pytest.skip("`make setup` has not been run")
    return checkout


@pytest.fixture
def shell(installed, tmp_path):
    """Runs a script in a new login shell and an empty folder; $0 is setup.bash."""

    def run_script(script: str, **variables: str) -> subprocess.CompletedProcess[str]:
        environment = {"HOME": str(tmp_path), "PATH": "/usr/bin:/bin", "LANG": "C.UTF-8"}
        command = ["bash", "-c", script, installed / "setup.bash"]
        return run_program(command, env={**environment, **variables}, cwd=tmp_path)

    return run_script


def test_ros_tools_find_the_package_and_those_of_the_reference(shell, installed):
    """rosservice runs in /usr/bin/python3 and imports the class of the service."""
    names = "flatland flatland_msgs flatland_plugins flatland_server flatland_viz"
    done = shell(
        f'set -eu; . "$0"; for name in {names}; do rospack find $name; done; '
        "rosmsg show -r flatland_msgs/Collisions; /usr/bin/python3 -c "
        "'import flatland.srv, flatland_msgs.srv; print(flatland.srv.__file__);"
        " print(flatland_msgs.srv.SpawnModel._type)'"
    )
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[:5] == [f"{installed}/.venv/share/{name}" for name in names.split()]
    assert "Collision[] collisions" in lines
    assert lines[-2].startswith(f"{installed}/.venv/lib")
    assert lines[-1] == "flatland_msgs/SpawnModel"


def test_second_source_has_no_effect(shell):
    names = "$PATH $PYTHONPATH $ROS_PACKAGE_PATH"
    once, twice = shell(f'. "$0"; echo {names}'), shell(f'. "$0"; . "$0"; echo {names}')
    assert once.stdout == twice.stdout
    assert once.stdout.strip()


def test_existing_variables_are_extended(shell):
    done = shell(
        '. "$0"; echo "$ROS_MASTER_URI"; echo "$ROS_PACKAGE_PATH"; echo "$PYTHONPATH"',
        ROS_MASTER_URI="http://robot:11311",
        ROS_PACKAGE_PATH="/opt/mine",
        PYTHONPATH="/opt/python",
    )
    uri, packages, python = done.stdout.splitlines()
    assert uri == "http://robot:11311"
    assert packages.endswith(":/opt/mine")
    assert python.endswith(":/opt/python")


def test_run_reports_a_missing_world(shell, installed):
    done = shell(f"'{installed}/tools/run.sh' nowhere.yaml")
    assert done.returncode == 1
    assert "world file not found: nowhere.yaml" in done.stderr


@pytest.mark.parametrize(
    ("display", "given", "passed"),
    [
        ("", "", "show_viz:=false web:=true"),
        ("", "web:=false seed:=1", "web:=false seed:=1 show_viz:=false"),
        ("", "web:=true web_port:=0", "web:=true web_port:=0 show_viz:=false"),
        ("", "show_viz:=true", "show_viz:=true"),
        ("", "show_viz:=false", "show_viz:=false"),
        pytest.param(":0", "", "", marks=needs_rviz),
        pytest.param(":0", "web:=true", "web:=true", marks=needs_rviz),
        ("no rviz", "", "show_viz:=false web:=true"),
    ],
)
def test_without_a_display_or_rviz_run_starts_the_viewer_for_the_browser(
    shell, installed, tmp_path, display, given, passed
):
    # Instead of roslaunch, which the environment of the installation finds on PATH.
    roslaunch = tmp_path / "roslaunch"
    roslaunch.write_text('#!/bin/sh\necho "roslaunch $*"\n')
    roslaunch.chmod(0o755)
    environment = {"DISPLAY": display, "PATH": f"{tmp_path}:{installed}/.venv/bin:/usr/bin:/bin"}
    if display == "no rviz":
        (tmp_path / "rviz").mkdir()
        (tmp_path / "rviz/__init__.py").touch()  # found before the real package
        environment["PYTHONPATH"] = str(tmp_path)
    done = shell(f"'{installed}/tools/run.sh' '' {given}", **environment)
    *notices, command = done.stdout.splitlines()
    assert command == f"roslaunch flatland server.launch {passed}".rstrip(), done.stderr
    assert bool(notices) == ("show_viz" in passed and "show_viz" not in given)


def test_server_runs_with_a_broken_python_first_on_path(shell, world_file, tmp_path):
    broken = tmp_path / "broken"
    broken.mkdir()
    for name in ("python", "python3", f"python3.{sys.version_info.minor}"):
        (broken / name).write_text('#!/bin/sh\necho "$0 was started"\nexit 99\n')
        (broken / name).chmod(0o755)
    port = free_port()
    done = shell(
        f'. "$0"; export PATH="{broken}:$PATH"; roslaunch -p {port} flatland benchmark.launch '
        f"world_path:='{world_file}' benchmark_duration:=1",
        ROS_MASTER_URI=f"http://127.0.0.1:{port}",
    )
    printed = done.stdout + done.stderr
    assert done.returncode == 0, printed
    assert "benchmark: 200 iterations" in printed
    assert "was started" not in printed


def test_the_command_is_completed_in_an_interactive_shell(installed, tmp_path):
    """`bash -i` reads no start file here; the completion is that of argcomplete."""
    done = run_program(
        ["bash", "--norc", "-ic", '. "$0"; complete -p flatland', installed / "setup.bash"],
        env={"HOME": str(tmp_path), "PATH": "/usr/bin:/bin"},
    )
    assert "_python_argcomplete flatland" in done.stdout, done.stderr


def test_numpy_is_the_debian_package(shell):
    """The extensions of ROS were built with it, so that no newer version may be installed."""
    done = shell('. "$0"; python -c "import numpy, yaml; print(numpy.__file__, yaml.__file__)"')
    assert done.stdout.count("/usr/lib/python3/dist-packages/") == 2


def test_the_installed_page_contains_uplot_with_its_licence(installed):
    if not (installed / ".venv" / "flatland-setup" / "npm").exists():
        pytest.skip("the last set-up could not reach npm")
    [package] = installed.glob(".venv/lib/python3*/site-packages/flatland")
    uplot = package / "web" / "page" / "vendor" / "uplot"
    assert "Copyright" in (uplot / "LICENSE").read_text()
    of_npm = installed / ".venv" / "js" / "node_modules" / "uplot" / "dist"
    for name in ("uPlot.esm.js", "uPlot.min.css"):
        assert (uplot / name).read_bytes() == (of_npm / name).read_bytes()


def test_tests_use_the_installed_package(installed):
    if os.environ.get("VIRTUAL_ENV") != str(installed / ".venv"):
        pytest.skip("only in the virtual environment, as under `make test`")
    import inspect

    assert inspect.getfile(FlatlandError).startswith(f"{installed}/.venv/lib/")
