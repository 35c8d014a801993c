"""The rooms of the package: which one may import which at run time."""

from __future__ import annotations

import ast
import functools
import graphlib
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from programs import run_program

# From the bottom up. A module imports only from floors below its own and from its own room.
FLOORS = (
    ("checks", "errors", "uncopied"),
    (
        "defaults",
        "foreign_texts",
        "geometry",
        "graph_names",
        "output_files",
        "requirements",
        "ros_addresses",
        "streams",
        "suggestions",
        "timekeeper",
        "version",
    ),
    ("controllers", "extras", "physics", "values"),
    ("config", "entities"),
    ("copying", "maps", "plugin_api"),
    ("loading", "worldgen"),
    ("plugins",),
    ("runtime",),
    ("world",),
    ("scene",),
    ("simulation", "drawing", "recording"),
    ("web",),
    ("gym", "node", "tools"),
    ("ros", "ros2"),
    ("scenarios",),
    ("viewer",),
    ("cli",),
    ("__main__",),
)
# The extension, imported by this room only; the generated code, imported by name in
# flatland/ros/message_types.py.
SPECIAL: dict[str, set[str]] = {"_core": {"physics"}, "msg": set(), "srv": set()}
# What a facade imports late on purpose, within a function.
LATE = {("world", "drawing"), ("world", "recording"), ("world", "web")}
PACKAGE = Path(__file__).resolve().parents[2] / "flatland"


@dataclass(frozen=True)
class Import:
    """An import by a module of the package."""

    module: str
    name: str
    kind: str  # "type", "late" or "run"

    @property
    def room(self) -> str:
        return room_of(self.module)

    @property
    def target(self) -> str:
        """Room of the imported module."""
        return room_of(self.name)


def room_of(module: str) -> str:
    """Returns the first part of a dotted name below `flatland`, empty for the package itself."""
    return module.split(".")[1] if "." in module else ""


def module_of(path: Path) -> str:
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts).removesuffix(".__init__")


@functools.cache
def syntax_trees() -> dict[str, ast.AST]:
    """Returns the syntax trees of all modules except the generated messages."""
    modules = {module_of(path): path for path in sorted(PACKAGE.rglob("*.py"))}
    return {
        name: ast.parse(path.read_text())
        for name, path in modules.items()
        if room_of(name) not in ("msg", "srv")
    }


@functools.cache
def imports() -> list[Import]:
    """Returns the imports of all modules."""
    found = []
    for module, tree in syntax_trees().items():
        for node, kind in import_nodes(tree, "run"):
            found += [Import(module, name, kind) for name in imported_names(node)]
    return found


def import_nodes(tree: ast.AST, kind: str) -> Iterator[tuple[ast.Import | ast.ImportFrom, str]]:
    for node in ast.iter_child_nodes(tree):
        inner = kind
        if isinstance(node, ast.FunctionDef) and kind == "run":
            inner = "late"
        elif isinstance(node, ast.If) and is_type_checking(node.test):
            inner = "type"
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            yield node, inner
        elif isinstance(node, (ast.stmt, ast.excepthandler, ast.match_case)):
            yield from import_nodes(node, inner)


def is_type_checking(test: ast.expr) -> bool:
    return isinstance(test, ast.Name) and test.id == "TYPE_CHECKING"


def imported_names(node: ast.Import | ast.ImportFrom) -> list[str]:
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    assert node.level == 0
    if node.module == "flatland":
        return [f"flatland.{alias.name}" for alias in node.names]
    return [node.module or ""]


def floor_of(room: str) -> int:
    for number, rooms in enumerate(FLOORS):
        if room in rooms:
            return number
    pytest.fail(f'room "{room}" has no floor; add it to FLOORS and to docs/architecture.md')


def run_time_imports() -> list[Import]:
    """Returns the imports of modules of the package that are carried out."""
    package = [found for found in imports() if found.name.split(".")[0] == "flatland"]
    return [found for found in package if found.kind != "type"]


def test_every_room_has_a_floor() -> None:
    for entry in PACKAGE.iterdir():
        if entry.suffix in (".py", "") and entry.name not in ("__init__.py", "__pycache__"):
            room = entry.stem
            assert room in SPECIAL or floor_of(room) >= 0


def test_modules_import_only_from_rooms_below_their_own() -> None:
    wrong = []
    for found in run_time_imports():
        if found.room in ("", found.target) or found.target in ("", *SPECIAL):
            continue  # within a room, or the facade flatland/__init__.py
        if (found.room, found.target) in LATE and found.kind == "late":
            continue
        if floor_of(found.target) >= floor_of(found.room):
            wrong.append(f"{found.module} imports from {found.target}")
    assert wrong == []


def test_the_plugin_api_does_not_refer_to_the_running_world() -> None:
    """Not even for types: a plugin gets what it needs of a world by `PluginWorld`."""
    above = {room for rooms in FLOORS[floor_of("runtime") :] for room in rooms}
    package = [each for each in imports() if each.name.startswith("flatland.")]
    assert [each for each in package if each.room == "plugin_api" and each.target in above] == []


def test_modules_do_not_import_each_other_in_circles() -> None:
    """Not even for types, apart from a model, its plugins, and what these use of a world."""
    modules = syntax_trees().keys() - {"flatland"}  # without the facade
    targets: dict[str, set[str]] = {}
    for module in modules:
        found: set[str] = set()
        for node, kind in import_nodes(syntax_trees()[module], "run"):
            if isinstance(node, ast.ImportFrom) and kind != "late":
                names = {f"{node.module}.{alias.name}" for alias in node.names}
                found |= (names & modules) or ({str(node.module)} & modules)
        targets[module] = found - {module}
    known = {"entities.model", "plugin_api.plugin", "plugin_api.plugin_world"}
    circle = {f"flatland.{name}" for name in known}
    for module in circle:
        targets[module] -= circle
    graphlib.TopologicalSorter(targets).prepare()  # raises for a circle


def test_only_one_room_imports_the_extension_and_none_a_fixed_message_package() -> None:
    for found in run_time_imports():
        if found.target in SPECIAL:
            assert found.room in SPECIAL[found.target], found.module
    assert [each.module for each in imports() if each.name.startswith("flatland_msgs")] == []


def test_only_front_ends_import_the_facade() -> None:
    front_ends = {found.module for found in run_time_imports() if found.target == ""}
    assert front_ends <= {"flatland.cli.main"}


def test_plugins_do_not_import_each_other() -> None:
    package = "flatland.plugins"
    for found in imports():
        if found.module.startswith(package) and found.name.startswith(package):
            target = found.name.removeprefix(package).removeprefix(".").split(".")[0]
            assert target.startswith("_"), found


def test_the_room_of_the_node_imports_no_module_of_ros() -> None:
    """Neither directly nor by another module, so that clients of several kinds of ROS share it."""
    modules = [module_of(path) for path in sorted((PACKAGE / "node").rglob("*.py"))]
    code = (
        "import importlib, sys\n"
        "for name in ('rospy', 'rosgraph', 'genpy', 'rosbag', 'rclpy', 'flatland.ros'):\n"
        "    sys.modules[name] = None\n"
        f"for name in {modules}:\n"
        "    importlib.import_module(name.removesuffix('.__init__'))\n"
        "messages = ('flatland.msg', 'flatland.srv')\n"
        "print([name for name in sys.modules if name.endswith('_msgs') or name in messages])\n"
    )
    done = run_program([sys.executable, "-c", code])
    assert done.stdout == "[]\n", done.stdout + done.stderr
