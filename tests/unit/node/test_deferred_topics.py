"""Topics that are opened after the first step, without ROS."""

from __future__ import annotations

from typing import Any

import pytest
from waiting import wait_until


def test_a_topic_that_cannot_be_opened_does_not_prevent_the_others(
    serve: Any,
    transport: Any,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError("no room for handles")

    monkeypatch.setattr(transport, "load_handle_server", lambda: fail)
    serve()
    wait_until("diagnostics", lambda: "/diagnostics" in transport.topics)
    assert "cannot publish interactive markers: no room for handles" in caplog.text
