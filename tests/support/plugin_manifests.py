"""Manifests of plugins that tests declare."""

from __future__ import annotations

import re
from pathlib import Path
from textwrap import dedent

_CLASS = re.compile(r"^class ([A-Z]\w*)\(.*\b(Model|World)Plugin\):", re.MULTILINE)


def manifest(declared: dict[str, str]) -> str:
    """Returns a manifest of classes by dotted path, each with its base, `Model` or `World`.

    The name of a plugin is that of its class after `test::`.
    """
    entries = "".join(
        f'<class name="test::{path.rpartition(".")[2]}" type="{path}" '
        f'base_class_type="flatland::{base}Plugin"/>'
        for path, base in declared.items()
    )
    return f'<library path=".">{entries}</library>'


def write_plugins(folder: Path, source: str, module: str) -> str:
    """Writes a module and a manifest that declares all plugins in it; returns its path."""
    text = dedent(source)
    (folder / f"{module}.py").write_text(text)
    path = folder / f"{module}.xml"
    path.write_text(manifest({f"{module}.{name}": base for name, base in _CLASS.findall(text)}))
    return str(path)
