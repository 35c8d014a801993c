"""Optional packages that are not installed, and an installed flatland that a clone hides."""

from __future__ import annotations

import json
import shutil
import sys
from importlib.machinery import ModuleSpec
from pathlib import Path

import pytest
from programs import run_program

from flatland import requirements
from flatland.extras import MissingPackageError, require

BLOCKED = """
import sys

class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in sys.argv[1].split(","):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Blocker())
"""
CLI = "from flatland.cli import main; sys.exit(main({arguments!r}))"

# The missing module, the program or arguments of `flatland`, the error, and the command.
ENTRIES: list[tuple[str, str | list[str], str, str]] = [
    ("cv2", ["run", "{world}", "--video", "a.mp4"], "videos need OpenCV", "python3-opencv"),
    (
        "cv2",
        "from flatland.tools.map_to_lines import main; sys.exit(main(['{map}', '.']))",
        "the detection of line segments needs OpenCV",
        "python3-opencv",
    ),
    ("matplotlib", ["show", "{world}", "-o", "a.png"], "drawing needs", "python3-matplotlib"),
    ("matplotlib", ["run", "{world}", "--video", "a.mp4"], "drawing", "python3-matplotlib"),
    ("aiohttp", ["view", "{world}", "--no-browser"], "the viewer needs", "python3-aiohttp"),
    (
        "aiohttp",
        "from flatland.gym import FlatlandEnv; FlatlandEnv('corridor', render_mode='human')",
        'render_mode "human" requires',
        "python3-aiohttp",
    ),
    ("gymnasium", "import flatland.gym", "flatland.gym requires Gymnasium", "flatland-sim[gym]"),
    (
        "onnxruntime",
        "from flatland.gym.policies import Policy; Policy()",
        "policies require ONNX Runtime",
        "flatland-sim[onnx]",
    ),
    (
        "pettingzoo",
        "import flatland.gym; flatland.gym.make_parallel()",
        "environments with several robots require PettingZoo",
        "flatland-sim[gym]",
    ),
    (
        "mcap_ros1",
        ["run", "{world}", "--mcap", "a.mcap"],
        "MCAP files need mcap-ros1-support",
        "flatland-sim[mcap]",
    ),
    ("rosbag", ["run", "{world}", "--bag", "a.bag"], "bags need rosbag", "python3-rosbag"),
    ("tf2_msgs", ["run", "{world}", "--bag", "a.bag"], "bags need the messages", "tf2-msgs"),
    ("tf2_msgs", ["run", "{world}", "--mcap", "a.mcap"], "MCAP files need", "tf2-msgs"),
]


