"""Invalid service calls of one node: the response, and that the node is as before.

The node has `~model_path`: it reads only files in the folder of the world and in another one.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from broken_yaml import Case, Key, Section, cases
from waiting import wait_until

from flatland.srv import SetRate

NAN, INF = math.nan, math.inf
GOOD = "bodies: [{name: base, footprints: []}]\n"


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    return write_world("[{name: first, model: robot.model.yaml, namespace: first}]")


@pytest.fixture(scope="module")
def outside(tmp_path_factory: pytest.TempPathFactory, world: Path) -> Path:
    """A folder that the node must not read, with links to it in the folder of the world."""
    folder = tmp_path_factory.mktemp("outside")
    (folder / "good.yaml").write_text(GOOD)
    (folder / "body.yaml").write_text("[{name: base, footprints: []}]\n")
    allowed = world.parent
    (allowed / "link.yaml").symlink_to(folder / "good.yaml")
    (allowed / "folder_link").symlink_to(folder)
    (allowed / "proc_link.yaml").symlink_to(f"/proc/self/root{folder}/good.yaml")
    (allowed / "outer.yaml").write_text(f"bodies: $include {folder}/body.yaml\n")
    (allowed / "inner.yaml").write_text("bodies: $include folder_link/body.yaml\n")
    (allowed / "items.yaml").write_text(f"bodies:\n  - $[include] {folder}/nothing.yaml\n")
    (allowed / "eval.yaml").write_text(f"bodies: $eval return '$include {folder}/body.yaml'\n")
    return folder


@pytest.fixture(scope="module")
def other(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A second folder that the node reads."""
    folder = tmp_path_factory.mktemp("other")
    (folder / "sub").mkdir()
    (folder / "sub" / "good.yaml").write_text(GOOD)
    return folder


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, world: Path, outside: Path, other: Path) -> Any:
    del outside
    return module_launcher.server(world, model_path=f"{world.parent}:{other}", update_rate=50)


def node_resources(server: Any) -> tuple[int, int]:
    """Returns the numbers of threads and file descriptors of the node."""
    folder = Path(f"/proc/{server._popen.pid}")
    return len(list((folder / "task").iterdir())), len(list((folder / "fd").iterdir()))


@pytest.fixture(scope="module", autouse=True)
def unchanged_node(server: Any, module_ros: Any) -> Iterator[None]:
    """Checks that all calls of this file together leave nothing behind."""
    # The first calls open connections and start threads that remain.
    for _ in range(3):
        assert module_ros.spawn("robot.model.yaml", "new", "new", (2, 2, 0)).success
        assert module_ros.delete("new").success
        assert not module_ros.spawn("missing.yaml", "m").success
        assert not module_ros.move("nobody", (0, 0, 0)).success
    threads, descriptors = node_resources(server)
    yield
    assert module_ros.spawn("robot.model.yaml", "later", "later", (2, 2, 0)).success
    assert module_ros.delete("later").success

    def is_as_before() -> bool:
        now = node_resources(server)
        return now[0] <= threads and now[1] <= descriptors

    wait_until("the threads and descriptors of before", is_as_before)
    assert server.running


@pytest.fixture(autouse=True)
def unchanged_topics(module_ros: Any) -> Iterator[None]:
    """Checks that a call leaves no topic and no model."""
    before = module_ros.registered()
    yield
    assert module_ros.registered() == before
    answer = module_ros.delete("new")
    assert "does not exist" in answer.message


SPAWNS: dict[str, tuple[str, str, str, tuple[float, float, float], str]] = {
    "no name": ("ball.model.yaml", "", "", (0, 0, 0), "Flatland World: failed to spawn model, its "
                "name must not be empty"),
    "name in use": ("ball.model.yaml", "first", "", (0, 0, 0),
                    'Flatland YAML: Model with name "first" already exists'),
    "no path": ("", "new", "", (0, 0, 0),
                'Flatland World: failed to spawn model "new", the path must not be empty'),
    "illegal namespace": ("ball.model.yaml", "new", "my robot", (0, 0, 0),
                          'Flatland World: failed to spawn model "new", namespace "my robot" is '
                          "not a legal ROS name: it must start with a letter and hold only "
                          'letters, digits, "_" and "/"'),
    "folder": (".", "new", "", (0, 0, 0),
               'Flatland YAML: Failed to read file, path="{world}", it is not a regular file'),
    "missing": ("zzz.qqq", "new", "", (0, 0, 0),
                'Flatland YAML: File does not exist, path="{world}/zzz.qqq"'),
    "similar name": ("bal.model.yaml", "new", "", (0, 0, 0),
                     'Flatland YAML: File does not exist, path="{world}/bal.model.yaml" (hint: did '
                     'you mean "ball.model.yaml"?)'),
    "a map": ("map.yaml", "new", "", (0, 0, 0),
              'Flatland YAML: Entry "bodies" does not exist (in model "new") [{world}/map.yaml:1]'),
}  # fmt: skip
NUMBERS = (NAN, INF, -INF, 1e308)
REFUSED = {
    "absolute": ("{outside}/good.yaml", "{outside}/good.yaml"),
    "relative": ("../{outside_name}/good.yaml", "{world}/../{outside_name}/good.yaml"),
    "missing": ("{outside}/nothing.yaml", "{outside}/nothing.yaml"),
    "link to a file": ("link.yaml", "{world}/link.yaml"),
    "link to a folder": ("folder_link/good.yaml", "{world}/folder_link/good.yaml"),
    "link through /proc": ("proc_link.yaml", "{world}/proc_link.yaml"),
    "device": ("/dev/zero", "/dev/zero"),
    "password file": ("/etc/passwd", "/etc/passwd"),
    "similar start of the path": ("{world}2/good.yaml", "{world}2/good.yaml"),
}
REFUSED_INCLUDES = {
    "include": ("outer.yaml", "{outside}/body.yaml", 1),
    "include through a link": ("inner.yaml", "{world}/folder_link/body.yaml", 1),
    "include of documents": ("items.yaml", "{outside}/nothing.yaml", 2),
}


