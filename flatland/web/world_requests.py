"""Requests of the server to a world, performed between two steps without blocking the loop."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Callable
from concurrent.futures import Future
from typing import Final, TypeVar

from flatland.world import World

_LOG = logging.getLogger("flatland")

_POLL_PERIOD: Final = 0.01  # s between two attempts in a world that no simulation runs
_SERVED_POLL_PERIOD: Final = 0.25  # s, in case the simulation that runs the world ends

R = TypeVar("R")


class WorldRequests:
    """Requests to one world; all methods are called in the thread of the loop.

    An action runs in the thread that steps the world, or in a helper thread if no simulation runs.
    """

    def __init__(self, world: World) -> None:
        """Creates an object without requests.

        Args:
            world: The world that performs the requests.
        """
        self._world = world
        self._jobs: set[asyncio.Task[None]] = set()

    async def run(self, action: Callable[[], R]) -> R:
        """Performs an action between two steps and returns its result.

        Raises:
            Exception: Raised by the action.
        """
        return await self.wait_for(self._world.post(action))

    async def wait_for(self, future: Future[R]) -> R:
        """Waits for a future that is completed between two steps, and returns its result.

        Raises:
            Exception: The exception of the future.
        """
        loop, requests = asyncio.get_running_loop(), self._world.requests
        waiter = loop.create_future()

        # Cheaper than `asyncio.wrap_future` and `asyncio.wait`; each capture waits.
        def wake() -> None:
            if not waiter.done():
                waiter.set_result(None)

        def wake_from_any_thread(_: Future[R]) -> None:
            with contextlib.suppress(RuntimeError):  # The loop was closed.
                loop.call_soon_threadsafe(wake)

        future.add_done_callback(wake_from_any_thread)
        try:
            while not future.done():
                # Without a running simulation, the thread that waits performs the requests.
                served = requests.served or await asyncio.to_thread(requests.process_if_idle)
                timer = loop.call_later(_SERVED_POLL_PERIOD if served else _POLL_PERIOD, wake)
                await waiter
                timer.cancel()
                waiter = loop.create_future()
        except asyncio.CancelledError:
            future.cancel()
            raise
        return future.result()

    def post(self, action: Callable[[], None]) -> None:
        """Performs an action between two steps without waiting, even if the server ends before."""
        if self._world.closed:
            return
        self._world.post(action).add_done_callback(_log_failure)
        task = asyncio.create_task(self._perform_posted())
        self._jobs.add(task)
        task.add_done_callback(self._jobs.discard)

    async def _perform_posted(self) -> None:
        """Performs the posted requests, unless a simulation does."""
        requests = self._world.requests
        while requests.actions and not requests.served:
            if not await asyncio.to_thread(requests.process_if_idle):
                await asyncio.sleep(_POLL_PERIOD)


def _log_failure(done: Future[None]) -> None:
    if not done.cancelled() and done.exception() is not None:
        _LOG.warning("web viewer: %s", done.exception())