@pytest.fixture
def worlds(checkout: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the included worlds; the current folder is empty."""
    monkeypatch.chdir(tmp_path)
    return checkout / "worlds"


# Runs each program in a child of a process that has imported the package, which takes longest.
PROGRAMS = """
import json, os, sys
import flatland.cli, flatland.plugins.diff_drive, flatland.plugins.laser, flatland.simulation

for number, (module, program) in enumerate(json.load(sys.stdin)):
    child = os.fork()
    if not child:
        for stream in (1, 2):
            os.dup2(os.open(f"{number}.{stream}", os.O_WRONLY | os.O_CREAT), stream)
        sys.argv[1:] = [module]
        exec(program)
        sys.exit()
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


def program_of(entry: str | list[str], worlds: Path) -> str:
    paths = {"world": worlds / "simple" / "world.yaml", "map": worlds / "office" / "office.yaml"}
    if isinstance(entry, str):
        return BLOCKED + entry.format(**paths)
    duration = ["--duration", "0.1"] if entry[0] == "run" else []
    return BLOCKED + CLI.format(arguments=[part.format(**paths) for part in entry] + duration)


def test_a_missing_package_is_one_line_with_the_command(worlds: Path) -> None:
    programs = [(module, program_of(entry, worlds)) for module, entry, _, _ in ENTRIES]
    done = run_program([sys.executable, "-c", PROGRAMS], input=json.dumps(programs), check=True)
    assert done.stdout.split() == ["1"] * len(ENTRIES)
    for number, (_, entry, error, command) in enumerate(ENTRIES):
        printed = Path(f"{number}.2").read_text()
        lines = [line for line in printed.splitlines() if not line.startswith("hint: ")]
        assert error in lines[-1]
        assert "No module named" in lines[-1]
        assert command in lines[-1].rpartition("): ")[2]
        assert len(lines) == 1 or not isinstance(entry, list), printed
    assert not list(Path().glob("a.*"))


def test_default_features_need_no_optional_package(worlds: Path) -> None:
    program = f"""
import gymnasium
import flatland
from flatland import worldgen
from flatland.cli import main
import flatland.gym

for simplify in (0, 1, 2):
    with flatland.World.from_yaml({str(worlds / "office" / "world.yaml")!r}, seed=1,
                                  simplify_map=simplify) as world:
        world.step(2)
        assert world.sample_free(3, 0.3, connected_to=None).shape == (3, 3)
env = gymnasium.make("flatland/Navigate-v0")
env.reset(seed=1)
env.step(env.action_space.sample())
env.close()
assert main(["new", "world", "floor", "--maze", "--seed", "7"]) == 0
print("done")
"""
    blocked = "cv2,matplotlib,scipy,mcap_ros1,rosbag,rospy,PyQt5"
    done = run_program([sys.executable, "-c", BLOCKED + program, blocked])
    assert done.stdout.endswith("done\n"), done.stderr


@pytest.mark.parametrize(
    ("way", "module", "command"),
    [
        (requirements.DEBIAN, "matplotlib", "apt-get install python3-matplotlib"),
        (requirements.CATKIN, "matplotlib", "apt-get install python3-matplotlib"),
        (requirements.WHEEL, "matplotlib", 'pip install "flatland-sim[draw]"'),
        (requirements.WHEEL, "cv2", 'pip install "flatland-sim[opencv]"'),
        (requirements.WHEEL, "numpy", "pip install numpy"),
        (requirements.WHEEL, "rosbag", "apt-get install python3-rosbag"),
        (requirements.DEBIAN, "gymnasium", 'pip install "flatland-sim[gym]"'),
        (requirements.CATKIN, "gymnasium", "pip install gymnasium"),
        (requirements.DEBIAN, "flatland._core", "make setup in the clone of flatland"),
        (requirements.CATKIN, "flatland._core", "catkin_make in the workspace"),
    ],
)
def test_the_command_depends_on_the_installation(
    monkeypatch: pytest.MonkeyPatch, way: str, module: str, command: str
) -> None:
    monkeypatch.setattr(requirements, "installation", lambda: way)
    assert requirements.install_command(module) == command


@pytest.mark.parametrize(
    ("file", "has_ros", "way"),
    [
        ("clone/pyproject.toml", False, requirements.DEBIAN),
        ("clone/lib/python3/site-packages/x", True, requirements.DEBIAN),
        ("clone/lib/python3/site-packages/x", False, requirements.WHEEL),
        ("devel/.catkin", True, requirements.CATKIN),
    ],
)
def test_the_installation_is_recognized(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, file: str, has_ros: bool, way: str
) -> None:
    path = tmp_path / file
    path.parent.mkdir(parents=True)
    path.touch()
    folder = path.parent / "lib/python3/dist-packages" if file.endswith("catkin") else path.parent
    flatland = ModuleSpec("flatland", None, origin=str(folder / "flatland" / "__init__.py"))
    specs = {"flatland": flatland, "rospy": ModuleSpec("rospy", None) if has_ros else None}
    monkeypatch.setattr(requirements.importlib.util, "find_spec", specs.get)
    assert requirements.installation() == way


def test_the_extras_are_those_of_the_project(checkout: Path) -> None:
    project = (checkout / "pyproject.toml").read_text()
    for package in requirements.PACKAGES.values():
        assert not package.extra or f"\n{package.extra} = [" in project


def test_a_clone_without_extension_names_what_it_hides(tmp_path: Path, checkout: Path) -> None:
    clone = tmp_path / "clone"
    (clone / "flatland").mkdir(parents=True)
    for name in ("__init__.py", "requirements.py", "version.py"):
        shutil.copy(checkout / "flatland" / name, clone / "flatland" / name)
    command = [sys.executable, "-c", "import flatland; print(flatland.__file__)"]
    done = run_program(command, cwd=clone)
    assert done.returncode == 1
    last = done.stderr.splitlines()[-1]
    assert last.startswith(f"ImportError: {clone / 'flatland'} has no extension")
    assert "hides the installed " in last
    assert "run Python in another folder or as python -P, or run make setup in this one" in last
    command.insert(1, "-P")
    done = run_program(command, cwd=clone, check=True)
    assert done.stdout.startswith(str(checkout)) or "site-packages" in done.stdout


@pytest.mark.parametrize(
    ("text", "version", "cause", "remedy"),
    [
        (
            "ImportError('numpy.core.multiarray failed to import')",
            "2.4.6",
            "but its binary interface does not fit numpy 2.4.6 in /",
            'pip install "numpy<2"',
        ),
        (
            "ValueError('numpy.dtype size changed, may indicate binary incompatibility')",
            "1.24.2",
            "but its binary interface does not fit numpy 1.24.2 in /",
            "pip install --force-reinstall cv2",
        ),
        ("RuntimeError('broken')", "1.24.2", "but its import fails: broken", " --reinstall "),
    ],
)
def test_an_installed_package_that_cannot_be_imported_names_the_cause(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    text: str,
    version: str,
    cause: str,
    remedy: str,
) -> None:
    (tmp_path / "cv2.py").write_text(f"raise {text}")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "cv2", raising=False)
    monkeypatch.setattr("importlib.metadata.version", lambda _name: version)
    with pytest.raises(MissingPackageError) as caught:
        require("cv2", "videos need")
    error = str(caught.value)
    assert error.startswith(f"videos need OpenCV, which is installed in {tmp_path}, {cause}")
    assert remedy in error.rpartition(": ")[2]
