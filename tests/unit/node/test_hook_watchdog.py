"""Reports of plugins that block the simulation."""

from __future__ import annotations

import threading
from collections.abc import Callable

import pytest
from waiting import TIMEOUT, wait_until

import flatland
from flatland.node.hook_watchdog import LIMIT, HookWatchdog


class Blocking(flatland.ModelPlugin):
    """A plugin whose hook returns at the end of an action."""

    def hook(self, action: Callable[[], None]) -> None:
        action()


@pytest.fixture
def watchdog(empty_world: flatland.World, monkeypatch: pytest.MonkeyPatch) -> HookWatchdog:
    """A watchdog whose checks the test makes itself."""
    monkeypatch.setattr(HookWatchdog, "_run", lambda _self: None)
    return HookWatchdog(empty_world)


def test_a_call_that_does_not_return_is_reported_once(
    empty_world: flatland.World, watchdog: HookWatchdog, caplog: pytest.LogCaptureFixture
) -> None:
    requests = empty_world.requests

    def wait() -> None:
        for now in (0.0, 1.0, 0.9 + LIMIT):
            watchdog._check(now)
        assert requests.blocked_by == ""
        for now in (1.1 + LIMIT, 8.0):
            watchdog._check(now)
        assert requests.blocked_by == "Blocking: hook"

    Blocking().hook(wait)
    (error,) = caplog.records
    assert error.getMessage().startswith("Blocking: hook has not returned for 5 s, the simulation")
    assert "in wait" in error.getMessage()
    watchdog._check(9.0)
    assert requests.blocked_by == ""
    assert "Blocking: hook has returned after 8 s" in caplog.text


def test_calls_while_the_time_advances_are_not_reported(
    empty_world: flatland.World, watchdog: HookWatchdog, caplog: pytest.LogCaptureFixture
) -> None:
    def work() -> None:
        for now in (0.0, 10.0, 20.0):
            empty_world.timekeeper.sim_time_ns += 5_000_000
            watchdog._check(now)

    Blocking().hook(work)
    assert caplog.records == []


def test_a_check_that_fails_is_logged_and_repeated(
    empty_world: flatland.World, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("flatland.node.hook_watchdog._POLL_PERIOD", 0.01)

    def fail(_self: HookWatchdog, _now: float) -> None:
        raise RuntimeError("no frame")

    monkeypatch.setattr(HookWatchdog, "_check", fail)
    watchdog = HookWatchdog(empty_world)
    wait_until("two checks", lambda: len(caplog.records) > 1)
    watchdog.close()
    assert "cannot inspect the thread of the simulation" in caplog.text
    assert "RuntimeError: no frame" in caplog.text


def test_the_thread_of_the_simulation_is_watched_until_the_end(
    empty_world: flatland.World, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("LIMIT", "_POLL_PERIOD"):
        monkeypatch.setattr(f"flatland.node.hook_watchdog.{name}", 0.01)
    before = set(threading.enumerate())
    watchdog = HookWatchdog(empty_world)
    # A ROS node of other tests in this process starts threads at any time.
    started = set(threading.enumerate()) - before
    [thread] = [each for each in started if each.name == "flatland-hook-watchdog"]
    assert thread.daemon
    Blocking().hook(lambda: wait_until("the report", lambda: empty_world.requests.blocked_by))
    wait_until("the end", lambda: not empty_world.requests.blocked_by)
    watchdog.close()
    thread.join(TIMEOUT)
    assert not thread.is_alive()
