"""Reads in separate threads, with a time limit."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from waiting import TIMEOUT, wait_until

from flatland.errors import WorldError
from flatland.runtime import file_reads


def run_async(action: Callable[[], Any]) -> Any:
    return asyncio.run(file_reads.read_in_time_async(action))


@pytest.fixture(params=[file_reads.read_in_time, run_async])
def read(request: pytest.FixtureRequest) -> Callable[..., Any]:
    """Both forms of the function."""
    return request.param  # type: ignore[no-any-return]


@pytest.fixture
def blocked(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[], object]]:
    """A read that lasts until the end of the test, which exceeds the time limit."""
    monkeypatch.setattr(file_reads, "TIME_LIMIT", 0.01)
    release = threading.Event()
    yield lambda: release.wait(TIMEOUT)
    release.set()
    wait_until("the end of the reads", lambda: not reads())


def reads() -> list[threading.Thread]:
    return [each for each in threading.enumerate() if each.name == "flatland-file-read"]


def test_the_result_or_the_error_is_passed_on(read: Callable[..., Any]) -> None:
    assert read(lambda: threading.current_thread().name) == "flatland-file-read"
    with pytest.raises(OSError, match="no such disk"):
        read(lambda: (_ for _ in ()).throw(OSError("no such disk")))
    # The error of an action is not mistaken for the end of the time.
    with pytest.raises(TimeoutError, match="of the server"):
        read(lambda: (_ for _ in ()).throw(TimeoutError("of the server")))


def test_a_read_that_blocks_is_left_to_a_daemon_thread(
    read: Callable[..., Any], blocked: Callable[[], object]
) -> None:
    with pytest.raises(WorldError, match=r"the files were not read within 0\.01 s"):
        read(blocked)
    (thread,) = reads()
    assert thread.daemon


def test_the_number_of_reads_is_limited(
    read: Callable[..., Any], blocked: Callable[[], object]
) -> None:
    for _ in range(file_reads.MAX_READS):
        with pytest.raises(WorldError, match="not read within"):
            read(blocked)
    with pytest.raises(WorldError, match="8 requests are reading files already"):
        read(lambda: 1)


def test_a_thread_that_has_ended_is_replaced(read: Callable[..., Any]) -> None:
    assert [read(lambda n=n: n) for n in range(20)] == list(range(20))
