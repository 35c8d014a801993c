"""Refused files of one node: the response, and that the node is as before.

Other refused calls are in `test_services.py`, the messages of errors in `tests/unit/bad_input`.
The node has `~model_path`: it reads only files in the folder of the world and in another one.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from waiting import wait_until

GOOD = "bodies: [{name: base, footprints: []}]\n"


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    return write_world("[{name: first, model: robot.model.yaml, namespace: first}]")


@pytest.fixture(scope="module")
def outside(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that the node must not read."""
    folder = tmp_path_factory.mktemp("outside")
    (folder / "good.yaml").write_text(GOOD)
    (folder / "body.yaml").write_text("[{name: base, footprints: []}]\n")
    return folder


@pytest.fixture(scope="module")
def other(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A second folder that the node reads."""
    folder = tmp_path_factory.mktemp("other")
    (folder / "sub").mkdir()
    (folder / "sub" / "good.yaml").write_text(GOOD)
    return folder


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, world: Path, other: Path) -> Any:
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
    registered = module_ros.registered()
    yield
    assert module_ros.registered() == registered
    assert "does not exist" in module_ros.delete("new").message
    assert module_ros.spawn("robot.model.yaml", "later", "later", (2, 2, 0)).success
    assert module_ros.delete("later").success

    def is_as_before() -> bool:
        now = node_resources(server)
        assert now[0] <= threads, f"{now[0]} threads, {threads} before"
        assert len(now[1]) <= len(descriptors), f"{now[1]}\n{descriptors} before"
        return True

    wait_until("the threads and descriptors of before", is_as_before)
    assert server.running


def test_files_in_and_outside_of_model_path(
    module_ros: Any, outside: Path, other: Path, world: Path
) -> None:
    for path in ("ball.model.yaml", f"{other}/sub/good.yaml"):
        answer = module_ros.spawn(path, "new", "", (1, 1, 0))
        assert (answer.success, answer.message) == (True, "")
        assert module_ros.delete("new").success
    answer = module_ros.spawn(f"../{outside.name}/good.yaml", "new")
    assert (answer.success, answer.message) == (
        False,
        f'Flatland YAML: Failed to read file, path="{outside}/good.yaml", it is outside the '
        f"folders of model_path, {world.parent}, {other}",
    )
    # Text is not restricted, but its includes are.
    assert module_ros.spawn(f"{{{GOOD.strip()}}}", "new").success
    assert module_ros.delete("new").success
    answer = module_ros.spawn(f"{{bodies: $include {outside}/body.yaml}}", "new")
    assert answer.success is False
    assert "outside the folders of model_path" in answer.message
