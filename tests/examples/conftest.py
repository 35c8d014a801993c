"""Fixtures: the example package, the environment of a user's shell, background programs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path

import pytest
from forked_ros import Forks
from free_ports import free_port
from programs import Program

import flatland


@pytest.fixture(scope="session")
def example(checkout: Path) -> Path:
    """The example package."""
    return checkout / "examples" / "my_robots"


@pytest.fixture(scope="session")
def new_environment(checkout: Path) -> Callable[[Path], dict[str, str]]:
    """Returns the environment of a shell after `. setup.bash`, with a new home and ROS master."""
    package = Path(flatland.__file__).resolve().parent
    # The package is the installed one, or the source tree after `make dev`.
    share = checkout if package.parent == checkout else Path(sys.prefix) / "share"

    def create(folder: Path) -> dict[str, str]:
        home = folder / "home"
        home.mkdir()
        return {
            "HOME": str(home),
            "PATH": f"{Path(sys.executable).parent}:/usr/bin:/bin",
            "LANG": "C.UTF-8",
            "PYTHONPATH": str(package.parent),
            "ROS_PACKAGE_PATH": f"{share}:/usr/share",
            "ROS_DISTRO": "Debian",
            "ROS_VERSION": "1",
            "ROS_PYTHON_VERSION": "3",
            "ROS_ETC_DIR": "/etc/ros",
            "ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}",
            "ROS_IP": "127.0.0.1",
            "PYTHONUNBUFFERED": "1",
        }

    return create


@pytest.fixture
def environment(
    new_environment: Callable[[Path], dict[str, str]], tmp_path: Path
) -> dict[str, str]:
    """The environment of a shell after `. setup.bash`."""
    return new_environment(tmp_path)


@pytest.fixture(scope="session")
def ros_programs(
    new_environment: Callable[[Path], dict[str, str]], tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Path]:
    """A folder of programs of ROS that start faster than those that are installed."""
    pytest.importorskip("rosservice", reason="ROS is not installed")
    folder = tmp_path_factory.mktemp("ros")
    forks = Forks(folder, new_environment(folder))
    programs = folder / "bin"
    programs.mkdir()
    forks.write_programs(programs)
    yield programs
    forks.stop()


@pytest.fixture
def ros_environment(environment: dict[str, str], ros_programs: Path) -> dict[str, str]:
    """The environment of a shell after `. setup.bash`, with these programs."""
    environment["PATH"] = f"{ros_programs}:{environment['PATH']}"
    return environment


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., Program]]:
    """Starts programs, which are all stopped at the end of the test, even if one does not end."""
    with ExitStack() as stopping:

        def start_program(
            command: Sequence[str | Path], environment: Mapping[str, str], folder: Path = tmp_path
        ) -> Program:
            program = Program(command, env=environment, cwd=folder)
            stopping.callback(program.stop)
            return program

        yield start_program


@pytest.fixture
def found_by_variable(example: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Makes the package available as in a Python program without ROS."""
    monkeypatch.setenv("FLATLAND_PLUGIN_PATH", str(example / "flatland_plugins.xml"))
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    monkeypatch.setattr(sys, "path", list(sys.path))


@pytest.fixture
def load(found_by_variable: None, tmp_path: Path) -> Iterator[Callable[..., flatland.World]]:
    """Loads a world with world plugins and with models, given as keyword arguments name=YAML."""
    worlds: list[flatland.World] = []

    def load_world(plugins: str = "[]", **models: str) -> flatland.World:
        lines = []
        for name, text in models.items():
            (tmp_path / f"{name}.yaml").write_text(text)
            lines.append(f"  - {{name: {name}, model: {name}.yaml}}")
        (tmp_path / "world.yaml").write_text(
            "properties: {}\nlayers: []\nmodels:\n" + "\n".join(lines) + f"\nplugins: {plugins}\n"
        )
        worlds.append(flatland.World.from_yaml(tmp_path / "world.yaml", seed=1))
        return worlds[-1]

    yield load_world
    for world in worlds:
        world.close()