@pytest.fixture
def fill(world: Path, outside: Path, other: Path) -> Callable[[str], str]:
    """Inserts the folders into a text."""
    return lambda text: text.format(
        world=world.parent, outside=outside, outside_name=outside.name, other=other
    )


@pytest.mark.parametrize("name", SPAWNS)
def test_spawn_model(module_ros: Any, fill: Callable[[str], str], name: str) -> None:
    path, model, namespace, pose, message = SPAWNS[name]
    answer = module_ros.spawn(path, model, namespace, pose)
    assert answer.success is False
    assert re.sub(r" \(hint: (?!did you).*\)$", "", answer.message) == fill(message)


@pytest.mark.parametrize("number", NUMBERS)
@pytest.mark.parametrize("index", range(3))
def test_a_pose_that_is_not_finite_or_out_of_range(
    module_ros: Any, index: int, number: float
) -> None:
    pose = [0.0, 0.0, 0.0]
    pose[index] = number
    answer = module_ros.spawn("ball.model.yaml", "new", "", pose)
    assert answer.success is False
    assert answer.message.startswith("Flatland ")
    answer = module_ros.move("first", pose)
    assert answer.success is False
    assert answer.message.startswith('Flatland World: failed to move model "first", ')


def test_requests_for_models_that_do_not_exist(module_ros: Any) -> None:
    for name in ("nobody", "", "firs", "first/", "\N{SNOWMAN}"):
        for verb, answer in (
            ("delete", module_ros.delete(name)),
            ("move", module_ros.move(name, (0, 0, 0))),
        ):
            assert (answer.success, answer.message) == (
                False,
                f'Flatland World: failed to {verb} model, model with name "{name}" does not exist',
            )


@pytest.mark.parametrize("rate", [NAN, -1.0, -INF])
def test_set_rate(module_ros: Any, rate: float) -> None:
    answer = module_ros.call("/set_rate", SetRate, rate)
    assert answer.success is False
    assert answer.message == f"update_rate must not be negative, got {rate}"


LASER = Section(
    "Laser",
    "bodies: [{name: base, footprints: []}]\nplugins:\n  - type: Laser\n    name: p\n"
    "    angle: {min: 0, max: 1, increment: 1}\n",
    (
        Key("body", "base", required=True),
        Key("range", "5", "float", required=True),
        Key("update_rate", "10", "float", limit=">= 0"),
    ),
    lead=3,
    indent=4,
    location='model "new" plugin "p"',
    label='plugin "p"',
    label_location='model "new"',
    prefix='Flatland plugin: Model Plugin "p" type "Laser" model "new": Flatland YAML: ',
    error_class="PluginError",
)


@pytest.mark.parametrize("case", list(cases(LASER)), ids=lambda case: case.name)
def test_a_broken_model(module_ros: Any, world: Path, case: Case) -> None:
    path = world.parent / "broken.yaml"
    path.write_text(case.text)
    answer = module_ros.spawn("broken.yaml", "new", "new")
    assert answer.success is False
    assert answer.message.startswith(f"{case.message} [{path}:{case.line}]")
    if case.hint is not None:
        assert answer.message.endswith(f" (hint: {case.hint})")


@pytest.mark.parametrize("name", REFUSED)
def test_files_outside_model_path(module_ros: Any, fill: Callable[[str], str], name: str) -> None:
    path, shown = REFUSED[name]
    answer = module_ros.spawn(fill(path), "new")
    why = fill("it is outside the folders of model_path, {world}, {other}")
    expected = f'Flatland YAML: Failed to read file, path="{fill(shown)}", {why}'
    assert (answer.success, answer.message) == (False, expected)


@pytest.mark.parametrize("name", REFUSED_INCLUDES)
def test_includes_outside_model_path(
    module_ros: Any, fill: Callable[[str], str], name: str
) -> None:
    path, shown, line = REFUSED_INCLUDES[name]
    answer = module_ros.spawn(path, "new")
    why = fill("it is outside the folders of model_path, {world}, {other}")
    place = fill(f" [{{world}}/{path}:{line}]")
    expected = f'Flatland YAML: Failed to read file, path="{fill(shown)}", {why}{place}'
    assert (answer.success, answer.message) == (False, expected)


def test_files_in_model_path(module_ros: Any, other: Path, world: Path) -> None:
    for path in ("ball.model.yaml", f"{other}/sub/good.yaml", f"{world.parent}/./ball.model.yaml"):
        answer = module_ros.spawn(path, "new", "", (1, 1, 0))
        assert (answer.success, answer.message) == (True, "")
        assert module_ros.delete("new").success


def test_an_expression_cannot_add_an_include(module_ros: Any) -> None:
    answer = module_ros.spawn("eval.yaml", "new")
    assert answer.success is False
    assert "must be a list" in answer.message
