"""Handling of exceptions of plugins, subscribers and observers."""

from __future__ import annotations

import logging
from typing import Any

import pytest

from flatland import PluginError
from flatland.runtime.faults import MAX_FAULTS, Faults


def take(faults: Faults, hook: str = "hook", plugin: object = "p", text: str = "broken") -> bool:
    try:
        raise RuntimeError(text)
    except RuntimeError as error:
        return faults.add_in_hook(plugin, hook, "Plugin P", error)


def test_an_unknown_policy_raises() -> None:
    wrong: Any = "ignore"
    with pytest.raises(ValueError, match=r"must be 'raise' or 'disable', got 'ignore'"):
        Faults(wrong)


def test_the_first_exception_is_raised_once_and_names_its_source() -> None:
    faults = Faults("raise")
    assert not take(faults, text="first")
    assert not any(take(faults, text="later") for _ in range(2 * MAX_FAULTS))
    with pytest.raises(RuntimeError, match="first") as caught:
        faults.raise_first()
    assert caught.value.__notes__ == ["raised by Plugin P: hook"]
    faults.raise_first()


def test_sys_exit_of_a_plugin_becomes_an_error() -> None:
    faults = Faults("raise")
    try:
        raise SystemExit(3)
    except SystemExit as error:
        faults.add("p", "Plugin P: hook", error)
    with pytest.raises(PluginError, match=r"Plugin P: hook raised SystemExit\(3\)") as caught:
        faults.raise_first()
    assert isinstance(caught.value.__cause__, SystemExit)


def test_three_faults_of_one_hook_in_a_row_disable_a_plugin(
    caplog: pytest.LogCaptureFixture,
) -> None:
    faults = Faults("disable")
    assert [take(faults) for _ in range(3)] == [False, False, True]
    assert "Plugin P: hook raised 3 times in a row, the plugin is disabled" in caplog.text
    faults.raise_first()


def test_a_successful_call_resets_the_count_of_faults() -> None:
    faults = Faults("disable")
    for _ in range(5):
        assert not take(faults)
        assert not take(faults)
        assert not take(faults, hook="other")
        assert faults.counts
        faults.succeeded("p", "hook")
        faults.succeeded("p", "other")
    assert not faults.counts


def test_the_log_has_one_traceback_per_second_and_source(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.ERROR, "flatland")
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
