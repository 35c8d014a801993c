"""Reads files in separate threads, because a file system that does not respond blocks for ever.

The threads are daemons: a read that never ends keeps neither the simulation nor the end of the
process waiting.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Final, TypeVar

from flatland.errors import WorldError

MAX_READS: Final = 8
"""Largest number of reads at the same time, including those that never end."""
TIME_LIMIT: Final = 10.0
"""Time limit of a read, including the time to parse the files [s]."""

R = TypeVar("R")

_free = threading.BoundedSemaphore(MAX_READS)


def read_in_time(action: Callable[[], R]) -> R:
    """Runs an action in a separate thread and returns its result.

    Args:
        action: Reads files.

    Raises:
        WorldError: The action does not end within `TIME_LIMIT`, or too many have not ended.
        Exception: Raised by the action.
    """
    done = _start(action)
    try:
        done.exception(TIME_LIMIT)
    except TimeoutError:
        raise _timed_out() from None
    return done.result()


async def read_in_time_async(action: Callable[[], R]) -> R:
    """Runs an action like `read_in_time`, without blocking the loop."""
    import asyncio  # Imported here because only viewers in a browser need it.

    done = asyncio.wrap_future(_start(action))
    await asyncio.wait([done], timeout=TIME_LIMIT)
    if not done.done():
        raise _timed_out()
    return done.result()


def _start(action: Callable[[], R]) -> Future[R]:
    if not _free.acquire(blocking=False):
        raise WorldError(f"{MAX_READS} requests are reading files already, try again later")
    done: Future[R] = Future()
    done.set_running_or_notify_cancel()

    def run() -> None:
        try:
            result = action()
        except BaseException as error:  # passed on to the thread that waits
            _free.release()
            done.set_exception(error)
        else:
            _free.release()
            done.set_result(result)

    threading.Thread(target=run, name="flatland-file-read", daemon=True).start()
    return done


def _timed_out() -> WorldError:
    return WorldError(f"the files were not read within {TIME_LIMIT:g} s")
