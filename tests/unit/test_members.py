"""The members of the package, which are imported when they are first used."""

from __future__ import annotations

import ast
import sys
from pathlib import Path

import pytest
from programs import run_program

import flatland

SOURCE = Path(flatland.__file__).read_text()


def test_all_members_exist() -> None:
    for name in flatland.__all__:
        member = getattr(flatland, name)
        assert getattr(member, "__name__", name) in (name, "from_yaml")
    assert set(flatland.__all__) <= set(dir(flatland))


def test_members_for_type_checkers_are_those_at_run_time() -> None:
    (block,) = (node for node in ast.parse(SOURCE).body if isinstance(node, ast.If))
    typed = {
        alias.name: node.module
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert typed == flatland._MODULES
    assert {*typed, "load_world"} == set(flatland.__all__)


def test_modules_are_members() -> None:
    code = "import flatland; print(flatland.physics.PhysicsWorld.__name__)"
    done = run_program([sys.executable, "-c", code])
    assert done.stdout == "PhysicsWorld\n", done.stderr


def test_unknown_members_raise() -> None:
    with pytest.raises(AttributeError, match="module 'flatland' has no attribute 'Worlds'"):
        flatland.Worlds  # noqa: B018
    assert not hasattr(flatland, "_unknown")


def test_a_module_whose_packages_are_missing_is_no_member() -> None:
    code = (
        "import sys; sys.modules['gymnasium'] = None\n"
        "import flatland; print(hasattr(flatland, 'gym'))\n"
        "flatland.gym"
    )
    done = run_program([sys.executable, "-c", code])
    assert done.stdout == "False\n", done.stderr
    assert "AttributeError: module 'flatland' has no attribute 'gym': " in done.stderr


def test_the_node_publishes_its_time_before_the_simulation_is_imported() -> None:
    code = (
        "import sys\n"
        "import flatland.ros.node, flatland.node.clock, flatland.ros.parameter_server\n"
        "import flatland.ros.logs, flatland.ros.transport.inbound\n"
        "import flatland.ros.transport.ros_transport\n"
        "late = ('world', 'simulation', 'values', 'plugin_api', 'config', 'physics', '_core')\n"
        "print([name for name in late if 'flatland.' + name in sys.modules])\n"
    )
    done = run_program([sys.executable, "-c", code])
    assert done.stdout == "[]\n", done.stdout + done.stderr
