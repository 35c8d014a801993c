"""The order of actions that the registrar carries out."""

from __future__ import annotations

from waiting import TIMEOUT

from flatland.ros.transport.registrar import Registrar


def test_topics_are_closed_after_those_that_are_opened_in_the_block(registrar: Registrar) -> None:
    done: list[str] = []
    with registrar.closing_last():
        registrar.submit_closing(lambda: done.append("close"))
        registrar.submit(lambda: done.append("open"))
        assert registrar.flush(TIMEOUT)
        assert done == ["open"]
    registrar.submit_closing(lambda: done.append("close at once"))
    registrar.submit(lambda: done.append("last"))
    assert registrar.flush(TIMEOUT)
    assert done == ["open", "close", "close at once", "last"]
