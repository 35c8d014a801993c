"""A catkin workspace shared by the tests of this folder, and clean environments."""

from __future__ import annotations

import fcntl
import os
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from programs import output_of
from waiting import BUILD_TIMEOUT


def clean_environment(home: Path) -> dict[str, str]:
    """Returns the environment of a new login, without virtual environment, workspace or ROS."""
    return {"HOME": str(home), "PATH": "/usr/bin:/bin", "LANG": "C.UTF-8"}


@dataclass(frozen=True)
class Space:
    """The devel or the install space of the workspace.

    Attributes:
        name: `devel` or `install`.
        folder: Folder of the space.
        environment: Variables exported by `setup.bash` of the space.
        scratch: Empty working folder.
    """

    name: str
    folder: Path
    environment: dict[str, str]
    scratch: Path

    def run(self, *command: str | Path) -> str:
        """Runs a command in the environment of the space and returns its output."""
        return output_of(command, self.environment, self.scratch)


@pytest.fixture(scope="package")
def catkin_workspace(checkout: Path) -> Iterator[Path]:
    """A workspace with flatland, the example package and a client in src/, built and installed.

    It is kept for the next run. No other run changes it before the tests of this folder end.
    """
    if shutil.which("catkin_make", path="/usr/bin") is None:
        pytest.skip("catkin is not installed")
    with (checkout / "build" / ".workspace.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        build = checkout / "tools" / "catkin_workspace.sh"
        output_of([build], dict(os.environ), checkout, silence=BUILD_TIMEOUT)
        yield checkout / "build" / "work space"


@pytest.fixture(scope="package")
def make_space(
    catkin_workspace: Path, tmp_path_factory: pytest.TempPathFactory
) -> Callable[[str], Space]:
    """Returns the space of a name."""

    def enter(name: str) -> Space:
        scratch = tmp_path_factory.mktemp(name)
        exported = output_of(
            ["bash", "-c", '. "$0" && env -0', catkin_workspace / name / "setup.bash"],
            clean_environment(scratch),
            scratch,
        )
        environment = dict(line.split("=", 1) for line in exported.split("\0") if "=" in line)
        environment["ROS_LOG_DIR"] = str(scratch / "log")
        return Space(name, catkin_workspace / name, environment, scratch)

    return enter


@pytest.fixture(params=["devel", "install"])
def space(make_space: Callable[[str], Space], request: pytest.FixtureRequest) -> Space:
    """The devel space, then the install space."""
    return make_space(request.param)
