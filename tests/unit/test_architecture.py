"""The rooms of the package: which one may import which at run time."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

# From the bottom up. A module imports only from floors below its own and from its own room.
FLOORS = (
    ("defaults", "errors", "geometry", "graph_names", "requirements", "timekeeper", "version"),
    ("physics", "values"),
    ("config", "entities"),
    ("copying", "maps", "plugin_api"),
    ("loading", "plugins", "worldgen"),
    ("runtime",),
    ("world",),
    ("simulation", "drawing", "recording"),
    ("web",),
    ("gym", "ros", "tools"),
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
    """An import of one module of the package by another."""

    module: str
    room: str
    target: str
    kind: str  # "type", "late" or "run"


def room_of(module: str) -> str:
    """Returns the first part of a dotted name below `flatland`, empty for the package itself."""
    return module.split(".")[1] if "." in module else ""


def imports() -> Iterator[Import]:
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
        if parts[1] in ("msg", "srv"):
            continue
        module = ".".join(parts).removesuffix(".__init__")
        for node, kind in nodes(ast.parse(path.read_text()), "run"):
            for name in imported_names(node):
                assert not name.startswith("flatland_msgs"), module
                if name == "flatland" or name.startswith("flatland."):
                    yield Import(module, room_of(module), room_of(name), kind)


def nodes(tree: ast.AST, kind: str) -> Iterator[tuple[ast.AST, str]]:
    for node in ast.iter_child_nodes(tree):
        inner = kind
        if isinstance(node, ast.FunctionDef) and kind == "run":
            inner = "late"
        elif isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            inner = "type"
        yield node, inner
        yield from nodes(node, inner)


def imported_names(node: ast.AST) -> list[str]:
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom):
        assert node.level == 0
        if node.module == "flatland":
            return [f"flatland.{alias.name}" for alias in node.names]
        return [node.module or ""]
    return []


def floor_of(room: str) -> int:
    for number, rooms in enumerate(FLOORS):
        if room in rooms:
            return number
    pytest.fail(f'room "{room}" has no floor; add it to FLOORS and to docs/architecture.md')


ALL = [found for found in imports() if found.kind != "type"]


def test_every_room_has_a_floor() -> None:
    for entry in PACKAGE.iterdir():
        if entry.suffix in (".py", "") and entry.name not in ("__init__.py", "__pycache__"):
            room = entry.stem
            assert room in SPECIAL or floor_of(room) >= 0


def test_modules_import_only_from_rooms_below_their_own() -> None:
    wrong = []
    for found in ALL:
        if found.room in ("", found.target) or found.target in ("", *SPECIAL):
            continue  # within a room, or the facade flatland/__init__.py
        if (found.room, found.target) in LATE and found.kind == "late":
            continue
        if floor_of(found.target) >= floor_of(found.room):
            wrong.append(f"{found.module} imports from {found.target}")
    assert wrong == []


def test_only_one_room_imports_the_extension_and_none_a_fixed_message_package() -> None:
    for found in ALL:
        if found.target in SPECIAL:
            assert found.room in SPECIAL[found.target], found.module


def test_only_front_ends_import_the_facade() -> None:
    assert {found.module for found in ALL if found.target == ""} <= {"flatland.cli.main"}


def test_plugins_and_adapters_do_not_import_each_other() -> None:
    for package, shared in (("plugins", ()), ("ros/adapters", ("convert", ""))):
        prefix = f"flatland.{package.replace('/', '.')}"
        for path in (PACKAGE / package).glob("*.py"):
            for node, _ in nodes(ast.parse(path.read_text()), "run"):
                for name in imported_names(node):
                    if name.startswith(prefix):
                        target = name.removeprefix(prefix).removeprefix(".").split(".")[0]
                        assert target.startswith("_") or target in shared, f"{path} imports {name}"


def test_the_exceptions_are_used() -> None:
    late = {(found.room, found.target) for found in ALL if found.kind == "late"}
    assert late >= LATE


def test_the_world_is_a_facade_of_at_most_350_lines() -> None:
    assert len((PACKAGE / "world.py").read_text().splitlines()) <= 350
