"""Invalid service calls of one node: the response, and that the node is as before.

The node has `~model_path`: it reads only files in the folder of the world and in another one.
"""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from waiting import wait_until

NAN, INF = math.nan, math.inf
GOOD = "bodies: [{name: base, footprints: []}]\n"
BROKEN = """
bodies: [{name: base, footprints: []}]
plugins:
  - type: Laser
    name: p
    rang: 5
    body: base
    angle: {min: 0, max: 1, increment: 1}
"""


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


def node_resources(server: Any) -> tuple[int, list[str]]:
    """Returns the number of threads of the node, and what its file descriptors refer to."""
    folder = Path(f"/proc/{server.pid}")
    descriptors = []
    for path in (folder / "fd").iterdir():
        with contextlib.suppress(FileNotFoundError):  # closed in the meantime
            descriptors.append(str(path.readlink()))
    return len(list((folder / "task").iterdir())), sorted(descriptors)


@pytest.fixture(scope="module", autouse=True)
def unchanged_node(server: Any, module_ros: Any) -> Iterator[None]:
    """Checks that all calls of this file together leave nothing behind."""
    # Connections and threads that remain: of the node itself, then of the first calls.
    module_ros.wait_until_ready()
    wait_until("the connection of rosout", lambda: "/rosout" in module_ros.connected_topics())
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
        assert now[0] <= threads, f"{now[0]} threads, {threads} before"
        assert len(now[1]) <= len(descriptors), f"{now[1]}\n{descriptors} before"
        return True

    wait_until("the threads and descriptors of before", is_as_before)
    assert server.running


@pytest.fixture(scope="module")
def registered(unchanged_node: None, module_ros: Any) -> dict[str, set[str]]:
    """What the node has registered before the first test."""
    del unchanged_node
    found: dict[str, set[str]] = module_ros.registered()
    return found


@pytest.fixture(autouse=True)
def unchanged_topics(module_ros: Any, registered: dict[str, set[str]]) -> Iterator[None]:
    """Checks that a call leaves no topic and no model."""
    yield
    assert module_ros.registered() == registered
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
    "relative": ("../{outside_name}/good.yaml", "{outside}/good.yaml"),
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


def test_a_broken_model(module_ros: Any, world: Path) -> None:
    """`tests/unit/bad_input` tests the message of each error; this is that of a response."""
    path = world.parent / "broken.yaml"
    path.write_text(BROKEN)
    answer = module_ros.spawn("broken.yaml", "new", "new")
    assert (answer.success, answer.message) == (
        False,
        'Flatland plugin: Model Plugin "p" type "Laser" model "new": Flatland YAML: Entry "range" '
        f'does not exist (in model "new" plugin "p") [{path}:4] (hint: "rang" in line 6 may be a '
        'misspelling of "range")',
    )


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


def test_text_is_not_restricted_but_its_includes_are(module_ros: Any, outside: Path) -> None:
    assert module_ros.spawn(f"{{{GOOD.strip()}}}", "new").success
    assert module_ros.delete("new").success
    answer = module_ros.spawn(f"{{bodies: $include {outside}/body.yaml}}", "new")
    assert answer.success is False
    assert "outside the folders of model_path" in answer.message


def test_an_expression_cannot_add_an_include(module_ros: Any) -> None:
    answer = module_ros.spawn("eval.yaml", "new")
    assert answer.success is False
    assert "must be a list" in answer.message
