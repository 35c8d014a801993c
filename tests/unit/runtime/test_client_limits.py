"""Limits of what clients of a server can cause."""

from __future__ import annotations

import resource

import pytest

from flatland.runtime.client_limits import LimitedLog, connection_limit


@pytest.mark.parametrize(
    ("soft", "limit"), [(1024, 256), (4000, 1000), (4003, 1000), (resource.RLIM_INFINITY, 1000)]
)
def test_connections_may_use_a_quarter_of_the_files(
    monkeypatch: pytest.MonkeyPatch, soft: int, limit: int
) -> None:
    monkeypatch.setattr(resource, "getrlimit", {resource.RLIMIT_NOFILE: (soft, -1)}.__getitem__)
    assert connection_limit(1000) == limit


def test_an_equal_warning_is_logged_again_after_a_second(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    log = LimitedLog()
    for now, text in ((5.0, "a"), (5.9, "a"), (6.0, "a"), (6.5, "b"), (6.6, "a"), (7.5, "a")):
        monkeypatch.setattr("flatland.runtime.client_limits.time.monotonic", lambda now=now: now)
        log.warn(text)
    assert caplog.messages == ["a", "a", "b", "a"]
