"""The benchmark of the plugins measures all of them."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest

from flatland.plugin_api.manifest import INCLUDED_PACKAGE
from flatland.plugin_api.registry import PluginRegistry


def test_every_included_plugin_is_measured(checkout: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(checkout / "bench"))
    plugin_steps = importlib.import_module("plugin_steps")
    classes = [name.split("::") for name in PluginRegistry().classes]
    included = {name for package, name in classes if package == INCLUDED_PACKAGE}
    assert set(plugin_steps.PARAMETERS) == included
    with plugin_steps.world_with("Pedestrians") as world:
        assert len(world.plugins) == 1
