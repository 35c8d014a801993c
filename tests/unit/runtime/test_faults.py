"""Handling of exceptions of plugins, subscribers and observers."""

from __future__ import annotations

import logging
from types import SimpleNamespace
from typing import Any

import pytest

from flatland.runtime.faults import Faults


def take(faults: Faults, hook: str = "hook", plugin: object = "p", text: str = "broken") -> bool:
    try:
        raise RuntimeError(text)
    except RuntimeError as error:
        return faults.add_of_plugin(plugin, hook, hook, "Plugin P", error)


def test_an_unknown_policy_raises() -> None:
    wrong: Any = "ignore"
    with pytest.raises(ValueError, match=r"must be 'raise' or 'disable', got 'ignore'"):
        Faults(wrong)


def test_the_log_has_one_traceback_per_second_and_source(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    caplog.set_level(logging.ERROR, "flatland")
    monkeypatch.setattr("flatland.runtime.faults.time", SimpleNamespace(monotonic=lambda: 100.0))
    faults = Faults("disable")
    for plugin in ("p", "q"):
        take(faults, plugin=plugin)
        take(faults, plugin=plugin)
    assert caplog.text.count("RuntimeError: broken") == 2
    assert caplog.text.count("Plugin P: hook raised\n") == 2


def test_faults_of_removed_plugins_are_dropped() -> None:
    faults = Faults("disable")
    assert not take(faults)
    assert not take(faults)
    faults.forget({"p"})
    assert not faults.counts
    assert not take(faults)
